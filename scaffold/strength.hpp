// Whether drives are strong enough for what hangs on them.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include "hal/config/strength.hpp"
#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// A warning for each joint that cannot hold the posture `torques` belong to, with what to do.
/// @param torques  (joints) of torques_at(), in the tree's order
[[nodiscard]] Diagnostics weak_drives(const NewRobot& robot, const std::vector<double>& torques);

}  // namespace tandem::scaffold
