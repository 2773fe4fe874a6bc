// What is lost between a motor's current and the torque on the link.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <vector>

#include "identification/identify.hpp"

namespace tandem::identification {

/// N K i - torque = J th'' + b th' + c sign(th') + o, by least squares of one motor.
struct MotorEstimate {
  Estimate rotor_kg_m2;  ///< J; not identifiable of a rigid drive: the link's row has it
  Estimate viscous_Nms_rad, coulomb_Nm, offset_Nm;
};

/// @param scales  what counts as much of J, b, c and o
/// @return nothing identifiable when there are few instants, or the motor does not move
[[nodiscard]] MotorEstimate estimate_motor(const std::vector<MotorInstant>& instants, bool rigid,
                                           const Eigen::Vector4d& scales);

/// Whether a joint's parameter is known well enough: to a third of its value, or to a fiftieth of
/// what would be much.
[[nodiscard]] bool known(double value, double ci95, double scale);

}  // namespace tandem::identification
