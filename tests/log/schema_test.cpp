#include "log/schema.hpp"

#include <bit>
#include <cstring>

namespace tandem::log {
namespace {

hal::Layout layout() {
  hal::Layout layout;
  layout.add("time_ns", hal::FieldType::kI64, 1, "when");
  layout.add("position_rad", hal::FieldType::kF64, 3, "link side");
  layout.add("empty", hal::FieldType::kF64, 0, "");
  layout.add("fault", hal::FieldType::kU32, 2, "");
  layout.add("mode", hal::FieldType::kI8, 2, "");
  return layout;
}

TEST(Schema, WritesOneMemberPerFieldThatHasElements) {
  EXPECT_EQ(ros2msg_of(layout()),
            "int64 time_ns  # when\n"
            "float64[3] position_rad  # link side\n"
            "uint32[2] fault\n"
            "int8[2] mode\n");
}

TEST(Schema, ReadsBackTheLayoutThatItWrote) {
  const auto back = layout_of(ros2msg_of(layout()));
  ASSERT_TRUE(back) << back.error().to_string();
  EXPECT_EQ(back->bytes(), layout().bytes());
  for (const hal::Field& field : back->fields()) {
    const hal::Layout original = layout();
    const hal::Field* same = original.find(field.name);
    ASSERT_NE(same, nullptr) << field.name;
    EXPECT_EQ(field.type, same->type);
    EXPECT_EQ(field.count, same->count);
    EXPECT_EQ(field.offset, same->offset);
    EXPECT_EQ(field.doc, same->doc);
  }
}

TEST(Schema, RefusesWhatIsNoFixedSizeNumber) {
  for (const char* bad : {"string text", "float64[] values", "float64[3 values", "float64",
                          "float64[99999999999] x", "float64[3]x y", "int8 a\nfloat64 b"}) {
    EXPECT_FALSE(layout_of(bad)) << bad;
  }
}

TEST(Schema, ReadsEachTypeOfElement) {
  const hal::Layout of = layout();
  std::vector<std::byte> body(of.bytes());
  const double position = -1.25;
  std::memcpy(body.data() + 8 + 16, &position, 8);
  body[0] = std::byte{7};
  body[8 + 24 + 4] = std::byte{0xFF};
  body[8 + 24 + 8] = std::byte{0xFE};
  EXPECT_EQ(element(*of.find("time_ns"), body, 0), 7.0);
  EXPECT_EQ(element(*of.find("position_rad"), body, 2), -1.25);
  EXPECT_EQ(element(*of.find("fault"), body, 1), 255.0);
  EXPECT_EQ(element(*of.find("mode"), body, 0), -2.0);
}

}  // namespace
}  // namespace tandem::log
