// Controllers that wait to be started: after a reset, or until their joints are homed.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <optional>

#include "runtime/joint_arbiter.hpp"

namespace tandem::runtime {

/// A reset is no start: who was active waits for a second, deliberate act. Not an owner in another
/// process, which comes and goes by itself, and holds its own controllers back.
class WaitingControllers {
 public:
  /// All outlive it.
  WaitingControllers(CycleNow& now, JointArbiter& arbiter, JointHoming& homing)
      : now_(now), arbiter_(arbiter), homing_(homing) {}

  [[nodiscard]] bool any() const noexcept TANDEM_RT { return waiting_ != 0; }
  /// A reset has enabled the joints.
  void hold_back() noexcept TANDEM_RT;
  /// The drives are enabled at first: controllers that claim a joint which has to be homed wait.
  void wait_for_homing() noexcept TANDEM_RT;
  /// `active` are active, and a retreat stops some of them.
  void note_retreat(ControllerSet active) noexcept TANDEM_RT { before_retreat_ = active; }
  /// The controller is gone.
  void forget(std::size_t slot) noexcept TANDEM_RT {
    waiting_ &= ~only(slot);
    before_retreat_ &= ~only(slot);
  }

  /// Each cycle: homes one joint after the other that nobody has to ask for; when all that the
  /// controllers wait for are homed, they start.
  /// @return the fault of one that fails, where nobody waits for an operator
  [[nodiscard]] std::optional<FaultRecord> home_at_start() noexcept TANDEM_RT;
  /// The time of the run is over. @return the fault of controllers that never ran: their joint's
  [[nodiscard]] std::optional<FaultRecord> unhomed() const noexcept TANDEM_RT;

  /// Starts those that wait.
  [[nodiscard]] CycleAnswer go_on() noexcept TANDEM_RT;
  /// From held joints to these controllers: nobody waits any more.
  [[nodiscard]] CycleAnswer leave_hold(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT;

  void archive(Archive& ar) { ar(waiting_, before_retreat_, homes_at_start_); }

 private:
  /// Why its homing failed, or that there was none.
  [[nodiscard]] FaultRecord not_homed(std::size_t joint) const noexcept TANDEM_RT;

  CycleNow& now_;
  JointArbiter& arbiter_;
  JointHoming& homing_;
  ControllerSet waiting_ = 0;
  ControllerSet before_retreat_ = 0;  // active then
  bool homes_at_start_ = false;       // joints whose homing nobody has to ask for
};

}  // namespace tandem::runtime
