// What a fuzz target holds its input against.
// Layer: tests.  Thread: any.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <source_location>

namespace tandem::fuzz {

/// Ends the program, with the line that asks, when it does not hold.
inline void require(bool holds, const std::source_location& at = std::source_location::current()) {
  if (holds) return;
  std::fprintf(stderr, "%s:%u: what is required here does not hold\n", at.file_name(), at.line());
  std::abort();
}

}  // namespace tandem::fuzz
