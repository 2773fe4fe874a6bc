// What a condition calls the causes of faults.
// Layer: runtime/condition.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tandem::runtime {

struct NamedCauses {
  std::string name;      ///< "board_silent"
  std::uint64_t causes;  ///< of hal/fault_causes.inc, a bit each
};

/// Every cause by its name; those of an event by its name, "fell", too; all of them as "any".
[[nodiscard]] std::vector<NamedCauses> named_causes();

}  // namespace tandem::runtime
