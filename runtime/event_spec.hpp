// What happens in a run, and when: a row of [[event]], or of [[push]] and [[fault]] with a
// condition.
// Layer: runtime.  Thread: plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hal/sim/fault_injection.hpp"

namespace tandem::runtime {

struct EventSpec {
  std::string name;
  std::string row;            ///< "push[0]"
  std::int64_t at_ns = -1;    ///< of the run; below 0: `when` says it
  std::string when;           ///< a condition, looked at since the controllers started
  std::int64_t after_ns = 0;  ///< after the first cycle in which it held
  bool optional = false;      ///< it need not come
  std::optional<sim::ScenarioFault> fault;    ///< this is injected, or
  std::string ask;                            ///< this is asked for: a request as JSON
  int line = 0, when_line = 0, ask_line = 0;  ///< in the file
};

/// Whether a row of an experiment, such as "push[0]", or a key below it, is among some rows; "push"
/// stands for all of its kind.
[[nodiscard]] inline bool is_among(std::string_view path, std::span<const std::string> rows) {
  for (const std::string& row : rows) {
    if (!path.starts_with(row)) continue;
    if (path.size() == row.size() || path[row.size()] == '.' || path[row.size()] == '[')
      return true;
  }
  return false;
}

/// When a row of the file is due that has a time.
struct DueRow {
  std::string name, key;       ///< "softer knee", "event[0]"
  double at_s = 0.0;           ///< of the run, or
  bool after_enabled = false;  ///< after its drives were enabled
  int line = 0;
};

}  // namespace tandem::runtime
