// Springs and gains taken from a robot that has them.
// Layer: scaffold.  Thread: non-RT.
#pragma once

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// Gives each joint the drive of the joint of `like` that it resembles most (kind of limb,
/// direction of its axis, place in the limb), scaled by mass times reach: a motor of so many
/// windings side by side, springs and gains of so many times the stiffness. A joint that would
/// sag by more than a degree under gravity, or whose motor would get too hot of it, has a firmer
/// drive of `like`, and where none is enough that drive once more so many times as large; the
/// remarks say which. A joint of a leg may sag: it is loaded slowly. Slides have rigid drives.
/// @param torques  (joints) of torques_at(), in the first posture
void take_drives(const Like& like, const std::vector<JointLoad>& loads,
                 const std::vector<double>& torques, double period_s, NewRobot& robot);

/// mass times reach of one robot over that of the other.
[[nodiscard]] double scale_of(const model::Tree& robot, const model::Tree& like);

}  // namespace tandem::scaffold
