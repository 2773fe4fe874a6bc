// What others ask of the loop: taken, done and answered once a cycle, before its controllers.
#include <algorithm>

#include "rt/stop_signal.hpp"
#include "runtime/robot_cycle.hpp"

#include <cmath>

namespace tandem::runtime {

using hal::StopCategory;
using log::EventKind;

namespace {

/// Moves, starts and enables nothing: there it is whatever stops the robot.
bool only_hosts(const LoopRequest& request) noexcept TANDEM_RT {
  return request.kind == LoopRequest::Kind::kInsert || request.kind == LoopRequest::Kind::kRemove;
}

/// joint.stop
bool stops_motion(const LoopRequest& request) noexcept TANDEM_RT {
  return request.kind == LoopRequest::Kind::kMove && !std::isfinite(request.move.target_rad);
}

}  // namespace

/// After everything that may change the phase. Stops come first, from wherever they come: a stop
/// wins over all that was asked before it and in its cycle.
void RobotCycle::take_inbox() noexcept TANDEM_RT {
  const hal::RemoteCommand wish = follow_owner();
  const Inbox::Urgent asked = inbox_.take_urgent();
  if (asked.emergency_stop != StopCategory::kWarn) {
    emergency_stop(EmergencyInput::kRequest, asked.emergency_stop);
  }
  if (asked.by_watchdog) {
    // Not category 2: who hung cannot be trusted to retreat.
    emergency_stop(EmergencyInput::kWatchdog,
                   std::min(robot_->emergency_stop, StopCategory::kCategory1), asked.controller);
  }
  if (rt::take_emergency_stop()) emergency_stop(EmergencyInput::kSignal, robot_->emergency_stop);
  if (wish.reset) begin_reset(wish.reset_cycle);
  if (asked.reset) begin_reset(asked.known);
  const bool end = asked.end || rt::stop_requested();
  if (end && !run_.in(RunPhase::kShutDown)) {
    event(EventKind::kStopRequested);
    on(RunEvent::kEnd);
  }
  take_requests();
  trace_.mark(CycleStage::kCheck, *clock_);
}

void RobotCycle::take_requests() noexcept TANDEM_RT {
  for (std::size_t most = Inbox::kCapacity; most > 0; --most) {
    const std::optional<LoopRequest> request = inbox_.take_request();
    if (!request) return;
    const bool ending = ends(run_.phase());
    const bool at_rest = stops_motion(*request) && !controllers_->leads(request->joint);
    const bool too_late = stops_now() && !only_hosts(*request);
    LoopAnswer answer = ending     ? LoopAnswer{.reason = RejectReason::kEnding}
                        : too_late ? LoopAnswer{.reason = RejectReason::kStopped}
                                   : carry_out(*request);
    if (answer.reason == RejectReason::kNone && !at_rest) log_request(*request);
    answer.number = request->number;
    answer.cycle = time_.cycle;
    inbox_.answer(answer);
  }
}

LoopAnswer RobotCycle::carry_out(const LoopRequest& request) noexcept TANDEM_RT {
  using Kind = LoopRequest::Kind;
  if (run_.in(RunPhase::kRetreating)) return {.reason = RejectReason::kNotEnabled};
  const LoopAnswer not_enabled{.reason = RejectReason::kNotEnabled,
                               .joint = static_cast<std::int32_t>(request.joint)};
  switch (request.kind) {
    case Kind::kInsert: return controllers_->insert(request.slot, *request.controller);
    case Kind::kRemove: {
      const LoopAnswer answer = controllers_->remove(request.slot);
      if (answer.reason == RejectReason::kNone) {
        held_back_ &= ~only(request.slot);
        before_retreat_ &= ~only(request.slot);
      }
      return answer;
    }
    case Kind::kGoOn: return go_on();
    case Kind::kSwitch:
      if (const LoopAnswer no = may_start(request.start); no.reason != RejectReason::kNone) {
        return no;
      }
      if (run_.in(RunPhase::kHeld)) return leave_hold(request.stop, request.start);
      return controllers_->switch_over(request.stop, request.start, controlling_, time_, state_,
                                       controlled());
    case Kind::kJoint: {
      const LoopAnswer no = may_lead(request.joint, request.wish.drives());
      if (no.reason != RejectReason::kNone) return no;
      return controllers_->set_joint(request.joint, request.wish, controlling_, state_,
                                     controlled());
    }
    case Kind::kRecover:
    case Kind::kMove: {
      const bool homes = homings_[request.joint].state == hal::HomingState::kHoming;
      if (homes && stops_motion(request)) {
        backend_->stop_homing(request.joint);
        return {};
      }
      if (!run_.in(RunPhase::kHeld) && !run_.in(RunPhase::kRunning)) return not_enabled;
      const bool recovers = request.kind == Kind::kRecover;
      const LoopAnswer no =
          may_lead(request.joint, recovers || std::isfinite(request.move.target_rad));
      if (no.reason != RejectReason::kNone) return no;
      hal::CommandImage& command = controlling_ ? controlled() : command_;
      if (recovers) return controllers_->recover(request.joint, command);
      return controllers_->move(request.joint, request.move, state_, command);
    }
    case Kind::kReset: return reset_drive(request.joint);
    case Kind::kHome: return home_joint(request.joint);
    case Kind::kGains: set_gains(request); break;
  }
  return {};
}

/// What is not named stays as it is now, whoever has set it.
void RobotCycle::set_gains(const LoopRequest& request) noexcept TANDEM_RT {
  hal::ParameterImage& image = controllers_->gains();
  const hal::PidGains now = image.gains(request.joint, request.loop);
  const auto or_now = [](double wanted, double has) { return std::isnan(wanted) ? has : wanted; };
  image.set_gains(request.joint, request.loop,
                  {or_now(request.gains.kp, now.kp), or_now(request.gains.ki, now.ki),
                   or_now(request.gains.kd, now.kd)});
}

/// @param drives  what is asked for needs a drive that is well
LoopAnswer RobotCycle::may_lead(std::size_t joint, bool drives) const noexcept TANDEM_RT {
  LoopAnswer answer{.joint = static_cast<std::int32_t>(joint)};
  if (resets_[joint] != 0) {
    answer.reason = RejectReason::kResetting;
  } else if (drives && watch_.is_ill(state_, joint)) {
    answer.reason = RejectReason::kDriveFault;
  } else if (homings_[joint].state == hal::HomingState::kHoming) {
    if (drives) answer.reason = RejectReason::kHoming;
  } else if (drives && has_to_be_homed(joint)) {
    answer.reason = RejectReason::kNotHomed;
  }
  return answer;
}

LoopAnswer RobotCycle::may_start(ControllerSet start) const noexcept TANDEM_RT {
  for (std::size_t j = 0; j < resets_.size(); ++j) {
    if (resets_[j] == 0 || !controllers_->is_claimed(j, start)) continue;
    return {.reason = RejectReason::kResetting, .joint = static_cast<std::int32_t>(j)};
  }
  for (const std::size_t j : homes_) {
    if (!controllers_->is_claimed(j, start)) continue;
    LoopAnswer no{.joint = static_cast<std::int32_t>(j)};
    if (homings_[j].state == hal::HomingState::kHoming) no.reason = RejectReason::kHoming;
    if (has_to_be_homed(j)) no.reason = RejectReason::kNotHomed;
    if (no.reason != RejectReason::kNone) return no;
  }
  return controllers_->may_start(start);
}

/// From held joints to controllers: no joint jumps.
LoopAnswer RobotCycle::leave_hold(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT {
  if (delay_.on()) {
    delay_.fill(command_);
    wanted_.assign(command_);
  }
  const LoopAnswer answer =
      controllers_->switch_over(stop, start, true, time_, state_, controlled());
  if (answer.reason != RejectReason::kNone) return answer;
  held_back_ = 0;
  on(RunEvent::kStart);
  controlling_ = true;  // they are started
  return answer;
}

/// Starts who was active before the reset.
LoopAnswer RobotCycle::go_on() noexcept TANDEM_RT {
  const bool stopped = run_.in(RunPhase::kFaulted) || run_.in(RunPhase::kResetting);
  if (stopped) return {.reason = RejectReason::kNotEnabled};
  if (!run_.in(RunPhase::kHeld)) return {.reason = RejectReason::kNotHeld};
  if (held_back_ == 0) return {.reason = RejectReason::kGone};
  const LoopAnswer no = may_start(held_back_);
  if (no.reason != RejectReason::kNone) return no;
  return leave_hold(0, held_back_);
}

/// In the log; what comes and goes without moving anything is not.
void RobotCycle::log_request(const LoopRequest& request) noexcept TANDEM_RT {
  using Kind = LoopRequest::Kind;
  const auto joint = static_cast<std::int32_t>(request.joint);
  if (request.kind == Kind::kSwitch || request.kind == Kind::kGoOn) {
    event(EventKind::kControllersSwitched);
  }
  if (request.kind == Kind::kJoint) event(EventKind::kJointSet, joint);
  if (request.kind == Kind::kHome) event(EventKind::kHomingRequested, joint);
  if (request.kind == Kind::kRecover) event(EventKind::kRecoveryRequested, joint);
  if (request.kind == Kind::kGains) event(EventKind::kGainsSet, joint);
  if (request.kind != Kind::kMove) return;
  if (stops_motion(request)) return event(EventKind::kMotionStopped, joint);
  const std::uint32_t unit = robot_->joints[request.joint].slides ? 1 : 0;
  log_.event(time_, EventKind::kMotionRequested, joint, unit,
             static_cast<float>(request.move.target_rad));
}

}  // namespace tandem::runtime
