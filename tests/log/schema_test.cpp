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
  EXPECT_EQ(ros2msg_of(layout(), {}),
            "int64 time_ns  # when\n"
            "float64[3] position_rad  # link side\n"
            "uint32[2] fault\n"
            "int8[2] mode\n");
}

TEST(Schema, ReadsBackTheLayoutThatItWrote) {
  const auto back = layout_of(ros2msg_of(layout(), {}));
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

/// A viewer showed position_rad[3], and nobody knew which joint that is.
TEST(Schema, TellsJointsAndSensorsByTheirNames) {
  const RunInfo info{.joints = {"Left-Knee", "left__knee", "9"}, .sensors = {{"foot", 2}}};
  hal::Layout layout;
  layout.add("position_rad", hal::FieldType::kF64, 3, "link side");
  layout.add("velocity_rad_s", hal::FieldType::kF64, 3, "");
  layout.add("base_position_m", hal::FieldType::kF64, 3, "");
  layout.add("sensor", hal::FieldType::kF64, 2, "");
  layout.add("fault", hal::FieldType::kU32, 3, "");
  layout.add("sensor_age_cycles", hal::FieldType::kU32, 1, "");
  const std::string text = ros2msg_of(layout, info), line(80, '=');
  EXPECT_EQ(text,
            "tandem/JointsFloat64 position_rad  # link side\n"
            "tandem/JointsFloat64 velocity_rad_s\n"
            "float64[3] base_position_m\n"
            "tandem/ChannelsFloat64 sensor\n"
            "tandem/JointsUint32 fault\n"
            "tandem/SensorsUint32 sensor_age_cycles\n" +
                line + "\nMSG: tandem/JointsFloat64\n" +
                "float64 left_knee\nfloat64 left_knee_1\nfloat64 n9\n" +  //
                line + "\nMSG: tandem/ChannelsFloat64\nfloat64 foot_0\nfloat64 foot_1\n" + line +
                "\nMSG: tandem/JointsUint32\n" +
                "uint32 left_knee\nuint32 left_knee_1\nuint32 n9\n" +  //
                line + "\nMSG: tandem/SensorsUint32\nuint32 foot\n");
  const auto back = layout_of(text);
  ASSERT_TRUE(back) << back.error().to_string();
  ASSERT_EQ(back->fields().size(), layout.fields().size());
  for (std::size_t i = 0; i < layout.fields().size(); ++i) {
    EXPECT_EQ(back->fields()[i].name, layout.fields()[i].name);
    EXPECT_EQ(back->fields()[i].type, layout.fields()[i].type);
    EXPECT_EQ(back->fields()[i].count, layout.fields()[i].count);
    EXPECT_EQ(back->fields()[i].offset, layout.fields()[i].offset);
  }
}

TEST(Schema, RefusesPartsThatAreNoNumbersOfOneType) {
  const std::string begin = "tandem/Part x\n" + std::string(80, '=') + "\nMSG: tandem/Part\n";
  EXPECT_TRUE(layout_of(begin + "float64 a\nfloat64[2] b\n"));
  for (const char* bad : {"", "float64 a\nfloat32 b\n", "float64 a\nuint8 b\n", "string text\n",
                          "tandem/Part again\n", "float64[90000] a\nfloat64[90000] b\n"}) {
    EXPECT_FALSE(layout_of(begin + bad)) << bad;
  }
  EXPECT_FALSE(layout_of("tandem/Absent x\n"));
  EXPECT_FALSE(
      layout_of("tandem/Part[2] x\n" + std::string(80, '=') + "\nMSG: tandem/Part\nfloat64 a\n"));
  const std::string twice = std::string(80, '=') + "\nMSG: tandem/Part\nfloat64 a\n";
  EXPECT_FALSE(layout_of("tandem/Part x\n" + twice + twice));
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
