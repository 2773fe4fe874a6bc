// [teleoperation] of an experiment: the link between the operator's loop and the robot.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/toml_reader.hpp"
#include "hal/remote/operator_end.hpp"
#include "runtime/controller_spec.hpp"

namespace tandem::runtime {

struct Teleoperation {
  remote::TeleConfig link;  ///< its seed is left to the caller
  /// The link is there, and slow by itself: in real time nothing is added to it.
  bool real = false;
  /// [[teleoperation.robot_controller]]: at the robot's end, by its own state
  std::vector<ControllerSpec> robot_controllers;
};

/// The cycles of the robot from what an operator saw to the effect of what it commanded then: down,
/// and play-out.
[[nodiscard]] std::uint64_t playout_cycles(const Teleoperation& t, std::int64_t period_ns);

/// The robot controllers and their parameters, as remote::RobotEnd has them: by name, and by key.
[[nodiscard]] std::map<std::string, std::string> robot_controller_values(const Teleoperation& t);

/// Reads it, strictly; empty when the experiment has no such table.
[[nodiscard]] std::optional<Teleoperation> read_teleoperation(TomlTable& root);

}  // namespace tandem::runtime
