// Where the torques of a log were measured: at the motors, or behind their rotors.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <vector>

#include "identification/samples.hpp"
#include "model/tree.hpp"

namespace tandem::identification {

/// Whether each coordinate's torques hold nothing of its described rotor, as those of a
/// sensor between gear and link do. The data say so where they know the rotor within a tenth of
/// its description and find none; where they cannot say, it is as with the other joints, if these
/// agree. No where the drive has a spring: then the rotor is behind it.
/// @param equations  of all logs, whose rotors are in the links' rows
[[nodiscard]] std::vector<bool> measured_behind_rotors(IdentifiedRobot& robot,
                                                       const model::Tree& tree,
                                                       const Equations& equations);

}  // namespace tandem::identification
