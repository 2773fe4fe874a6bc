// The loop on its own thread, and how long its controllers took.
// Layer: apps/run.  Thread: made, watched and joined by main.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdio>
#include <semaphore>
#include <thread>

#include "apps/run/connection.hpp"
#include "apps/run/cycle_guard.hpp"
#include "rt/thread_setup.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// Where the time of a run went, by the wall clock.
struct RunTimes {
  double running_s = 0.0;  ///< controllers ran
  double stopped_s = 0.0;  ///< in fault, on the way to a safe posture, in a reset, or held after it
  double stood_s = 0.0;    ///< simulated time was paused, or the process suspended
};

class CycleThread {
 public:
  CycleThread(runtime::RobotCycle& cycle, const rt::ThreadConfig& config)
      : thread_([this, &cycle, config] { run(cycle, config); }) {}
  [[nodiscard]] bool done() const { return done_.load(std::memory_order_acquire); }
  /// Waits until it is done, or for so long.
  void await(std::chrono::milliseconds longest) { (void)ended_.try_acquire_for(longest); }
  void join() { thread_.join(); }
  // For when it has joined.
  [[nodiscard]] const RunTimes& times() const { return times_; }
  [[nodiscard]] const rt::ThreadReport& report() const { return report_; }

 private:
  void run(runtime::RobotCycle& cycle, const rt::ThreadConfig& config);

  RunTimes times_;
  rt::ThreadReport report_;
  std::atomic<bool> done_{false};
  std::binary_semaphore ended_{0};
  std::thread thread_;  // last: it uses the others
};

/// Shows progress and the buses' states until the loop is done, or given up; with `quiet` it only
/// waits. Either way it warns when the log is lost, and `notice` has the run's phase.
/// @param recorder  null: nothing is logged
/// @param waits  the run waits after a fault: each is printed when it happens, not at the end alone
void watch(runtime::RobotCycle& cycle, CycleThread& loop, const WiredComposition& c,
           const CycleGuard& guard, const log::Recorder* recorder, ServiceNotice& notice,
           std::FILE* out, bool waits, bool quiet);

}  // namespace tandem::apps
