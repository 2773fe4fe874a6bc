// Closed loops before a run: whether they close in a posture, where the passive joints then stand,
// and what can still move. Needs no generated kernels.
// Layer: robot.  Thread: main.
#pragma once

#include <expected>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "model/kernels.h"
#include "model/tree.hpp"

namespace tandem::robot {

/// The loops in one posture.
struct ClosureInPosture {
  std::string posture;  ///< of robot.toml; empty: every joint at 0
  bool closed = false;
  double start_gap_m = 0.0;  ///< the widest, with the passive joints where they start from
  std::vector<std::pair<std::string, double>> passive;  ///< where they stand then [rad or m]
};

struct ClosureStudy {
  std::vector<ClosureInPosture> postures;
  std::size_t freedom = 0;       ///< degrees that remain with the loops closed
  std::size_t open_freedom = 0;  ///< of the tree that the loops close
  Diagnostics errors;  ///< a loop that does not close, with its line and what is left open
};

/// Empty for a robot without loops.
///
/// @param kernels   any of the robot's, which know the sites of its loops
/// @param postures  names of robot.toml; an empty name: every joint at 0
[[nodiscard]] ClosureStudy study_loops(const hal::RobotConfig& robot, const tandem_kernels& kernels,
                                       std::span<const std::string> postures);

/// A loop between two sites of one body closes nothing.
[[nodiscard]] Diagnostics check_loop_bodies(const hal::RobotConfig& robot, const model::Tree& tree);

}  // namespace tandem::robot
