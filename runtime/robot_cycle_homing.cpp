// Joints whose drives have to find their place first: homed on request, held until then.
#include <algorithm>

#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

using hal::HomingState;
using log::EventKind;

/// Whether nothing but its homing may move the joint.
bool RobotCycle::has_to_be_homed(std::size_t joint) const noexcept TANDEM_RT {
  const auto& homing = robot_->joints[joint].homing;
  const bool unknown = homings_[joint].state == HomingState::kNotHomed;
  return homing && homing->required && unknown;
}

bool RobotCycle::claims_unhomed(ControllerSet controllers) const noexcept TANDEM_RT {
  return std::ranges::any_of(homes_, [&](std::size_t joint) {
    return has_to_be_homed(joint) && controllers_->is_claimed(joint, controllers);
  });
}

LoopAnswer RobotCycle::home_joint(std::size_t joint) noexcept TANDEM_RT {
  LoopAnswer answer{.joint = static_cast<std::int32_t>(joint)};
  const bool controlled = run_.in(RunPhase::kRunning);
  if (!controlled && !run_.in(RunPhase::kHeld)) {
    answer.reason = RejectReason::kNotEnabled;
  } else if (controlled && controllers_->owner(joint) >= 0) {
    answer.reason = RejectReason::kClaimed;
    answer.one = controllers_->owner(joint);
  } else if (resets_[joint] != 0) {
    answer.reason = RejectReason::kResetting;
  } else if (watch_.is_ill(state_, joint)) {
    answer.reason = RejectReason::kDriveFault;
  } else if (homings_[joint].state == HomingState::kHoming) {
    answer.reason = RejectReason::kHoming;
  } else if (homings_[joint].state == HomingState::kNone) {
    answer.reason = RejectReason::kHomedThere;
  } else if (!backend_->home(joint)) {
    answer.reason = RejectReason::kDisabled;
  } else {
    homings_[joint] = backend_->homing(joint);
  }
  return answer;
}

/// What came of it, in the log.
void RobotCycle::watch_homing() noexcept TANDEM_RT {
  for (const std::size_t j : homes_) {
    const hal::Homing now = backend_->homing(j);
    const bool ended =
        homings_[j].state == HomingState::kHoming && now.state != HomingState::kHoming;
    homings_[j] = now;
    if (!ended) continue;
    const auto joint = static_cast<std::int32_t>(j);
    if (now.state == HomingState::kHomed) {
      event(EventKind::kHomed, joint);
    } else {
      event(EventKind::kHomingFailed, joint, static_cast<std::uint32_t>(now.error));
    }
    controllers_->hold(j, state_, controlled());
    // The end of the range may be a little outside of the limits: the homing ends inside.
    if (now.state == HomingState::kHomed) (void)controllers_->recover(j, controlled());
  }
  home_at_start();
}

/// The drives are enabled: controllers that claim a joint which has to be homed wait for that.
void RobotCycle::wait_for_homing() noexcept TANDEM_RT {
  if (!claims_unhomed(controllers_->shown().active)) return;
  hold_back();
  homes_at_start_ = std::ranges::any_of(
      homes_, [&](std::size_t joint) { return robot_->joints[joint].homing->at_start; });
}

/// One joint after the other; when all that the controllers wait for are homed, they start. One
/// that fails is the operator's; where nobody waits, it ends the run.
void RobotCycle::home_at_start() noexcept TANDEM_RT {
  if (!homes_at_start_ || !run_.in(RunPhase::kHeld)) return;
  for (const std::size_t joint : homes_) {
    const hal::Homing& is = homings_[joint];
    if (is.state == HomingState::kHoming || controllers_->recovers(joint)) return;
    if (!robot_->joints[joint].homing->at_start || is.state == HomingState::kHomed) continue;
    homes_at_start_ =
        is.error == hal::HomingError::kNone && home_joint(joint).reason == RejectReason::kNone;
    if (homes_at_start_) event(EventKind::kHomingRequested, static_cast<std::int32_t>(joint));
    const bool failed = is.error != hal::HomingError::kNone;
    if (failed && config_.after_stop == AfterStop::kEnd) not_homed(joint);
    return;
  }
  homes_at_start_ = false;
  if (!claims_unhomed(held_back_)) (void)go_on();
}

/// The time of a run is over whose controllers never ran.
bool RobotCycle::ends_unhomed() noexcept TANDEM_RT {
  if (!run_.in(RunPhase::kHeld)) return false;
  const auto joint = std::ranges::find_if(homes_, [&](std::size_t j) {
    const bool done = homings_[j].state == HomingState::kHomed;
    return robot_->joints[j].homing->required && !done && controllers_->is_claimed(j, held_back_);
  });
  if (joint == homes_.end()) return false;
  not_homed(*joint);
  return true;
}

void RobotCycle::not_homed(std::size_t joint) noexcept TANDEM_RT {
  fault({.index = static_cast<std::int32_t>(joint),
         .code = static_cast<std::uint32_t>(homings_[joint].error),
         .source = FaultSource::kNotHomed,
         .category = hal::StopCategory::kCategory1});
}

/// A joint that is homed has no reference; one that has to be homed stays where it is, whoever has
/// it.
void RobotCycle::hold_unhomed(hal::CommandImage& command) noexcept TANDEM_RT {
  for (const std::size_t j : homes_) {
    const bool homing = homings_[j].state == HomingState::kHoming;
    const bool owned = run_.in(RunPhase::kRunning) && controllers_->owner(j) >= 0;
    if (!homing && !(owned && has_to_be_homed(j))) continue;
    controllers_->hold(j, state_, command);
    if (homing) command.mode()[j] = static_cast<std::int8_t>(hal::ControlMode::kIdle);
  }
}

}  // namespace tandem::runtime
