#include "runtime/owner_follower.hpp"

namespace tandem::runtime {

using hal::StopCategory;
using log::EventKind;

OwnerFollower::OwnerFollower(CycleNow& now, JointArbiter& arbiter, FaultResponse& response)
    : now_(now),
      arbiter_(arbiter),
      response_(response),
      port_(now.owner.port),
      causes_(now.robot.joints.size()) {
  if (port_ != nullptr) port_->on_news([this] { now_.inbox.bell().ring(); });
}

OwnerFollower::~OwnerFollower() {
  if (port_ != nullptr) port_->on_news({});
}

hal::PortView OwnerFollower::view() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < causes_.size(); ++j) {
    const bool told = now_.state.fault()[j] != 0;
    causes_[j] = told ? static_cast<std::uint8_t>(now_.backend.fault_cause(j)) : 0;
  }
  return {.time = now_.time,
          .phase = now_.run.phase(),
          .read_code = now_.read_code,
          .reaction = now_.run.latched(),
          .state = now_.state,
          .command = arbiter_.command(),
          .causes = causes_};
}

void OwnerFollower::await() noexcept {
  if (port_ == nullptr || !port_->lockstep()) return;
  const hal::PortView shown = view();
  port_->send(shown);
  for (;;) {
    const std::uint32_t seen = now_.inbox.bell().count();
    if (now_.inbox.bell().ended() || now_.inbox.is_urgent()) break;
    const std::int64_t until_ns = port_->wait_until_ns(shown);
    if (until_ns == 0) break;
    now_.inbox.bell().wait(seen, until_ns);
  }
  now_.loop.exchanged();  // waiting is no work of the cycle's own
}

hal::RemoteCommand OwnerFollower::follow() noexcept TANDEM_RT {
  if (port_ == nullptr) return {};
  const hal::RemoteCommand wish = port_->exchange(view());
  now_.owner.controller->follow(wish);
  if (wish.gains != nullptr) take_gains(*wish.gains);
  // An owner that stops because the run ends here asks for what is being done, unless for more.
  const bool stops_already =
      now_.run.in(RunPhase::kShutDown) && wish.stop >= StopCategory::kCategory1;
  if (wish.stop != StopCategory::kWarn && !stops_already) {
    response_.raise({.cause = hal::FaultCause::kOwnerAsked, .category = wish.stop});
  }
  if (wish.loss != hal::FaultCause::kNone && !now_.run.in(RunPhase::kShutDown)) {  // else it may
    response_.raise({.cause = wish.loss, .category = wish.on_loss});               // leave
  }
  const bool ends = wish.done && wish.ends_run;
  if (ends && !wish.live && now_.run.in(RunPhase::kRunning) && is_active()) {
    now_.event(EventKind::kControllersDone);  // in this cycle they command nothing any more
    arbiter_.on(RunEvent::kFinished);
    return wish;
  }
  assign(wish.live);
  const bool serves =
      now_.run.in(RunPhase::kRunning) && is_active();  // its controller ends the run
  if (ends && !serves && !now_.run.in(RunPhase::kShutDown)) {
    now_.event(EventKind::kStopRequested);
    arbiter_.on(RunEvent::kEnd);
  }
  return wish;
}

bool OwnerFollower::is_active() const noexcept TANDEM_RT {
  return (now_.controllers.shown().active & only(now_.owner.slot)) != 0;
}

/// Gives the robot to the owner, or takes it back: a switch of controllers.
void OwnerFollower::assign(bool owned) noexcept TANDEM_RT {
  if (owned == is_active()) return;
  const ControllerSet owner = only(now_.owner.slot);
  const CycleAnswer answer = owned ? arbiter_.switch_over(now_.controllers.shown().active, owner)
                                   : arbiter_.switch_over(owner, 0);
  if (answer.reason == RejectReason::kNone && arbiter_.controls()) {
    now_.event(EventKind::kControllersSwitched);
  }
  if (owned) arbiter_.take_from_owner();
}

void OwnerFollower::take_gains(const hal::ParameterImage& wanted) noexcept TANDEM_RT {
  hal::ParameterImage& gains = now_.controllers.gains();
  for (std::size_t j = 0; j < gains.joints(); ++j) {
    for (std::size_t i = 0; i < hal::kPidLoops; ++i) {
      const auto loop = static_cast<hal::PidLoop>(i);
      if (wanted.gains(j, loop) == gains.gains(j, loop)) continue;
      gains.set_gains(j, loop, wanted.gains(j, loop));
    }
  }
}

}  // namespace tandem::runtime
