// Finds a loop that no longer cycles, from a thread of its own.
// Layer: runtime.  Thread: made and destroyed by main; the hooks run on its own thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "runtime/heartbeat.hpp"

namespace tandem::runtime {

struct WatchdogConfig {
  std::chrono::nanoseconds limit{};  ///< the longest that the work of a cycle may take
  /// That the loop may wait between two of them; zero: as long as it likes (simulated time is
  /// paused, waits for the disk, for emulated boards, for an owner).
  std::chrono::nanoseconds wait_limit{};
  std::chrono::nanoseconds grace{};  ///< from on_hang to on_given_up
  bool waits_for_debugger = false;   ///< a loop that a debugger holds does not hang
};

/// Counts the time that it has itself been awake for: a process that was stopped and goes on, or a
/// machine that slept, has not hung.
class CycleWatchdog {
 public:
  struct Hooks {
    /// The loop hangs: after its limit, or at once when it stands still (Heartbeat).
    /// @param at_work  in its cycle, not in a wait
    std::function<void(bool at_work)> on_hang;
    std::function<void()> on_return;    ///< it cycles again
    std::function<void()> on_given_up;  ///< it did not come back; the watchdog has ended
    std::function<void()> on_cycles{};  ///< at each look: it has cycled since the last one
    std::function<void()> on_wait{};    ///< the same: it waits, as long as it likes (wait_limit)
  };

  /// The heartbeat outlives it. Nothing happens before the first beat.
  CycleWatchdog(const Heartbeat& heartbeat, const WatchdogConfig& config, Hooks hooks);
  /// Waits for a hook that is running.
  ~CycleWatchdog();
  CycleWatchdog(const CycleWatchdog&) = delete;
  CycleWatchdog& operator=(const CycleWatchdog&) = delete;

 private:
  void run();
  [[nodiscard]] bool sleep();

  const Heartbeat* heartbeat_;
  const WatchdogConfig config_;
  const Hooks hooks_;
  const std::chrono::nanoseconds tick_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool ending_ = false;
  std::thread thread_;  // last: it uses the others
};

}  // namespace tandem::runtime
