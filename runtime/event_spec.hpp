// What happens in a run, and when: a row of [[event]], or of [[push]] and [[fault]] with a
// condition.
// Layer: runtime.  Thread: plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/sim/fault_injection.hpp"

namespace tandem::runtime {

struct EventSpec {
  std::string name;
  std::int64_t at_ns = -1;    ///< of the run; below 0: `when` says it
  std::string when;           ///< a condition, looked at since the controllers started
  std::int64_t after_ns = 0;  ///< after the first cycle in which it held
  bool optional = false;      ///< it need not come
  std::optional<sim::ScenarioFault> fault;    ///< this is injected, or
  std::string ask;                            ///< this is asked for: a request as JSON
  int line = 0, when_line = 0, ask_line = 0;  ///< in the file
};

}  // namespace tandem::runtime
