// [teleoperation] of an experiment: the link between the operator's loop and the robot.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <optional>
#include <vector>

#include "base/toml_reader.hpp"
#include "hal/remote/tele_backend.hpp"
#include "runtime/controller_spec.hpp"

namespace tandem::runtime {

struct Teleoperation {
  remote::TeleConfig link;  ///< its seed is left to the caller
  /// [[teleoperation.robot_controller]]: at the robot's end, by its own state
  std::vector<ControllerSpec> robot_controllers;
};

/// Reads it, strictly; empty when the experiment has no such table.
[[nodiscard]] std::optional<Teleoperation> read_teleoperation(TomlTable& root);

}  // namespace tandem::runtime
