// Equations to parameters, and parameters to what people ask for: links, joints, warnings.
// Layer: identification.  Thread: non-RT only.
#pragma once

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

}  // namespace tandem::identification
