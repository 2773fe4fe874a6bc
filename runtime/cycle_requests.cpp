#include "runtime/cycle_requests.hpp"

#include <cmath>
#include <iterator>
#include <string_view>

#include "runtime/refusal_text.hpp"
#include "runtime/run_services.hpp"

namespace tandem::runtime {

using log::EventKind;
using RequestKind = CycleRequest::Kind;

namespace {

/// Moves, starts and enables nothing: there it is whatever stops the robot.
bool only_hosts(const CycleRequest& request) noexcept TANDEM_RT {
  return request.kind == RequestKind::kInsert || request.kind == RequestKind::kRemove;
}

/// joint.stop
bool stops_motion(const CycleRequest& request) noexcept TANDEM_RT {
  return request.kind == RequestKind::kMove && !std::isfinite(request.move.target_rad);
}

CycleAnswer remove(CycleRequests& to, std::size_t slot) noexcept TANDEM_RT {
  const CycleAnswer answer = to.now.controllers.remove(slot);
  if (answer.reason == RejectReason::kNone) to.waiting.forget(slot);
  return answer;
}

CycleAnswer switch_over(CycleRequests& to, const CycleRequest& request) noexcept TANDEM_RT {
  const CycleAnswer no = to.arbiter.may_start(request.start);
  if (no.reason != RejectReason::kNone) return no;
  if (to.now.run.in(RunPhase::kHeld)) return to.waiting.leave_hold(request.stop, request.start);
  return to.arbiter.switch_over(request.stop, request.start);
}

CycleAnswer begin_shadow(CycleRequests& to, std::size_t slot) noexcept TANDEM_RT {
  if (!to.arbiter.controls()) return {.reason = RejectReason::kNotRunning};
  return to.now.controllers.shadows().begin(slot, to.now.time);
}

CycleAnswer wait_to_switch(CycleRequests& to, const CycleRequest& request) noexcept TANDEM_RT {
  const std::uint64_t now = to.now.time.cycle;
  if (request.start == 0) return to.now.controllers.shadows().give_up(SwitchEnd::kRequested, now);
  return to.now.controllers.shadows().wait_for({.stop = request.stop,
                                                .start = request.start,
                                                .within = request.within,
                                                .until = now + request.cycles},
                                               now);
}

/// A motion, its stop, and the way back to the limits.
CycleAnswer move(CycleRequests& to, const CycleRequest& request) noexcept TANDEM_RT {
  const bool stops = stops_motion(request);
  if (stops && to.homing.is_on(request.joint)) {
    to.now.backend.stop_homing(request.joint);
    return {};
  }
  CycleAnswer no{.joint = static_cast<std::int32_t>(request.joint)};
  if (!to.now.run.in(RunPhase::kHeld) && !to.now.run.in(RunPhase::kRunning)) {
    no.reason = RejectReason::kNotEnabled;
  } else {
    no = to.arbiter.may_lead(request.joint, !stops);
  }
  if (no.reason != RejectReason::kNone) return no;
  if (request.kind == RequestKind::kRecover) return to.arbiter.recover(request.joint);
  return to.arbiter.move(request.joint, request.move);
}

/// What is not named stays as it is now, whoever has set it.
void set_gains(CycleRequests& to, const CycleRequest& request) noexcept TANDEM_RT {
  hal::ParameterImage& image = to.now.controllers.gains();
  const hal::PidGains now = image.gains(request.joint, request.loop);
  const auto or_now = [](double wanted, double has) { return std::isnan(wanted) ? has : wanted; };
  image.set_gains(request.joint, request.loop,
                  {or_now(request.gains.kp, now.kp), or_now(request.gains.ki, now.ki),
                   or_now(request.gains.kd, now.kd)});
}

/// For the name of what is in `slot`.
std::int32_t id_in(CycleNow& now, std::size_t slot) noexcept TANDEM_RT {
  const HostedController* const one = now.controllers.at(slot);
  return one == nullptr ? -1 : static_cast<std::int32_t>(one->id);
}

/// For the log: all that is needed to ask for the same again. Parameters are in events.
log::Given given_of(const CycleRequest& request) noexcept TANDEM_RT {
  using Kind = log::GivenKind;
  const auto of = [&](Kind kind, double a = 0.0, double b = 0.0, double c = 0.0, double d = 0.0) {
    const bool of_slot = kind == Kind::kInsert || kind == Kind::kRemove || kind == Kind::kReplace ||
                         kind == Kind::kShadow || kind == Kind::kEndShadow;
    return log::Given{.values = {a, b, c, d},
                      .start = request.start,
                      .stop = request.stop,
                      .index = static_cast<std::int32_t>(of_slot ? request.slot : request.joint),
                      .kind = kind};
  };
  const JointRequest& wish = request.wish;
  const MoveRequest& move = request.move;
  switch (request.kind) {
    case RequestKind::kInsert: return of(Kind::kInsert);
    case RequestKind::kRemove: return of(Kind::kRemove);
    case RequestKind::kReplace: return of(Kind::kReplace);
    case RequestKind::kSwitch: return of(Kind::kSwitch);
    case RequestKind::kShadow: return of(Kind::kShadow);
    case RequestKind::kEndShadow: return of(Kind::kEndShadow);
    case RequestKind::kSwitchWhen:
      return of(Kind::kSwitchWhen, request.within, static_cast<double>(request.cycles));
    case RequestKind::kGoOn: return of(Kind::kGoOn);
    case RequestKind::kJoint:
      return of(Kind::kJoint, wish.stiffness_Nm_rad, wish.damping_Nms_rad, wish.mode,
                wish.interaction);
    case RequestKind::kGains:
      return of(Kind::kGains, request.gains.kp, request.gains.ki, request.gains.kd,
                static_cast<double>(request.loop));
    case RequestKind::kRecover: return of(Kind::kRecover);
    case RequestKind::kMove:
      return of(Kind::kMove, move.target_rad, move.speed_rad_s, move.acceleration_rad_s2);
    case RequestKind::kReset: return of(Kind::kResetDrive);
    case RequestKind::kHome: return of(Kind::kHome);
    case RequestKind::kLink:
      return of(Kind::kLink, request.link.delay_s, request.link.jitter_s, request.link.loss,
                (request.link.up ? 1.0 : 0.0) + (request.link.down ? 2.0 : 0.0));
    case RequestKind::kSet: break;
  }
  return of(Kind::kGoOn);
}

/// As `tandem ask` calls them, in the order of RequestKind.
constexpr std::string_view kAsked[] = {
    "controller.load",   "controller.unload", "controller.reload",
    "controller.switch", "controller.shadow", "controller.shadow --end",
    "controller.switch", "controller.start",  "joint.set",
    "joint.gains",       "joint.recover",     "joint.move",
    "joint.reset",       "joint.home",        "controller.set",
    "link.set",
};
static_assert(std::size(kAsked) == static_cast<std::size_t>(RequestKind::kLink) + 1);

/// Whoever asked has been told that it will happen.
void tell_refused(CycleRequests& to, const CycleRequest& request,
                  const CycleAnswer& answer) noexcept TANDEM_RT {
  const auto name_in = [&](std::int32_t slot) -> std::string_view {
    const HostedController* const one =
        slot < 0 ? nullptr : to.now.controllers.at(static_cast<std::size_t>(slot));
    return one == nullptr ? std::string_view() : std::string_view(one->name);
  };
  hal::TextEvent text{.cycle = to.now.time.cycle, .time_ns = to.now.time.time_ns};
  text.level = hal::TextLevel::kWarn;
  text.set_controller(asked_as(request.kind));
  text.append("refused: ");
  const std::string_view joint =
      answer.joint < 0
          ? std::string_view()
          : std::string_view(to.now.robot.joints[static_cast<std::size_t>(answer.joint)].name);
  append_refusal(text, answer.reason,
                 {.joint = joint, .one = name_in(answer.one), .other = name_in(answer.other)});
  to.now.log.text(text);
  to.services.show(text);
}

/// What comes and goes without moving anything is no event.
void log(CycleNow& now, const CycleRequest& request) noexcept TANDEM_RT {
  const auto joint = static_cast<std::int32_t>(request.joint);
  if (request.kind != RequestKind::kSet) now.log.given(now.time, given_of(request));
  switch (request.kind) {
    case RequestKind::kSwitch:
    case RequestKind::kGoOn: return now.event(EventKind::kControllersSwitched);
    case RequestKind::kShadow:
      return now.event(EventKind::kShadowStarted, -1, 0, id_in(now, request.slot));
    case RequestKind::kEndShadow:
      return now.event(EventKind::kShadowEnded, -1, 0, id_in(now, request.slot));
    case RequestKind::kSwitchWhen:
      if (request.start != 0) now.event(EventKind::kSwitchWaits);
      return;
    case RequestKind::kLink: return now.event(EventKind::kLinkSet);
    case RequestKind::kReplace: {
      const auto kept = static_cast<std::uint32_t>(request.controller->succession->kept);
      return now.event(EventKind::kControllerReloaded, -1, kept);
    }
    case RequestKind::kJoint: return now.event(EventKind::kJointSet, joint);
    case RequestKind::kHome: return now.event(EventKind::kHomingRequested, joint);
    case RequestKind::kRecover: return now.event(EventKind::kRecoveryRequested, joint);
    case RequestKind::kGains: return now.event(EventKind::kGainsSet, joint);
    case RequestKind::kSet:
      for (const ParameterChange& change : *request.changes)
        now.log.event(now.time, EventKind::kParameterSet, change);
      return;
    case RequestKind::kMove: break;
    default: return;
  }
  if (stops_motion(request)) return now.event(EventKind::kMotionStopped, joint);
  const std::uint32_t unit = now.robot.joints[request.joint].slides ? 1 : 0;
  now.log.event(now.time, EventKind::kMotionRequested, joint, unit,
                static_cast<float>(request.move.target_rad));
}

CycleAnswer carry_out(CycleRequests& to, const CycleRequest& request) noexcept TANDEM_RT {
  if (to.now.run.in(RunPhase::kRetreating)) return {.reason = RejectReason::kNotEnabled};
  switch (request.kind) {
    case RequestKind::kInsert: return to.now.controllers.insert(request.slot, *request.controller);
    case RequestKind::kRemove: return remove(to, request.slot);
    case RequestKind::kReplace: return to.arbiter.replace(request.slot, *request.controller);
    case RequestKind::kGoOn: return to.waiting.go_on();
    case RequestKind::kSwitch: return switch_over(to, request);
    case RequestKind::kShadow: return begin_shadow(to, request.slot);
    case RequestKind::kEndShadow: return to.now.controllers.shadows().end(request.slot);
    case RequestKind::kSwitchWhen: return wait_to_switch(to, request);
    case RequestKind::kJoint: {
      const CycleAnswer no = to.arbiter.may_lead(request.joint, request.wish.drives());
      if (no.reason != RejectReason::kNone) return no;
      return to.arbiter.set_joint(request.joint, request.wish);
    }
    case RequestKind::kRecover:
    case RequestKind::kMove: return move(to, request);
    case RequestKind::kReset: return to.resets.begin(request.joint);
    case RequestKind::kHome: return to.homing.begin(request.joint);
    case RequestKind::kGains: set_gains(to, request); break;
    case RequestKind::kSet: return to.now.controllers.set_parameters(*request.changes);
    case RequestKind::kLink:
      if (!to.now.backend.set_link(request.link)) return {.reason = RejectReason::kNoLink};
      break;
  }
  return {};
}

}  // namespace

std::string_view asked_as(CycleRequest::Kind kind) noexcept TANDEM_RT {
  return kAsked[static_cast<std::size_t>(kind)];
}

void CycleRequests::carry_out() noexcept TANDEM_RT {
  for (std::size_t most = Inbox::kCapacity; most > 0; --most) {
    const std::optional<CycleRequest> request = now.inbox.take_request();
    if (!request) return;
    now.outside.came = true;
    const bool ending = ends(now.run.phase());
    const bool at_rest =
        stops_motion(*request) && !now.controllers.references().leads(request->joint);
    const bool too_late = response.stops_now() && !only_hosts(*request);
    CycleAnswer answer = ending     ? CycleAnswer{.reason = RejectReason::kEnding}
                         : too_late ? CycleAnswer{.reason = RejectReason::kStopped}
                                    : runtime::carry_out(*this, *request);
    if (answer.reason == RejectReason::kNone && !at_rest) log(now, *request);
    const bool left = now.inbox.take_left(request->number);
    if (answer.reason != RejectReason::kNone && left) tell_refused(*this, *request, answer);
    answer.number = request->number;
    answer.cycle = now.time.cycle;
    now.inbox.answer(answer);
  }
}

void CycleRequests::carry_out_waiting() noexcept TANDEM_RT {
  ControllerShadows& shadows = now.controllers.shadows();
  const std::uint64_t cycle = now.time.cycle;
  if (shadows.lost_its_premise()) (void)shadows.give_up(SwitchEnd::kStopped, cycle);
  if (const SwitchEnd end = shadows.take_switch_end(); end != SwitchEnd::kNone)
    now.event(EventKind::kSwitchGivenUp, -1, static_cast<std::uint32_t>(end));
  if (!shadows.waiting() || response.stops_now()) return;
  const WaitingSwitch wanted = *shadows.waiting();
  if (shadows.agree(cycle) && arbiter.may_start(wanted.start).reason == RejectReason::kNone) {
    shadows.settle(SwitchState::kDone, cycle);
    const CycleAnswer done = arbiter.switch_over(wanted.stop, wanted.start);
    if (done.reason == RejectReason::kNone) return now.event(EventKind::kControllersSwitched);
    shadows.settle(SwitchState::kRefused, cycle);
    now.event(EventKind::kSwitchGivenUp, -1, static_cast<std::uint32_t>(SwitchEnd::kTaken));
  } else if (cycle >= wanted.until) {
    shadows.settle(SwitchState::kTimeOut, cycle);
    now.event(EventKind::kSwitchGivenUp, -1, static_cast<std::uint32_t>(SwitchEnd::kTimeOut));
  }
}

}  // namespace tandem::runtime
