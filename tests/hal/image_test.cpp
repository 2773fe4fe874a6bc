// The tables of the images' fields, and what follows from them.
#include "hal/image.hpp"

#include <gtest/gtest.h>

#include <regex>

#include "hal/truth.hpp"
#include "hal/wire_name.hpp"

namespace tandem::hal {
namespace {

const ImageShape kShape{.joints = 3, .sensor_channels = {6, 10}};

/// One image of each kind, with elements in every field.
struct Images {
  StateImage state{kShape};
  CommandImage command{kShape};
  TruthImage truth{3, 2, 1, 2};
  std::array<const Image*, 3> all{&state, &command, &truth};
};

TEST(WireName, IsTheNameInLowerCase) {
  EXPECT_EQ(wire_name("torque_Nm"), "torque_nm");
  EXPECT_EQ(wire_name("damping_Nms_rad"), "damping_nms_rad");
  EXPECT_EQ(wire_name("acceleration_rad_s2"), "acceleration_rad_s2");
}

TEST(Images, HaveFieldNamesThatRos2Allows) {
  const std::regex allowed("[a-z](_?[a-z0-9]+)*");
  for (const Image* image : Images().all) {
    for (const Field& field : image->layout().fields()) {
      EXPECT_TRUE(std::regex_match(field.name, allowed)) << field.name;
      EXPECT_EQ(image->layout().find(field.name), &field) << field.name << " is there twice";
    }
  }
}

TEST(Images, HaveNoPaddingBetweenTheirFields) {
  for (const Image* image : Images().all) {
    std::size_t end = 0;
    for (const Field& field : image->layout().fields()) {
      EXPECT_EQ(field.offset, end) << field.name;
      EXPECT_EQ(field.offset % size_of(field.type), 0u)
          << field.name << " stands behind a field of smaller elements: types of 8 bytes come "
          << "first, then of 4, 2, 1";
      end = field.offset + field.count * size_of(field.type);
    }
    EXPECT_EQ(image->bytes().size(), end);
  }
}

TEST(Images, AccessTheFieldOfTheSameName) {
  Images images;
  const auto at = [](const Image& image, const char* field) {
    return image.bytes().data() + image.layout().find(field)->offset;
  };
  EXPECT_EQ(std::as_bytes(images.state.torque_Nm()).data(), at(images.state, "torque_nm"));
  EXPECT_EQ(images.state.torque_Nm().size(), 3u);
  EXPECT_EQ(images.state.sensor().size(), 16u);
  EXPECT_EQ(images.state.sensor_age_cycles().size(), 2u);
  EXPECT_EQ(images.state.sensor_values(1).data(), images.state.sensor().data() + 6);
  EXPECT_EQ(std::as_bytes(images.command.fault_reset()).data(), at(images.command, "fault_reset"));
  EXPECT_EQ(std::as_bytes(images.truth.foot_force_N()).data(), at(images.truth, "foot_force_n"));
  EXPECT_EQ(images.truth.foot_force_N().size(), 6u);
  EXPECT_EQ(images.truth.passive(), 2u);
}

}  // namespace
}  // namespace tandem::hal
