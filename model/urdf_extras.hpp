// What a URDF says of its joints that is no part of the tree: soft limits, rates, damping, and an
// effort of 0.
// Layer: model.  Thread: any, non-RT.
#pragma once

#include <limits>
#include <map>
#include <string>
#include <string_view>

namespace tandem::model {

/// NaN where the description gives none, or one that makes no sense.
struct JointExtras {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double soft_lower = kNone;  ///< of <safety_controller> [rad or m]
  double soft_upper = kNone;
  double acceleration = kNone;  ///< to gain and to lose speed [rad/s^2 or m/s^2]
  double jerk = kNone;          ///< [rad/s^3 or m/s^3]
  double damping = 0.0;         ///< of <dynamics> [Nms/rad or Ns/m]
  double friction = 0.0;        ///< [Nm or N]
  bool no_effort = false;       ///< an <limit effort> of 0, said and not left out
};

/// By joint; those that have none of it are left out.
/// @pre  parse_urdf() takes the description
[[nodiscard]] std::map<std::string, JointExtras> joint_extras(std::string_view text);

}  // namespace tandem::model
