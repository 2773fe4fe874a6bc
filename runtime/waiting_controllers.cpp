#include "runtime/waiting_controllers.hpp"

#include <algorithm>
#include <utility>

namespace tandem::runtime {

using hal::HomingState;

void WaitingControllers::hold_back() noexcept TANDEM_RT {
  const ControllerSet now = now_.controllers.shown().active;
  const ControllerSet active = now | std::exchange(before_retreat_, ControllerSet{0});
  if (now_.config.after_reset == AfterReset::kContinue &&
      !homing_.is_needed_by(active)) {  // those, too, that a retreat has stopped
    if (active != now) (void)arbiter_.switch_over(0, active & ~now);
    return;
  }
  if (active == 0) return;
  arbiter_.follow_robot();
  (void)arbiter_.switch_over(now, 0);
  waiting_ |= now_.owner.port != nullptr ? active & ~only(now_.owner.slot) : active;
}

void WaitingControllers::wait_for_homing() noexcept TANDEM_RT {
  if (!homing_.is_needed_by(now_.controllers.shown().active)) return;
  hold_back();
  homes_at_start_ = std::ranges::any_of(homing_.joints(), [&](std::size_t joint) {
    return now_.robot.joints[joint].homing->at_start;
  });
}

std::optional<FaultRecord> WaitingControllers::home_at_start() noexcept TANDEM_RT {
  if (!homes_at_start_ || !now_.run.in(RunPhase::kHeld)) return std::nullopt;
  for (const std::size_t joint : homing_.joints()) {
    const hal::Homing is = homing_.of(joint);
    if (homing_.is_on(joint) || now_.controllers.references().recovers(joint)) return std::nullopt;
    if (!now_.robot.joints[joint].homing->at_start || is.state == HomingState::kHomed) continue;
    const bool failed = is.error != hal::FaultCause::kNone;
    homes_at_start_ = !failed && homing_.begin(joint).reason == RejectReason::kNone;
    if (homes_at_start_) {
      now_.event(log::EventKind::kHomingRequested, static_cast<std::int32_t>(joint));
    }
    if (failed && now_.config.after_stop == AfterStop::kEnd) return not_homed(joint);
    return std::nullopt;
  }
  homes_at_start_ = false;
  if (!homing_.is_needed_by(waiting_)) (void)go_on();
  return std::nullopt;
}

std::optional<FaultRecord> WaitingControllers::unhomed() const noexcept TANDEM_RT {
  if (!now_.run.in(RunPhase::kHeld)) return std::nullopt;
  for (const std::size_t j : homing_.joints()) {
    const bool homed = homing_.of(j).state == HomingState::kHomed;
    const bool waits = now_.controllers.claimant(j, waiting_) >= 0;
    if (now_.robot.joints[j].homing->required && !homed && waits) return not_homed(j);
  }
  return std::nullopt;
}

FaultRecord WaitingControllers::not_homed(std::size_t joint) const noexcept TANDEM_RT {
  return {.index = static_cast<std::int32_t>(joint),
          .code = hal::row_of(homing_.of(joint).error).number,
          .cause = hal::FaultCause::kNotHomed};
}

CycleAnswer WaitingControllers::go_on() noexcept TANDEM_RT {
  const bool stopped = now_.run.in(RunPhase::kFaulted) || now_.run.in(RunPhase::kResetting);
  if (stopped) return {.reason = RejectReason::kNotEnabled};
  if (!now_.run.in(RunPhase::kHeld)) return {.reason = RejectReason::kNotHeld};
  if (!any()) return {.reason = RejectReason::kGone};
  const CycleAnswer no = arbiter_.may_start(waiting_);
  return no.reason == RejectReason::kNone ? leave_hold(0, waiting_) : no;
}

CycleAnswer WaitingControllers::leave_hold(ControllerSet stop,
                                           ControllerSet start) noexcept TANDEM_RT {
  const CycleAnswer answer = arbiter_.leave_hold(stop, start);
  if (answer.reason == RejectReason::kNone) waiting_ = 0;
  return answer;
}

}  // namespace tandem::runtime
