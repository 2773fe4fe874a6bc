// Where the torques of a log were measured: at the motors, or behind their rotors.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include "identification/samples.hpp"
#include "model/tree.hpp"

namespace tandem::identification {

/// Whether the torques of the drives without a spring hold nothing of the described rotors, as
/// those of sensors between gear and link do: with the rotors taken as 0 the equations fit clearly
/// better than with the described ones, and no share of these above 5 % fits better still.
/// @param equations  of all logs, whose rotors are in the links' rows
[[nodiscard]] bool measured_behind_rotors(IdentifiedRobot& robot, const model::Tree& tree,
                                          const Equations& equations);

}  // namespace tandem::identification
