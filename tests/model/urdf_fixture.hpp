// A small arm as URDF text, and how the tests of its reader change it and look at errors.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "model/urdf.hpp"

namespace tandem::model {

// A pendulum on a post: a fixed joint, two moving ones and a massless tip.
inline const char* const kRobot = R"(<robot name="arm">
  <link name="post"/>
  <link name="upper">
    <inertial>
      <origin xyz="0 0 -0.5" rpy="0 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/>
    </inertial>
  </link>
  <link name="lower">
    <inertial>
      <mass value="1"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>
    </inertial>
  </link>
  <link name="weight">
    <inertial>
      <mass value="3"/>
      <inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/>
    </inertial>
  </link>
  <link name="tip"/>
  <joint name="shoulder" type="revolute">
    <parent link="post"/>
    <child link="upper"/>
    <origin xyz="0 0 1"/>
    <axis xyz="0 2 0"/>
    <limit lower="-1" upper="2" velocity="3" effort="4"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="upper"/>
    <child link="lower"/>
    <origin xyz="0 0 -1" rpy="1.5707963267948966 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="0" upper="0.5" velocity="1" effort="10"/>
  </joint>
  <joint name="bolt" type="fixed">
    <parent link="lower"/>
    <child link="weight"/>
    <origin xyz="0 0 0.2"/>
  </joint>
  <joint name="end" type="fixed">
    <parent link="weight"/>
    <child link="tip"/>
    <origin xyz="0 0 0.1"/>
  </joint>
</robot>
)";

/// `text` with `from` (which must occur once) replaced by `to`.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << from << " occurs twice";
  return text.replace(at, from.size(), to);
}
inline std::string with(const std::string& from, const std::string& to) {
  return replaced(kRobot, from, to);
}

inline std::string to_text(const Diagnostics& errors) {
  std::string all;
  for (const Error& error : errors) all += error.to_string() + "\n";
  return all;
}

inline std::string errors_of(const std::string& text, const UrdfOptions& options = {}) {
  const auto model = parse_urdf(text, "arm.urdf", options);
  return model.has_value() ? "" : to_text(model.error());
}

inline void expect_error(const std::string& text, const std::string& expected,
                         const UrdfOptions& options = {}) {
  EXPECT_EQ(errors_of(text, options), expected + "\n");
}

}  // namespace tandem::model
