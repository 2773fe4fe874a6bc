// Equations to parameters, and parameters to what people ask for: links, joints, warnings.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <vector>

#include "hal/config/robot_config.hpp"
#include "identification/identify.hpp"
#include "identification/samples.hpp"
#include "model/tree.hpp"

namespace tandem::identification {

/// Estimates from the first two thirds of every log, compares on the rest of it, and fills `out`.
/// @param equations  of all logs, long enough and of a robot that moves
void answer(const hal::RobotConfig& config, const model::Tree& tree, IdentifiedRobot& robot,
            const Equations& equations, Identification& out);

/// The parameters that answer() writes, all columns of the equations.
[[nodiscard]] Eigen::VectorXd fitted(const hal::RobotConfig& config, const model::Tree& tree,
                                     IdentifiedRobot& robot, const Equations& equations);

// motor.cpp: what is lost between a motor's current and the torque on the link.

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
