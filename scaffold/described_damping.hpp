// The damping of the description's joints (<dynamics>), put into the drives.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// Adds to each rigid drive the damping of its joints. A drive whose joints differ in it is split;
/// a damping that would take more than half of a joint's effort at its speed is left out, with a
/// warning. So is Coulomb friction, which robot.toml has no key for. The reader's warning that
/// nothing is used goes.
/// @pre  `robot` has its tree, limits and drives, and no gains yet
void add_described_damping(NewRobot& robot);

}  // namespace tandem::scaffold
