// From a fault to its reset: noted, answered by a stop or a retreat, cleared.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include "runtime/waiting_controllers.hpp"

namespace tandem::runtime {

class FaultResponse {
 public:
  /// All outlive it.
  FaultResponse(CycleNow& now, DriveResets& resets, JointArbiter& arbiter,
                WaitingControllers& waiting)
      : now_(now), resets_(resets), arbiter_(arbiter), waiting_(waiting) {}

  /// Notes a fault of this cycle, and carries out what its category says.
  void raise(FaultRecord record) noexcept TANDEM_RT;
  /// What read() or write() of the backend answered. A missed sample shows as age, a lost command
  /// as the board's own time-out, and a drive's fault as its joint's: the joint's stop category
  /// decides then. All else stops the robot.
  void check_backend(Code code) noexcept TANDEM_RT;
  /// A link that is back needs no reset: the robot has returned to the commands by itself.
  void check_link() noexcept TANDEM_RT;
  /// What the controllers answered: the end of the run or of a retreat, or a fault.
  void check_controllers(Code code) noexcept TANDEM_RT;
  /// A stop was latched in this cycle.
  [[nodiscard]] bool stops_now() const noexcept TANDEM_RT {
    return stopped_before_ > now_.time.cycle;
  }

  /// Nothing latched: nothing to do, and no bump. Stopped since it was asked for: it is not done.
  /// @param known  Progress::stopped_before then
  void begin_reset(std::uint64_t known) noexcept TANDEM_RT;
  /// Each cycle of a reset. @return whether every joint is enabled again
  [[nodiscard]] bool watch_reset() noexcept TANDEM_RT;

  void archive(Archive& ar) {
    std::uint64_t resets = now_.progress.resets.load(std::memory_order_relaxed);
    std::uint64_t failed = now_.progress.failed_resets.load(std::memory_order_relaxed);
    ar(stopped_before_, resets, failed);
    now_.progress.stopped_before.store(stopped_before_, std::memory_order_relaxed);
    now_.progress.resets.store(resets, std::memory_order_relaxed);
    now_.progress.failed_resets.store(failed, std::memory_order_relaxed);
  }

 private:
  void react(hal::StopCategory category) noexcept TANDEM_RT;
  [[nodiscard]] bool retreat() noexcept TANDEM_RT;
  void note_stop() noexcept TANDEM_RT;
  void reset_done() noexcept TANDEM_RT;
  void reset_failed() noexcept TANDEM_RT;

  CycleNow& now_;
  DriveResets& resets_;
  JointArbiter& arbiter_;
  WaitingControllers& waiting_;
  std::uint64_t stopped_before_ = 0;  // Progress::stopped_before
};

}  // namespace tandem::runtime
