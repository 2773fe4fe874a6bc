// Damping and friction of the description's joints (<dynamics>), put into the drives.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// Adds to each rigid drive the damping and the dry friction of its joints. A drive whose joints
/// differ in them is split; what would take more than half of a joint's effort (damping at its
/// speed) is left out, with a warning. The reader's warning that nothing is used goes.
/// @pre  `robot` has its tree, limits and drives, and no gains yet
void add_described_dynamics(NewRobot& robot);

}  // namespace tandem::scaffold
