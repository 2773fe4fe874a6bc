// The plant of an emulated robot: what robot.toml, the experiment and its changes of the plant make
// of it.
// Layer: hal/sim.  Thread: non-RT only.
#pragma once

#include "hal/sim/emulated_robot.hpp"

namespace tandem::sim {

/// @param robot  as the kernels have it; config.changes says what of the plant is other
/// Errors: Plant::create()'s; a posture that the robot lacks; a payload that comes or goes, where
/// an engine keeps its bodies' mass; a sub-step that is unstable in the posture.
[[nodiscard]] Result<Plant> make_plant(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                                       const SimRobotConfig& config);

}  // namespace tandem::sim
