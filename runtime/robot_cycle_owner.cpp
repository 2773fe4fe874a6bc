// The loop's part of an owner in another process: shown each cycle, followed, and left.
#include <algorithm>

#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

using hal::StopCategory;
using log::EventKind;

RobotCycle::~RobotCycle() {
  if (owner_.port != nullptr) owner_.port->on_news({});
}

hal::PortView RobotCycle::port_view() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < causes_.size(); ++j) {
    const bool told = state_.fault()[j] != 0;
    causes_[j] = told ? static_cast<std::uint8_t>(backend_->fault_cause(j)) : 0;
  }
  return {.time = time_,
          .phase = run_.phase(),
          .read_code = read_code_,
          .reaction = run_.latched(),
          .state = state_,
          .command = command_,
          .causes = causes_};
}

/// In lockstep: blocks until the owner's command for this cycle is there, or there is something
/// else to do.
void RobotCycle::await_owner() noexcept {
  if (owner_.port == nullptr || !owner_.port->lockstep()) return;
  const hal::PortView view = port_view();
  owner_.port->send(view);
  for (;;) {
    const std::uint32_t seen = inbox_.bell().count();
    if (inbox_.bell().ended() || inbox_.is_urgent()) break;
    const std::int64_t until_ns = owner_.port->wait_until_ns(view);
    if (until_ns == 0) break;
    inbox_.bell().wait(seen, until_ns);
  }
  loop_.exchanged();  // waiting is no work of the cycle's own
}

/// @return what it wants: the reset is left, until every stop of the cycle is known
hal::RemoteCommand RobotCycle::follow_owner() noexcept TANDEM_RT {
  if (owner_.port == nullptr) return {};
  const hal::RemoteCommand wish = owner_.port->exchange(port_view());
  owner_.controller->follow(wish);
  if (wish.gains != nullptr) take_gains(*wish.gains);
  // An owner that stops because the run ends here asks for what is being done, unless for more.
  const bool stops_already = run_.in(RunPhase::kShutDown) && wish.stop >= StopCategory::kCategory1;
  if (wish.stop != StopCategory::kWarn && !stops_already) {
    fault({.source = FaultSource::kOwner, .category = wish.stop});
  }
  if (wish.loss != hal::OwnerLoss::kNone && !run_.in(RunPhase::kShutDown)) {  // else it may leave
    fault({.code = static_cast<std::uint32_t>(wish.loss),
           .source = FaultSource::kOwner,
           .category = wish.on_loss});
  }
  const bool ends = wish.done && wish.ends_run;
  if (ends && !wish.live && run_.in(RunPhase::kRunning) && has_owner()) {
    event(EventKind::kControllersDone);  // in this cycle they command nothing any more
    on(RunEvent::kFinished);
    return wish;
  }
  assign_owner(wish.live);
  const bool serves = run_.in(RunPhase::kRunning) && has_owner();  // its controller ends the run
  if (ends && !serves && !run_.in(RunPhase::kShutDown)) {
    event(EventKind::kStopRequested);
    on(RunEvent::kEnd);
  }
  return wish;
}

bool RobotCycle::has_owner() const noexcept TANDEM_RT {
  return (controllers_->shown().active & only(owner_.slot)) != 0;
}

/// Gives the robot to the owner, or takes it back: a switch of controllers.
void RobotCycle::assign_owner(bool owned) noexcept TANDEM_RT {
  if (owned == has_owner()) return;
  const ControllerSet owner = only(owner_.slot);
  const LoopAnswer answer =
      owned ? controllers_->switch_over(controllers_->shown().active, owner, controlling_, time_,
                                        state_, controlled())
            : controllers_->switch_over(owner, 0, controlling_, time_, state_, controlled());
  if (answer.reason == RejectReason::kNone && controlling_) event(EventKind::kControllersSwitched);
  if (owned) take_from_owner();
}

/// In lockstep the owner's end has led its joints over from what is in force here, and its delay
/// and its limits have passed that on: what arrives is the command, to the last bit.
void RobotCycle::take_from_owner() noexcept TANDEM_RT {
  if (owner_.port != nullptr && owner_.port->lockstep() && has_owner())
    controllers_->take_as_written(controlled());
}

void RobotCycle::take_gains(const hal::ParameterImage& wanted) noexcept TANDEM_RT {
  hal::ParameterImage& gains = controllers_->gains();
  for (std::size_t j = 0; j < gains.joints(); ++j) {
    for (std::size_t i = 0; i < hal::kPidLoops; ++i) {
      const auto loop = static_cast<hal::PidLoop>(i);
      if (wanted.gains(j, loop) == gains.gains(j, loop)) continue;
      gains.set_gains(j, loop, wanted.gains(j, loop));
    }
  }
}

}  // namespace tandem::runtime
