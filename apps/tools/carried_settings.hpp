// What an experiment that replays a log takes over from the log's own experiment, so that the
// simulation is the same.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/toml_reader.hpp"
#include "log/info.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {

/// The experiment whose run a log is of; empty: of none, as an import.
[[nodiscard]] std::optional<TomlDocument> experiment_of(const log::RunInfo& info);

struct CarriedSettings {
  std::uint64_t seed = 1;
  std::optional<std::int64_t> period_ns;          ///< empty: the experiment says nothing of it
  std::string tables;                             ///< TOML, of what else it says: [sim], [hal], …
  std::map<std::string, double> damping_Nms_rad;  ///< of joints' links, by its controllers
  std::vector<std::string> keys;  ///< all of it: "seed", "period_ns", "sim.engine", …
};

/// All of [sim]; of [hal] what is not the backend; [faults] fall; seed and period; and the
/// `link_damping_Nms_rad` of the bundled controllers that were active. Not what runs and watches a
/// robot without being a part of it: [estimation], [clock], [dds] and others.
/// @param robot  that replays it
[[nodiscard]] CarriedSettings carried_settings(const log::RunInfo& info,
                                               const robot::RobotFiles& robot);

}  // namespace tandem::apps
