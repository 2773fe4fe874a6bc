// Makes the calling thread fit for real time, and says what it could not get.
// Layer: rt.  Thread: the RT thread itself, before its first cycle.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace tandem::rt {

enum class SchedulingPolicy : std::uint8_t {
  kOther,       ///< the kernel's ordinary fair scheduling
  kFifo,        ///< SCHED_FIFO: runs until it blocks
  kRoundRobin,  ///< SCHED_RR: as kFifo, in turns with others of its priority
};

struct ThreadConfig {
  SchedulingPolicy policy = SchedulingPolicy::kFifo;
  int priority = 80;                              ///< 1 to 99, for kFifo and kRoundRobin
  int cpu = -1;                                   ///< the only CPU to run on; -1: any
  bool lock_memory = true;                        ///< mlockall(current and future)
  std::size_t prefault_stack_bytes = 512 * 1024;  ///< touched now, not in the first cycles
  std::size_t prefault_heap_bytes = 0;            ///< allocated, touched, kept by the allocator
};

/// Something that was asked for and not granted.
struct Missing {
  std::string what;  ///< "SCHED_FIFO priority 80"
  std::string why;   ///< the system's reason
  std::string how;   ///< what an administrator does about it
};

struct ThreadReport {
  std::vector<std::string> granted;  ///< "SCHED_FIFO priority 80", …
  std::vector<Missing> missing;

  [[nodiscard]] bool complete() const { return missing.empty(); }
  /// One line each: "could not get SCHED_FIFO priority 80: Operation not permitted (…)".
  [[nodiscard]] std::string to_string() const;
};

/// Applies what `config` asks for, as far as the system lets it. Never fails as a whole: a
/// simulation runs well without any of it.
[[nodiscard]] ThreadReport set_up_thread(const ThreadConfig& config);

}  // namespace tandem::rt
