#include "runtime/run/retreats.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace tandem::runtime {
namespace {

using hal::StopCategory;

/// @param asked  what the file says
/// @param more   places of the same file that ask for it, too
Error no_retreat(const Composition& c, const std::string& asked, std::size_t more) {
  const std::string others = more == 0 ? "" : fmt::format(", and so will {} more", more);
  return {.message = fmt::format("\"{}\" will be category 1{}: no controller of {} can bring the "
                                 "robot to a safe posture",
                                 asked, others, c.experiment.file),
          .hint = "add a controller that can retreat, such as squat, or say ",
          .file = {},
          .key = {}};
}

}  // namespace

Diagnostics missing_retreats(const Composition& c) {
  if (std::ranges::any_of(c.notes, &ControllerNote::retreats)) return {};
  Diagnostics warnings;
  const hal::RobotConfig& robot = c.experiment.robot;
  std::vector<std::pair<int, std::string>> keys;  // by line
  if (robot.emergency_stop == StopCategory::kCategory2)
    keys.emplace_back(robot.emergency_stop.line, "safety.emergency_stop");
  for (const hal::JointConfig& joint : robot.joints) {
    if (joint.on_fault == StopCategory::kCategory2)
      keys.emplace_back(joint.on_fault.line, "joint." + joint.name + ".on_fault");
  }
  if (!keys.empty()) {
    std::ranges::sort(keys);
    Error& warning = warnings.emplace_back(no_retreat(c, "category2", keys.size() - 1));
    warning.hint += "\"category1\" (docs/safety.md)";
    warning.file = robot.file;
    std::tie(warning.line, warning.key) = keys.front();
  }
  const auto& collision = c.experiment.estimation.collision;
  if (collision && collision->reaction == StopCategory::kCategory2) {
    TomlTable estimation = c.experiment.document.root().table_or_empty("estimation");
    Error& warning = warnings.emplace_back(no_retreat(c, "retract", 0));
    warning.hint += "\"hold\"";
    warning.file = c.experiment.file;
    warning.line = estimation.table_or_empty("collision").line("reaction");
    warning.key = "estimation.collision.reaction";
  }
  return warnings;
}

}  // namespace tandem::runtime
