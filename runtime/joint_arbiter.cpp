#include "runtime/joint_arbiter.hpp"

#include <algorithm>
#include <utility>

namespace tandem::runtime {

JointArbiter::JointArbiter(CycleNow& now, const DriveResets& resets, const JointHoming& homing)
    : now_(now),
      resets_(resets),
      homing_(homing),
      leads_(now.robot.joints.size()),
      command_(now.robot.shape()),
      wanted_(now.robot.shape()),
      delay_(now.robot.shape(), now.config.delay_cycles),
      unfollowed_(now.robot.shape()) {}

// Who leads.

void JointArbiter::decide() noexcept TANDEM_RT {
  const std::int32_t remote =
      now_.owner.port == nullptr ? -1 : static_cast<std::int32_t>(now_.owner.slot);
  for (std::size_t j = 0; j < leads_.size(); ++j) {
    const std::int32_t slot = now_.controllers.owner(j);
    leads_[j] = lead_of({.phase = now_.run.phase(),
                         .released = now_.run.latched() == hal::StopCategory::kCategory0,
                         .claimed = slot >= 0,
                         .owned = slot == remote,
                         .moving = now_.controllers.leads(j),
                         .resetting = resets_.is_on(j),
                         .homing = homing_.is_on(j),
                         .unhomed = homing_.is_needed(j)});
  }
}

LoopAnswer JointArbiter::may_lead(std::size_t joint, bool drives) const noexcept TANDEM_RT {
  LoopAnswer answer{.joint = static_cast<std::int32_t>(joint)};
  if (resets_.is_on(joint)) {
    answer.reason = RejectReason::kResetting;
  } else if (drives && now_.watch.is_ill(now_.state, joint)) {
    answer.reason = RejectReason::kDriveFault;
  } else if (drives && homing_.is_on(joint)) {
    answer.reason = RejectReason::kHoming;
  } else if (drives && homing_.is_needed(joint)) {
    answer.reason = RejectReason::kNotHomed;
  }
  return answer;
}

LoopAnswer JointArbiter::may_start(ControllerSet start) const noexcept TANDEM_RT {
  const auto refused = [](RejectReason why, std::size_t joint) {
    return LoopAnswer{.reason = why, .joint = static_cast<std::int32_t>(joint)};
  };
  const auto claimed = [&](std::size_t j) { return now_.controllers.is_claimed(j, start); };
  for (std::size_t j = 0; j < leads_.size(); ++j) {
    if (resets_.is_on(j) && claimed(j)) return refused(RejectReason::kResetting, j);
  }
  for (const std::size_t j : homing_.joints()) {
    if (homing_.is_on(j) && claimed(j)) return refused(RejectReason::kHoming, j);
    if (homing_.is_needed(j) && claimed(j)) return refused(RejectReason::kNotHomed, j);
  }
  return now_.controllers.may_start(start);
}

// Changes.

void JointArbiter::on(RunEvent event, bool holds_back) noexcept TANDEM_RT {
  const bool changes = now_.run.on(event, now_.time.cycle, holds_back);
  if (!changes || now_.run.in(RunPhase::kRetreating)) return;
  if (controls_) now_.controllers.stop();
  if (is_delayed()) now_.controllers.was_sent_before(delay_.before());
  controls_ = false;
  brakes_ = now_.run.in(RunPhase::kFaulted) || now_.run.in(RunPhase::kShutDown);
}

LoopAnswer JointArbiter::switch_over(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT {
  return now_.controllers.switch_over(stop, start, controls_, now_.time, now_.state, led());
}

LoopAnswer JointArbiter::leave_hold(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT {
  fill_delay();
  hal::CommandImage& command = delay_.on() ? wanted_ : command_;
  const LoopAnswer answer =
      now_.controllers.switch_over(stop, start, true, now_.time, now_.state, command);
  if (answer.reason != RejectReason::kNone) return answer;
  on(RunEvent::kStart);
  controls_ = true;  // they are started
  return answer;
}

bool JointArbiter::retreat() noexcept TANDEM_RT {
  return controls_ && now_.controllers.retreat(now_.time, now_.state, led());
}

void JointArbiter::follow_robot() noexcept TANDEM_RT {
  if (go_on_from_robot()) now_.limits.follow(command_);
}

/// False: it follows no other loop.
bool JointArbiter::go_on_from_robot() noexcept TANDEM_RT {
  const bool is_others = now_.backend.command_in_force(command_);
  stamp(command_);
  return is_others;
}

void JointArbiter::take_from_owner() noexcept TANDEM_RT {
  const RemoteCommandParts& owner = now_.owner;
  const bool owned = (now_.controllers.shown().active & only(owner.slot)) != 0;
  if (owner.port != nullptr && owner.port->lockstep() && owned) {
    now_.controllers.take_as_written(led());
  }
}

LoopAnswer JointArbiter::set_joint(std::size_t joint, const JointRequest& wish) noexcept TANDEM_RT {
  return now_.controllers.set_joint(joint, wish, controls_, now_.state, led());
}

LoopAnswer JointArbiter::move(std::size_t joint, const MoveRequest& wish) noexcept TANDEM_RT {
  return now_.controllers.move(joint, wish, now_.state, led());
}

LoopAnswer JointArbiter::recover(std::size_t joint) noexcept TANDEM_RT {
  return now_.controllers.recover(joint, led());
}

void JointArbiter::end_homing(std::size_t joint) noexcept TANDEM_RT {
  now_.controllers.hold(joint, now_.state, led());
  // The end of the range may be a little outside of the limits: the homing ends inside.
  if (homing_.of(joint).state == hal::HomingState::kHomed) (void)recover(joint);
}

// The cycle.

void JointArbiter::stamp(hal::CommandImage& command) const noexcept TANDEM_RT {
  command.cycle()[0] = now_.time.cycle;
  command.time_ns()[0] = now_.time.time_ns;
}

void JointArbiter::fill_delay() noexcept TANDEM_RT {
  if (!delay_.on()) return;
  delay_.fill(command_);
  wanted_.assign(command_);
}

Code JointArbiter::write(bool repeats) noexcept TANDEM_RT {
  ControllerHost& host = now_.controllers;
  Code code = Code::kOk;
  unfollowed_.begin();
  stamp(command_);
  stamp(wanted_);
  decide();
  if (std::exchange(brakes_, false)) host.brake(now_.state, command_);
  switch (now_.run.phase()) {
    case RunPhase::kBringUp:
    case RunPhase::kResetting:
      host.release(command_);
      host.hold(now_.state, command_);
      (void)go_on_from_robot();
      break;
    case RunPhase::kSettling:
    case RunPhase::kHeld: host.hold(now_.state, command_); break;
    case RunPhase::kRunning:
      if (repeats && !host.changes_hands()) return code;
      [[fallthrough]];
    case RunPhase::kRetreating: code = run_controllers(); break;
    case RunPhase::kFaulted:
    case RunPhase::kShutDown:
      if (now_.run.latched() == hal::StopCategory::kCategory0) {
        host.release(command_);
      } else {
        host.hold(now_.state, command_);
      }
      break;
    case RunPhase::kDone: break;
  }
  overrule(led());
  if (is_delayed()) delay_.pass(wanted_, command_);
  return code;
}

void JointArbiter::start_controllers() noexcept TANDEM_RT {
  follow_robot();
  if (delay_.on()) now_.controllers.hold(now_.state, command_);
  fill_delay();
  controls_ = true;
  now_.controllers.start(now_.time, now_.state, led());
  take_from_owner();
  now_.watch.controllers_start();
}

Code JointArbiter::run_controllers() noexcept TANDEM_RT {
  if (!controls_) start_controllers();
  if (now_.run.in(RunPhase::kRunning)) ++ran_;
  unfollowed_.offer(now_.state, led());
  const Code code = now_.controllers.update(now_.time, now_.state, led());
  unfollowed_.take(now_.state, led());
  if (now_.run.in(RunPhase::kRunning)) now_.controllers.lead_back(led());  // a retreat waits
  return code;
}

/// Joints that nobody may lead, whoever has written: they stay where they are.
void JointArbiter::overrule(hal::CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < leads_.size(); ++j) {
    if (leads_[j] < JointLead::kReset) continue;
    now_.controllers.hold(j, now_.state, command);
    if (leads_[j] != JointLead::kHoming) continue;
    command.mode()[j] = static_cast<std::int8_t>(hal::ControlMode::kIdle);
  }
}

hal::CommandImage& JointArbiter::to_limit() noexcept TANDEM_RT {
  unfollowed_.keep(command_);
  return command_;
}

void JointArbiter::tell_resets(bool begun) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < leads_.size(); ++j) {
    if (resets_.is_on(j)) command_.fault_reset()[j] = begun && resets_.begins(j) ? 1 : 0;
  }
}

void JointArbiter::forget_resets() noexcept TANDEM_RT {
  std::ranges::fill(command_.fault_reset(), std::uint8_t{0});
  std::ranges::fill(wanted_.fault_reset(), std::uint8_t{0});
}

void JointArbiter::archive(Archive& ar) {
  ar(leads_, command_, wanted_, delay_, controls_, brakes_, ran_);
}

}  // namespace tandem::runtime
