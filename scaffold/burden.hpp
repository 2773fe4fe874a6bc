// Whether a robot's drives can carry it, wherever its joints are.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <optional>

#include "scaffold/loads.hpp"
#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

struct Burden {
  Error told;          ///< a warning: the worst joint, and what to do
  bool grams = false;  ///< a thousandth of the masses would be right: nothing else is worth saying
};

/// None when each drive can hold what gravity asks for: of a leg's joint in the standing posture,
/// of every other one at its worst.
/// @param loads  of loads_of(), with what legs bear
[[nodiscard]] std::optional<Burden> overburdened(const NewRobot& robot,
                                                 const std::vector<JointLoad>& loads);

}  // namespace tandem::scaffold
