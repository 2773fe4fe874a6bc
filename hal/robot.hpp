// A robot as its controllers know it: joints, sensors, sites, feet, postures, loops. Nothing of
// boards, buses and drives: how it is wired is no controller's business, and may change without
// building one again.
// Layer: hal.  Thread: non-RT to make; immutable afterwards.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hal/follower.hpp"
#include "hal/image.hpp"
#include "hal/joint_capabilities.hpp"
#include "model/kinematic_loop.hpp"

namespace tandem::hal {

/// A driven joint.
struct DrivenJoint : JointCapabilities {
  std::string name;  ///< of the URDF
};

/// A joint that moves but has no motor and no encoder.
struct PassiveJoint {
  std::string name;           ///< of the URDF
  double position_rad = 0.0;  ///< at the start; where loops close, from near here
};

enum class SensorType : std::uint8_t { kForceTorque, kImu };

/// force_torque channels: fx fy fz [N] tx ty tz [Nm].
/// imu channels: qx qy qz qw (sensor to W), wx wy wz [rad/s], ax ay az [m/s^2] specific force,
/// the last six in the sensor's frame.
[[nodiscard]] constexpr std::size_t channels_of(SensorType type) noexcept {
  return type == SensorType::kForceTorque ? 6 : 10;
}

struct Sensor {
  std::string name;
  SensorType type = SensorType::kForceTorque;
  std::string joint;  ///< force_torque: measures the wrench through this joint
  std::string link;   ///< the frame it is expressed in

  [[nodiscard]] std::size_t channels() const { return channels_of(type); }
};

/// A named frame of the model.
struct Site {
  std::string name;
  std::string link;                 ///< URDF link the frame is fixed to
  std::array<double, 3> xyz_m{};    ///< origin in the link's frame
  std::array<double, 3> rpy_rad{};  ///< URDF convention
  bool wrench = false;              ///< an external wrench may act here (contact)
};

/// Points of a sole that may touch the ground.
struct Foot {
  std::string site;                             ///< a site with wrench = true
  std::vector<std::array<double, 3>> points_m;  ///< in the site's frame
};

struct Posture {
  std::string name;
  double base_height_m = 0.0;        ///< of the base's origin above W's; floating base only
  std::vector<double> position_rad;  ///< by joint, in the image's order
};

struct Robot {
  std::string name;
  std::string file;  ///< the robot.toml's path, for messages
  bool floating_base = false;
  std::vector<DrivenJoint> joints = {};    ///< in the image's order
  std::vector<PassiveJoint> passive = {};  ///< in the dynamics, not in the image
  std::vector<Follower> followers = {};    ///< the same: they go with joints of the image
  std::vector<model::KinematicLoop> loops = {};
  std::vector<Sensor> sensors = {};  ///< in the image's order
  std::vector<Site> sites = {};
  std::vector<Foot> feet = {};
  std::vector<Posture> postures = {};

  [[nodiscard]] ImageShape shape() const;
  /// Index in `joints`, or -1.
  [[nodiscard]] int joint_index(std::string_view name) const;
  /// What to say of a name that is not in `joints`: of a follower, whom it follows.
  [[nodiscard]] Error no_joint(std::string_view name) const;
  [[nodiscard]] int sensor_index(std::string_view name) const;
  [[nodiscard]] bool is_passive(std::string_view name) const;
  [[nodiscard]] std::vector<std::string> passive_names() const;
  /// Null when there is no posture of that name.
  [[nodiscard]] const Posture* posture(std::string_view name) const;
};

}  // namespace tandem::hal
