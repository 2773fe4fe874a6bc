// Buses, boards and nodes of a new robot.
// Layer: scaffold.  Thread: non-RT.
#pragma once

#include "base/result.hpp"
#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

/// A bus for each limb, two joints a board, sensors on the bus of their limb; a limb that is too
/// much for one bus is cut into as few as can carry it at 1 kHz. Fills `config`'s buses, boards
/// and sensors, and each joint's board and axis.
/// Errors: not even two boards fit on a bus.
[[nodiscard]] Status wire(NewRobot& robot);

}  // namespace tandem::scaffold
