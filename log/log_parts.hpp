// The files of a log in several: their names, and what of them is there.
// Layer: log.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "log/damage.hpp"

namespace tandem::log {

/// A log of `[log] file_MB`: "runs/arm-001.mcap" is the first file and the name of all of them;
/// "runs/arm-001.2.mcap" is the second.
/// @param name  of all of them
[[nodiscard]] std::string part_path(const std::string& name, std::uint64_t number);

/// "runs/arm-001.branch-2.mcap", of a run that went back in time `number` - 1 times.
[[nodiscard]] std::string branch_path(const std::string& name, std::uint64_t number);
/// The name of the first one and the number, of "arm-001.branch-2.mcap"; of another file its own
/// and 1.
[[nodiscard]] std::pair<std::string, std::uint64_t> branch_of(const std::string& file);

/// The part that a path names, and all of them: "a.2.mcap" is part 2 of "a.mcap". Part 1 alone is
/// "a.1.mcap", a name that no file has. Empty: the path has no number.
struct PartName {
  std::string all;
  std::uint64_t number = 0;
};
[[nodiscard]] std::optional<PartName> part_of(const std::string& path);

/// Paths beside `name` that can be its parts, by their numbers; whether they are, their content
/// says.
[[nodiscard]] std::map<std::uint64_t, std::string> parts_of(const std::string& name);

/// One file of a log, and what of the run is in it.
struct LogPart {
  std::uint64_t number = 0;  ///< from 1; 0: the log is in one file
  std::string path{};
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;
  std::int64_t first_ns = 0;  ///< time of the first message; without messages 0
  std::int64_t last_ns = 0;
  bool truncated = false;
  bool being_written = false;    ///< truncated, as a run of this machine still writes it
  std::vector<Damage> damage{};  ///< what of it was left out
};

/// Why a file is cut: "its run is still writing it", or "its run was killed, or …".
[[nodiscard]] std::string reason_of_cut(bool being_written);
/// The same with what to do about it.
[[nodiscard]] std::string hint_of_cut(bool being_written);

/// Parts that are not there. `last` 0: nobody knows how many follow.
struct MissingParts {
  std::uint64_t first = 0, last = 0;
};
/// @param parts      by their numbers, one at least
/// @param goes_on    the last one says that another follows
[[nodiscard]] std::vector<MissingParts> missing_of(const std::vector<LogPart>& parts, bool goes_on);
/// "part 3", "parts 1 to 4", "part 5 and what follows"
[[nodiscard]] std::string to_string(const MissingParts& missing);

}  // namespace tandem::log
