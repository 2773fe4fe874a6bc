#include "runtime/joint_homing.hpp"

#include <algorithm>

namespace tandem::runtime {

using hal::HomingState;
using log::EventKind;

JointHoming::JointHoming(CycleNow& now, const DriveResets& resets)
    : now_(now), resets_(resets), known_(now.robot.joints.size()) {
  for (std::size_t j = 0; j < known_.size(); ++j) {
    if (!now.robot.joints[j].homing) continue;
    joints_.push_back(j);
    known_[j] = now.backend.homing(j);
  }
}

bool JointHoming::is_needed(std::size_t joint) const noexcept TANDEM_RT {
  const auto& homing = now_.robot.joints[joint].homing;
  return homing && homing->required && known_[joint].state == HomingState::kNotHomed;
}

bool JointHoming::is_needed_by(ControllerSet controllers) const noexcept TANDEM_RT {
  return std::ranges::any_of(joints_, [&](std::size_t joint) {
    return is_needed(joint) && now_.controllers.claimant(joint, controllers) >= 0;
  });
}

CycleAnswer JointHoming::begin(std::size_t joint) noexcept TANDEM_RT {
  CycleAnswer answer{.joint = static_cast<std::int32_t>(joint)};
  const bool controlled = now_.run.in(RunPhase::kRunning);
  if (!controlled && !now_.run.in(RunPhase::kHeld)) {
    answer.reason = RejectReason::kNotEnabled;
  } else if (controlled && now_.controllers.owner(joint) >= 0) {
    answer.reason = RejectReason::kClaimed;
    answer.one = now_.controllers.owner(joint);
  } else if (resets_.is_on(joint)) {
    answer.reason = RejectReason::kResetting;
  } else if (now_.watch.is_ill(now_.state, joint)) {
    answer.reason = RejectReason::kDriveFault;
  } else if (is_on(joint)) {
    answer.reason = RejectReason::kHoming;
  } else if (known_[joint].state == HomingState::kNone) {
    answer.reason = RejectReason::kHomedThere;
  } else if (!now_.backend.home(joint)) {
    answer.reason = RejectReason::kDisabled;
  } else {
    known_[joint] = now_.backend.homing(joint);
  }
  return answer;
}

std::optional<std::size_t> JointHoming::next_ended() noexcept TANDEM_RT {
  for (const std::size_t j : joints_) {
    const bool was_on = is_on(j);
    const hal::Homing is = known_[j] = now_.backend.homing(j);
    if (!was_on || is_on(j)) continue;
    const bool homed = is.state == HomingState::kHomed;
    now_.event(homed ? EventKind::kHomed : EventKind::kHomingFailed, static_cast<std::int32_t>(j),
               homed ? 0 : hal::row_of(is.error).number);
    return j;
  }
  return std::nullopt;
}

}  // namespace tandem::runtime
