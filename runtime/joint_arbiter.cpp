#include "runtime/joint_arbiter.hpp"

#include <algorithm>
#include <utility>

namespace tandem::runtime {

JointArbiter::JointArbiter(CycleNow& now, const DriveResets& resets, const JointHoming& homing)
    : now_(now),
      references_(now.controllers.references()),
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
                         .moving = references_.leads(j),
                         .resetting = resets_.is_on(j),
                         .homing = homing_.is_on(j),
                         .unhomed = homing_.is_needed(j)});
  }
}

CycleAnswer JointArbiter::may_lead(std::size_t joint, bool drives) const noexcept TANDEM_RT {
  CycleAnswer answer{.joint = static_cast<std::int32_t>(joint)};
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

CycleAnswer JointArbiter::may_start(ControllerSet start) const noexcept TANDEM_RT {
  const auto refused = [](RejectReason why, std::size_t joint, std::int32_t one = -1) {
    return CycleAnswer{.reason = why, .joint = static_cast<std::int32_t>(joint), .one = one};
  };
  const auto claimant = [&](std::size_t j) { return now_.controllers.claimant(j, start); };
  for (std::size_t j = 0; j < leads_.size(); ++j) {
    if (resets_.is_on(j) && claimant(j) >= 0) return refused(RejectReason::kResetting, j);
  }
  for (const std::size_t j : homing_.joints()) {
    if (homing_.is_on(j) && claimant(j) >= 0) return refused(RejectReason::kHoming, j);
    if (homing_.is_needed(j) && claimant(j) >= 0) return refused(RejectReason::kNotHomed, j);
  }
  for (std::size_t j = 0; j < leads_.size(); ++j) {  // a start would end that
    if (!references_.recovers(j) || claimant(j) < 0) continue;
    return refused(RejectReason::kRecovering, j, claimant(j));
  }
  return {};
}

// Changes.

void JointArbiter::on(RunEvent event, bool holds_back) noexcept TANDEM_RT {
  const bool changes = now_.run.on(event, now_.time.cycle, holds_back);
  if (!changes || now_.run.in(RunPhase::kRetreating)) return;
  if (controls_) now_.controllers.stop();
  // A delay has let others through than the controllers saw: a brake goes on from these.
  if (is_delayed()) references_.transfer().watch(delay_.before());
  controls_ = false;
  brakes_ = now_.run.in(RunPhase::kFaulted) || now_.run.in(RunPhase::kShutDown);
}

CycleAnswer JointArbiter::switch_over(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT {
  return now_.controllers.switch_over(stop, start, controls_, now_.time, led());
}

CycleAnswer JointArbiter::replace(std::size_t slot, HostedController& next) noexcept TANDEM_RT {
  ControllerHost& host = now_.controllers;
  HostedController* const former = host.at(slot);
  if (former == nullptr) return host.remove(slot);  // which says so
  if (controls_ && (host.shown().active & only(slot)) != 0) {
    (void)host.insert(slot, next);  // as if it were there: what it claims
    const CycleAnswer no = may_start(only(slot));
    (void)host.insert(slot, *former);
    if (no.reason != RejectReason::kNone) return no;
  }
  return host.replace(slot, next, controls_, now_.time, led());
}

CycleAnswer JointArbiter::leave_hold(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT {
  fill_delay();
  hal::CommandImage& command = delay_.on() ? wanted_ : command_;
  const CycleAnswer answer =
      now_.controllers.switch_over(stop, start, true, now_.time, {now_.state, command});
  if (answer.reason != RejectReason::kNone) return answer;
  on(RunEvent::kStart);
  controls_ = true;  // they are started
  return answer;
}

bool JointArbiter::retreat() noexcept TANDEM_RT {
  return controls_ && now_.controllers.retreat(now_.time, led());
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
    references_.transfer().cancel(led().command);
  }
}

/// kClaimed where a controller has the joint.
CycleAnswer JointArbiter::owner_of(std::size_t joint) const noexcept TANDEM_RT {
  const std::int32_t owner = now_.controllers.owner(joint);
  return {.reason = owner < 0 ? RejectReason::kNone : RejectReason::kClaimed,
          .joint = static_cast<std::int32_t>(joint),
          .one = owner};
}

CycleAnswer JointArbiter::set_joint(std::size_t joint,
                                    const JointRequest& wish) noexcept TANDEM_RT {
  CycleAnswer answer = owner_of(joint);
  if (!wish.switches()) {
    answer.reason = RejectReason::kNone;  // an impedance is a claimed joint's, too
  } else if (answer.reason == RejectReason::kNone && !controls_) {
    answer.reason = RejectReason::kNotRunning;
  }
  if (answer.reason != RejectReason::kNone) return answer;
  answer.reason = references_.set(joint, wish, controls_, led());
  return answer;
}

CycleAnswer JointArbiter::move(std::size_t joint, const MoveRequest& wish) noexcept TANDEM_RT {
  CycleAnswer answer = owner_of(joint);
  if (answer.reason == RejectReason::kNone) answer.reason = references_.move(joint, wish, led());
  return answer;
}

CycleAnswer JointArbiter::recover(std::size_t joint) noexcept TANDEM_RT {
  CycleAnswer answer = owner_of(joint);
  if (answer.reason == RejectReason::kNone) {
    answer.reason = references_.recover(joint, led().command);
  }
  return answer;
}

void JointArbiter::end_homing(std::size_t joint) noexcept TANDEM_RT {
  references_.hold(joint, led());
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
  Code code = Code::kOk;
  unfollowed_.begin();
  stamp(command_);
  stamp(wanted_);
  decide();
  if (std::exchange(brakes_, false)) references_.brake(sent());
  switch (now_.run.phase()) {
    case RunPhase::kBringUp:
    case RunPhase::kResetting:
      references_.release(command_);
      references_.hold(sent());
      (void)go_on_from_robot();
      break;
    case RunPhase::kSettling:
    case RunPhase::kHeld: references_.hold(sent()); break;
    case RunPhase::kRunning:
      if (repeats && !references_.transfer().has_begun()) return code;
      [[fallthrough]];
    case RunPhase::kRetreating: code = run_controllers(); break;
    case RunPhase::kFaulted:
    case RunPhase::kShutDown:
      if (now_.run.latched() == hal::StopCategory::kCategory0) {
        references_.release(command_);
      } else {
        references_.hold(sent());
      }
      break;
    case RunPhase::kDone: break;
  }
  overrule();
  if (is_delayed()) delay_.pass(wanted_, command_);
  return code;
}

void JointArbiter::start_controllers() noexcept TANDEM_RT {
  follow_robot();
  if (delay_.on()) references_.hold(sent());
  fill_delay();
  controls_ = true;
  now_.controllers.start(now_.time, led());
  take_from_owner();
  now_.watch.controllers_start();
}

Code JointArbiter::run_controllers() noexcept TANDEM_RT {
  if (!controls_) start_controllers();
  if (now_.run.in(RunPhase::kRunning)) ++ran_;
  now_.controllers.take_inputs(now_.time, now_.run.in(RunPhase::kRunning), now_.log);
  unfollowed_.offer(now_.state, led().command);
  const Code code = now_.controllers.update(now_.time, led());
  unfollowed_.take(now_.state, led().command);
  if (now_.run.in(RunPhase::kRunning)) references_.lead_back(led().command);  // a retreat waits
  return code;
}

/// Joints that nobody may lead, whoever has written: they stay where they are.
void JointArbiter::overrule() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < leads_.size(); ++j) {
    if (leads_[j] < JointLead::kReset) continue;
    references_.hold(j, led());
    if (leads_[j] != JointLead::kHoming) continue;
    led().command.mode()[j] = static_cast<std::int8_t>(hal::ControlMode::kIdle);
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
