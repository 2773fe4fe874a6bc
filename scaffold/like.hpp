// Springs and gains taken from a robot that has them.
// Layer: scaffold.  Thread: non-RT.
#pragma once

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// Gives each joint the drive of the joint of `like` that it resembles most (kind of limb,
/// direction of its axis, place in the limb), scaled by mass times reach: a motor of so many
/// windings side by side, springs and gains of so many times the stiffness.
void take_drives(const Like& like, const std::vector<JointLoad>& loads, NewRobot& robot);

/// mass times reach of one robot over that of the other.
[[nodiscard]] double scale_of(const model::Tree& robot, const model::Tree& like);

}  // namespace tandem::scaffold
