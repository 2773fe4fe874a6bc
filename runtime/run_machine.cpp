// The table of a run's phases; docs/architecture.md draws it, run_machine_test.cpp lists it.
#include "runtime/run_machine.hpp"

namespace tandem::runtime {

RunPhase next_phase(RunPhase phase, RunEvent event, RunGuards guards) noexcept TANDEM_RT {
  using enum RunPhase;
  const RunPhase controlled = guards.settles ? kSettling : kRunning;
  switch (event) {
    case RunEvent::kEnabled:
      if (phase != kBringUp && phase != kResetting) return phase;
      return guards.holds_back ? kHeld : controlled;
    case RunEvent::kSettled: return phase == kSettling ? kRunning : phase;
    case RunEvent::kFinished:
      if (phase == kRunning) return kShutDown;
      return (phase == kFaulted || phase == kHeld) && !guards.waits ? kShutDown : phase;
    case RunEvent::kStop:
      if (ends(phase)) return phase;
      return phase != kBringUp && guards.waits ? kFaulted : kShutDown;
    case RunEvent::kRetreat: return phase == kRunning ? kRetreating : phase;
    case RunEvent::kReset:
      return phase == kFaulted || phase == kRunning || phase == kSettling ? kResetting : phase;
    case RunEvent::kResetFailed: return phase == kResetting ? kFaulted : phase;
    case RunEvent::kStart: return phase == kHeld ? kRunning : phase;
    case RunEvent::kEnd: return phase == kDone ? kDone : kShutDown;
    case RunEvent::kDisabled: return phase == kShutDown ? kDone : phase;
  }
  return phase;
}

bool RunMachine::time_is_over(std::uint64_t cycle) const noexcept TANDEM_RT {
  const std::uint64_t in_phase = cycle - began_;
  const bool runs_out = config_.running_cycles != 0;
  switch (phase_) {
    case RunPhase::kBringUp:
    case RunPhase::kResetting: return in_phase >= config_.bring_up_cycles;
    case RunPhase::kSettling: return in_phase >= config_.settle_cycles;
    case RunPhase::kRunning: return runs_out && spent_ + in_phase >= config_.running_cycles;
    case RunPhase::kFaulted:
    case RunPhase::kHeld:
      return config_.after_stop == AfterStop::kEnd && runs_out &&
             spent_ + in_phase >= config_.running_cycles;
    case RunPhase::kRetreating: return in_phase >= config_.retreat_cycles;
    case RunPhase::kShutDown: return in_phase >= config_.shut_down_cycles;
    case RunPhase::kDone: break;
  }
  return false;
}

bool RunMachine::on(RunEvent event, std::uint64_t cycle, bool holds_back) noexcept TANDEM_RT {
  const bool held = latched_ == hal::StopCategory::kHold;  // such a robot does not shut down
  const RunPhase next = next_phase(
      phase_, event,
      {.settles = config_.settle_cycles > 0,
       .waits = config_.after_stop == AfterStop::kWait || (event == RunEvent::kStop && held),
       .holds_back = holds_back});
  if (next == phase_) return false;
  if (phase_ == RunPhase::kRunning) spent_ += cycle - began_;
  phase_ = next;
  began_ = cycle;
  return true;
}

bool RunMachine::latch(hal::StopCategory category) noexcept TANDEM_RT {
  if (category == hal::StopCategory::kWarn) return false;
  if (in(RunPhase::kRetreating) && category >= hal::StopCategory::kCategory2) return false;
  latched_ = std::min(latched_, category);
  return true;
}

}  // namespace tandem::runtime
