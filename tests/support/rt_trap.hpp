// Catches what the cycle must not do: link tandem_rt_trap to a test executable, and each of its
// tests fails when an allocation, a lock or a blocking call happens inside rt::ScopedRealtime,
// in the test's own code, in a library or in a plugin.
// Layer: tests.  Thread: any.
#pragma once

#include <string>
#include <vector>

namespace tandem::test {

/// One forbidden call.
struct RtViolation {
  std::string call;       ///< "malloc"
  std::string backtrace;  ///< one frame per line, innermost first
};

/// False in sanitizer builds, whose run-time interposes the same functions itself.
[[nodiscard]] bool rt_trap_active() noexcept;

/// What was caught since the last take; the test no longer fails for it.
[[nodiscard]] std::vector<RtViolation> take_rt_violations();

}  // namespace tandem::test
