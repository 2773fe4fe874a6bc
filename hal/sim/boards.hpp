// Fills the boards' image from the emulated robot.
// Layer: hal/sim.  Thread: create non-RT; fill RT.
#pragma once

#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "hal/backend.hpp"
#include "hal/boards.hpp"
#include "hal/sim/emulated_robot.hpp"

namespace tandem::sim {

/// Copies what motors and drives are in now, joints in the process image's order.
class BoardsFiller {
 public:
  /// @param robot  outlives it; @param config  of the same
  BoardsFiller(EmulatedRobot& robot, const hal::RobotConfig& config);

  /// What the wire and the emulator know is left as it is.
  /// @pre  plant().evaluate() since its last advance, as after a step
  void fill(const hal::CycleTime& time, hal::BoardsImage& boards) const noexcept TANDEM_RT;

 private:
  struct Drive {
    const firmware::Axis* axis = nullptr;  // null: the joint has none
    const std::uint8_t* powered = nullptr;
  };
  const EmulatedRobot* robot_;
  std::vector<Drive> drives_;  // by joint
};

}  // namespace tandem::sim
