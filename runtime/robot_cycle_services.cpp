// The loop's part of what can be asked of a run: taken, done and answered at a cycle's boundary.
#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

/// Before the controllers of this cycle, and after everything that may change its phase.
void RobotCycle::take_services() noexcept TANDEM_RT {
  for (std::size_t most = LoopMailbox::kCapacity; most > 0; --most) {
    const std::optional<LoopRequest> request = mailbox_.take();
    if (!request) return;
    const bool ending = phase_ == RunPhase::kShutDown || phase_ == RunPhase::kDone;
    LoopAnswer answer = ending ? LoopAnswer{.refusal = RejectReason::kEnding} : carry_out(*request);
    if (answer.refusal == RejectReason::kNone) note_service(*request);
    answer.number = request->number;
    answer.cycle = time_.cycle;
    mailbox_.answer(answer);
  }
}

LoopAnswer RobotCycle::carry_out(const LoopRequest& request) noexcept TANDEM_RT {
  using Kind = LoopRequest::Kind;
  if (phase_ == RunPhase::kRetreating) return {.refusal = RejectReason::kNotEnabled};
  switch (request.kind) {
    case Kind::kInsert: return controllers_->insert(request.slot, *request.controller);
    case Kind::kRemove: {
      const LoopAnswer answer = controllers_->remove(request.slot);
      if (answer.refusal == RejectReason::kNone) {
        held_back_ &= ~only(request.slot);
        before_retreat_ &= ~only(request.slot);
      }
      return answer;
    }
    case Kind::kGoOn: return go_on();
    case Kind::kSwitch:
      if (const LoopAnswer no = controllers_->may_start(request.start);
          no.refusal != RejectReason::kNone) {
        return no;
      }
      if (phase_ == RunPhase::kHeld) return leave_hold(request.stop, request.start);
      return controllers_->switch_over(request.stop, request.start, controlling_, time_, state_,
                                       controlled());
    case Kind::kJoint:
      return controllers_->set_joint(request.joint, request.wish, controlling_, state_,
                                     controlled());
    case Kind::kRecover:
      if (phase_ != RunPhase::kHeld && phase_ != RunPhase::kRunning) {
        return {.refusal = RejectReason::kNotEnabled};
      }
      return controllers_->recover(request.joint, controlled());
    case Kind::kGains: break;
  }
  parameters_.set_gains(request.joint, request.loop, request.gains);
  return {};
}

/// From held joints to controllers: no joint jumps.
LoopAnswer RobotCycle::leave_hold(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT {
  if (delay_.on()) {
    delay_.fill(command_);
    wanted_.assign(command_);
  }
  const LoopAnswer answer =
      controllers_->switch_over(stop, start, true, time_, state_, controlled());
  if (answer.refusal != RejectReason::kNone) return answer;
  held_back_ = 0;
  go(RunPhase::kRunning);
  controlling_ = true;  // they are started
  return answer;
}

/// Starts who was active before the reset.
LoopAnswer RobotCycle::go_on() noexcept TANDEM_RT {
  const bool stopped = phase_ == RunPhase::kFaulted || phase_ == RunPhase::kResetting;
  if (stopped) return {.refusal = RejectReason::kNotEnabled};
  if (phase_ != RunPhase::kHeld) return {.refusal = RejectReason::kNotHeld};
  if (held_back_ == 0) return {.refusal = RejectReason::kGone};
  const LoopAnswer no = controllers_->may_start(held_back_);
  if (no.refusal != RejectReason::kNone) return no;
  return leave_hold(0, held_back_);
}

/// In the log; what comes and goes without moving anything is not.
void RobotCycle::note_service(const LoopRequest& request) noexcept TANDEM_RT {
  using Kind = LoopRequest::Kind;
  const auto joint = static_cast<std::int32_t>(request.joint);
  if (request.kind == Kind::kSwitch || request.kind == Kind::kGoOn) {
    event(log::EventKind::kControllersSwitched);
  }
  if (request.kind == Kind::kJoint || request.kind == Kind::kRecover)
    event(log::EventKind::kJointSet, joint);
  if (request.kind == Kind::kGains) event(log::EventKind::kGainsSet, joint);
}

void RobotCycle::show_joints() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < looks_.size(); ++j) {
    looks_[j] = {.cycle = time_.cycle,
                 .position_rad = state_.position_rad()[j],
                 .velocity_rad_s = state_.velocity_rad_s()[j],
                 .torque_Nm = state_.torque_Nm()[j],
                 .stiffness_Nm_rad = command_.stiffness_Nm_rad()[j],
                 .damping_Nms_rad = command_.damping_Nms_rad()[j],
                 .fault = state_.fault()[j],
                 .age_cycles = state_.age_cycles()[j],
                 .owner = controllers_->owner(j),
                 .mode = command_.mode()[j],
                 .interaction = command_.interaction()[j],
                 .drive_mode = state_.mode()[j],
                 .drive_state = state_.drive_state()[j]};
  }
  services_.show(looks_);
}

}  // namespace tandem::runtime
