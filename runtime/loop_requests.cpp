#include "runtime/loop_requests.hpp"

#include <cmath>

namespace tandem::runtime {

using log::EventKind;
using RequestKind = LoopRequest::Kind;

namespace {

/// Moves, starts and enables nothing: there it is whatever stops the robot.
bool only_hosts(const LoopRequest& request) noexcept TANDEM_RT {
  return request.kind == RequestKind::kInsert || request.kind == RequestKind::kRemove;
}

/// joint.stop
bool stops_motion(const LoopRequest& request) noexcept TANDEM_RT {
  return request.kind == RequestKind::kMove && !std::isfinite(request.move.target_rad);
}

}  // namespace

void LoopRequests::carry_out() noexcept TANDEM_RT {
  for (std::size_t most = Inbox::kCapacity; most > 0; --most) {
    const std::optional<LoopRequest> request = inbox_.take_request();
    if (!request) return;
    const bool ending = ends(now_.run.phase());
    const bool at_rest = stops_motion(*request) && !now_.controllers.leads(request->joint);
    const bool too_late = response_.stops_now() && !only_hosts(*request);
    LoopAnswer answer = ending     ? LoopAnswer{.reason = RejectReason::kEnding}
                        : too_late ? LoopAnswer{.reason = RejectReason::kStopped}
                                   : carry_out(*request);
    if (answer.reason == RejectReason::kNone && !at_rest) log(*request);
    answer.number = request->number;
    answer.cycle = now_.time.cycle;
    inbox_.answer(answer);
  }
}

LoopAnswer LoopRequests::carry_out(const LoopRequest& request) noexcept TANDEM_RT {
  if (now_.run.in(RunPhase::kRetreating)) return {.reason = RejectReason::kNotEnabled};
  switch (request.kind) {
    case RequestKind::kInsert: return now_.controllers.insert(request.slot, *request.controller);
    case RequestKind::kRemove: return remove(request.slot);
    case RequestKind::kGoOn: return waiting_.go_on();
    case RequestKind::kSwitch: return switch_over(request);
    case RequestKind::kJoint: {
      const LoopAnswer no = arbiter_.may_lead(request.joint, request.wish.drives());
      if (no.reason != RejectReason::kNone) return no;
      return arbiter_.set_joint(request.joint, request.wish);
    }
    case RequestKind::kRecover:
    case RequestKind::kMove: return move(request);
    case RequestKind::kReset: return resets_.begin(request.joint);
    case RequestKind::kHome: return homing_.begin(request.joint);
    case RequestKind::kGains: set_gains(request); break;
  }
  return {};
}

LoopAnswer LoopRequests::remove(std::size_t slot) noexcept TANDEM_RT {
  const LoopAnswer answer = now_.controllers.remove(slot);
  if (answer.reason == RejectReason::kNone) waiting_.forget(slot);
  return answer;
}

LoopAnswer LoopRequests::switch_over(const LoopRequest& request) noexcept TANDEM_RT {
  const LoopAnswer no = arbiter_.may_start(request.start);
  if (no.reason != RejectReason::kNone) return no;
  if (now_.run.in(RunPhase::kHeld)) return waiting_.leave_hold(request.stop, request.start);
  return arbiter_.switch_over(request.stop, request.start);
}

/// A motion, its stop, and the way back to the limits.
LoopAnswer LoopRequests::move(const LoopRequest& request) noexcept TANDEM_RT {
  const bool stops = stops_motion(request);
  if (stops && homing_.is_on(request.joint)) {
    now_.backend.stop_homing(request.joint);
    return {};
  }
  LoopAnswer no{.joint = static_cast<std::int32_t>(request.joint)};
  if (!now_.run.in(RunPhase::kHeld) && !now_.run.in(RunPhase::kRunning)) {
    no.reason = RejectReason::kNotEnabled;
  } else {
    no = arbiter_.may_lead(request.joint, !stops);
  }
  if (no.reason != RejectReason::kNone) return no;
  if (request.kind == RequestKind::kRecover) return arbiter_.recover(request.joint);
  return arbiter_.move(request.joint, request.move);
}

/// What is not named stays as it is now, whoever has set it.
void LoopRequests::set_gains(const LoopRequest& request) noexcept TANDEM_RT {
  hal::ParameterImage& image = now_.controllers.gains();
  const hal::PidGains now = image.gains(request.joint, request.loop);
  const auto or_now = [](double wanted, double has) { return std::isnan(wanted) ? has : wanted; };
  image.set_gains(request.joint, request.loop,
                  {or_now(request.gains.kp, now.kp), or_now(request.gains.ki, now.ki),
                   or_now(request.gains.kd, now.kd)});
}

/// What comes and goes without moving anything is not logged.
void LoopRequests::log(const LoopRequest& request) noexcept TANDEM_RT {
  const auto joint = static_cast<std::int32_t>(request.joint);
  switch (request.kind) {
    case RequestKind::kSwitch:
    case RequestKind::kGoOn: return now_.event(EventKind::kControllersSwitched);
    case RequestKind::kJoint: return now_.event(EventKind::kJointSet, joint);
    case RequestKind::kHome: return now_.event(EventKind::kHomingRequested, joint);
    case RequestKind::kRecover: return now_.event(EventKind::kRecoveryRequested, joint);
    case RequestKind::kGains: return now_.event(EventKind::kGainsSet, joint);
    case RequestKind::kMove: break;
    default: return;
  }
  if (stops_motion(request)) return now_.event(EventKind::kMotionStopped, joint);
  const std::uint32_t unit = now_.robot.joints[request.joint].slides ? 1 : 0;
  now_.log.event(now_.time, EventKind::kMotionRequested, joint, unit,
                 static_cast<float>(request.move.target_rad));
}

}  // namespace tandem::runtime
