// The ground under a new robot's feet.
// Layer: scaffold.  Thread: non-RT.
#pragma once

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// Fills the sites of the feet and [contact]: stiffness and damping per point in proportion to
/// the weight on it, so that every robot sinks in as `like` does (null: as COMAN does).
void fill_ground(const hal::RobotConfig* like, NewRobot& robot);

}  // namespace tandem::scaffold
