// Marks the part of a cycle that must not allocate, lock or block, for the traps of the tests.
// Layer: rt.  Thread: any.
#pragma once

#include "base/realtime.hpp"

namespace tandem::rt {

/// While one lives, its thread is "in the cycle": the trap of tests/support records every
/// allocation, lock or blocking call of the thread. Costs two additions otherwise.
class ScopedRealtime {
 public:
  ScopedRealtime() noexcept TANDEM_RT;
  ~ScopedRealtime() noexcept TANDEM_RT;
  ScopedRealtime(const ScopedRealtime&) = delete;
  ScopedRealtime& operator=(const ScopedRealtime&) = delete;
};

/// Whether the calling thread is inside a ScopedRealtime.
[[nodiscard]] bool in_realtime() noexcept TANDEM_RT;

}  // namespace tandem::rt
