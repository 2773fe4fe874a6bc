// Work in a child of this process, which may crash or block: its end says nothing about ours.
// Layer: base.  Thread: any, also in a signal handler.
#pragma once

#include <chrono>

namespace tandem {

/// How long a child is waited for. One that gets little of the processor has all of `longest`; one
/// that sleeps for 2 s waits for a lock that nobody releases, and is ended.
struct ChildTime {
  std::chrono::seconds longest{20};
  const char* notice = nullptr;  ///< a line for standard error when it takes more than 2 s
};

/// work(with) in a child, which writes what it finds out. Safe in a signal handler, whatever `work`
/// is. The child has neither this thread's real-time policy nor its processor.
/// @return whether it came to its end
bool run_in_child(void (*work)(void* with), void* with, const ChildTime& time = {}) noexcept;

}  // namespace tandem
