// The watchdog of a run: what it does to the robot and to the process when the loop hangs.
// Layer: apps/run.  Thread: main; the watchdog's own.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "apps/run/connection.hpp"
#include "apps/run/service_notice.hpp"
#include "base/result.hpp"
#include "runtime/cycle_watchdog.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// "in the controller 'nod'". For a loop that hangs or stands still.
/// @param at_work  as CycleWatchdog says
[[nodiscard]] std::string where_the_loop_is(const runtime::ControllerHost& controllers,
                                            bool at_work);

/// Watches the loop from its first cycle on. When that does not come back from a cycle within
/// [faults] watchdog_s, and in real time when it does not begin one either, then
/// 1. the emergency stop and the end of the run are latched: a loop that comes back carries them
///    out first, and the run ends in order;
/// 2. every node of a CAN robot gets NMT stop, by sockets that the loop does not use;
/// 3. standard error says in which controller the loop is.
/// A loop that is not back after kGrace is given up: gave_up(). Whoever owns the run then has
/// kLastWords for the log, and ends the process; after that the guard does so, with status 1. Once
/// the log is closed there is kPlaceTime more for what is still to be said.
class CycleGuard {
 public:
  /// How long a cycle of simulated time may take where [faults] watchdog_s does not say it.
  static constexpr double kSimulated_s = 5.0;
  static constexpr std::chrono::seconds kGrace{2};
  static constexpr std::chrono::seconds kLastWords{3};

  /// All outlive it. Errors: SocketCanBus::open()'s.
  /// @param notice  told whether the loop cycles, by the watchdog's thread
  [[nodiscard]] static Result<std::unique_ptr<CycleGuard>> open(const WiredComposition& composition,
                                                                runtime::RobotCycle& cycle,
                                                                ServiceNotice& notice);

  [[nodiscard]] bool gave_up() const noexcept { return gave_up_.load(std::memory_order_acquire); }
  /// The log is closed: nothing is lost any more by a process that ends. When it gave up.
  void log_is_closed() noexcept { log_closed_.store(true, std::memory_order_release); }
  /// What the loop did: "the loop crashed in the controller 'squat'". For when it gave up.
  [[nodiscard]] const std::string& fault() const noexcept { return fault_; }

 private:
  CycleGuard(const WiredComposition& composition, runtime::RobotCycle& cycle, ServiceNotice& notice)
      : composition_(&composition), cycle_(&cycle), notice_(&notice) {}
  void start();
  void on_hang(bool at_work);
  void on_given_up();
  [[nodiscard]] std::string stop_nodes();

  const WiredComposition* composition_;
  runtime::RobotCycle* cycle_;
  ServiceNotice* notice_;
  std::vector<std::unique_ptr<hal::can::SocketCanBus>> buses_;
  double limit_s_ = 0.0;
  std::string fault_;
  std::atomic<bool> gave_up_{false}, log_closed_{false};
  std::unique_ptr<runtime::CycleWatchdog> watchdog_;  // last: its thread uses the others
};

}  // namespace tandem::apps
