// Closed loops before a run: whether they close in a posture, where the passive joints then stand,
// and what can still move. Needs no generated kernels.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <expected>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/text/console.hpp"
#include "hal/config/robot_config.hpp"
#include "model/tree.hpp"

namespace tandem::apps {

/// The loops in one posture.
struct LoopClosing {
  std::string posture;  ///< of robot.toml; empty: every joint at 0
  bool closed = false;
  double start_gap_m = 0.0;  ///< the widest, with the passive joints where they start from
  std::vector<std::pair<std::string, double>> passive;  ///< where they stand then [rad or m]
};

struct LoopStudy {
  std::vector<LoopClosing> postures;
  std::size_t freedom = 0;       ///< degrees that remain with the loops closed
  std::size_t open_freedom = 0;  ///< of the tree that the loops close
  Diagnostics errors;  ///< a loop that does not close, with its line and what is left open
};

/// Empty for a robot without loops.
///
/// @param robot     completed from its description, whose tree `tree` is
/// @param postures  names of robot.toml; an empty name: every joint at 0
[[nodiscard]] LoopStudy study_loops(const hal::RobotConfig& robot, const model::Tree& tree,
                                    std::span<const std::string> postures);

/// Every posture of the robot; every joint at 0 when it has none.
[[nodiscard]] std::vector<std::string> postures_of(const hal::RobotConfig& robot);

/// A loop between two sites of one body closes nothing.
[[nodiscard]] Diagnostics check_loop_bodies(const hal::RobotConfig& robot, const model::Tree& tree);

void add_loop_facts(const hal::RobotConfig& robot, const LoopStudy& study, Facts& facts);

/// `loops`, `loop_postures` and `freedom` of docs/json.md.
void add_loop_json(const hal::RobotConfig& robot, const LoopStudy& study, Json& json);

}  // namespace tandem::apps
