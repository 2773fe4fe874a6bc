#include "runtime/robot_cycle.hpp"

#include "rt/scoped_realtime.hpp"

namespace tandem::runtime {

using log::EventKind;

namespace {

bool controllers_run(RunPhase phase) noexcept TANDEM_RT {
  return phase == RunPhase::kRunning || phase == RunPhase::kRetreating;
}

}  // namespace

// A run's course, one cycle: everything else in this file is one of its stages.

bool RobotCycle::step() noexcept {
  if (phase_ == RunPhase::kDone) return false;
  rt::Tick tick = wait();
  time_ = {tick.cycle, tick.time_ns, config_.loop.period_ns};
  begin_ns_ = tick.begin_ns;
  wakeup_ns_ = tick.wakeup_ns;
  trace_wait(tick);
  exchange(tick);
  sense(tick);
  await_owner();
  act(tick);
  return phase_ != RunPhase::kDone;
}

void RobotCycle::sense(const rt::Tick& tick) noexcept TANDEM_RT {
  const rt::ScopedRealtime in_cycle;
  heartbeat_.enter();
  read();
  mark(Stage::kRead);
  check(tick);
  heartbeat_.leave();
}

void RobotCycle::act(const rt::Tick& tick) noexcept TANDEM_RT {
  const rt::ScopedRealtime in_cycle;
  heartbeat_.enter();
  follow_owner();
  take_requests();
  mark(Stage::kCheck);
  update(tick);
  mark(Stage::kUpdate);
  limit();
  mark(Stage::kLimit);
  write();
  mark(Stage::kWrite);
  hand_over();
  requests_.confirm(time_.cycle);
  finished_ns_ = loop_.finish();
  mark(Stage::kHandOver, finished_ns_);
  heartbeat_.leave();
}

/// May block, as the backend's exchange() may and nothing else: for the cycle's time and, when time
/// is simulated, for the log, and while it is paused.
rt::Tick RobotCycle::wait() noexcept {
  // Three images, and every event that one cycle can bring.
  const std::size_t most =
      3 + 16 + LoopMailbox::kCapacity + 3 * joint_faulted_.size() + sensor_lost_.size();
  const bool may_wait = config_.loop.pacing == rt::Pacing::kSimulated;
  if (may_wait && recorder_ != nullptr) recorder_->wait_for_space(most);
  return loop_.wait();
}

/// May block until the robot has answered, which does not count as the cycle's work.
void RobotCycle::exchange(rt::Tick& tick) noexcept {
  backend_->exchange(time_);
  if (const std::uint64_t missed = backend_->missed(); missed > 0) {
    loop_.skip(tick, missed);
    time_ = {tick.cycle, tick.time_ns, config_.loop.period_ns};
  }
  if (backend_->waits_for_bus()) mark(Stage::kExchange, loop_.exchanged());
}

void RobotCycle::read() noexcept TANDEM_RT {
  read_code_ = backend_->read(time_, state_);
  state_.cycle()[0] = time_.cycle;
  state_.time_ns()[0] = time_.time_ns;
  if (!started_) event(EventKind::kStarted);
  started_ = true;
  for (int most = 4; most > 0; --most) {  // of a cycle, for there is only so much room in the log
    const hal::InjectedFault injected = backend_->next_injected();
    if (injected.kind == hal::FaultKind::kNone) break;
    event(EventKind::kInjected, injected.joint, static_cast<std::uint32_t>(injected.kind));
  }
}

void RobotCycle::check(const rt::Tick& tick) noexcept TANDEM_RT {
  if (tick.skipped > 0) event(EventKind::kOverrun, -1, static_cast<std::uint32_t>(tick.skipped));
  const bool stopping = phase_ == RunPhase::kFaulted || phase_ == RunPhase::kShutDown;
  if (tick.stop && !stopping) {
    fault({.source = FaultSource::kOverrun, .category = hal::StopCategory::kCategory1});
  }
  if (phase_ != RunPhase::kBringUp && phase_ != RunPhase::kShutDown) {
    check_joints();
    check_sensors();
  }
  if (controllers_run(phase_)) check_fall();
  check_backend(read_code_);
  advance_phase();
}

/// The run's course when nobody asks for anything.
void RobotCycle::advance_phase() noexcept TANDEM_RT {
  const std::uint64_t in_phase = time_.cycle - phase_began_;
  if (phase_ == RunPhase::kBringUp) {
    if (backend_->phase() == hal::Phase::kOperational) {
      event(EventKind::kBringUpDone);
      go(config_.settle_cycles > 0 ? RunPhase::kSettling : RunPhase::kRunning);
    } else if (in_phase >= config_.bring_up_cycles) {
      fault({.source = FaultSource::kBringUp, .category = hal::StopCategory::kCategory1});
    }
  } else if (phase_ == RunPhase::kSettling) {
    if (in_phase >= config_.settle_cycles) go(RunPhase::kRunning);
  } else if (phase_ == RunPhase::kResetting) {
    watch_reset();
  } else if (time_is_over(in_phase)) {
    event(EventKind::kControllersDone);
    go(RunPhase::kShutDown);
  }
}

/// A robot that holds its joints until the end has its time go on.
bool RobotCycle::time_is_over(std::uint64_t in_phase) const noexcept TANDEM_RT {
  const bool holds = (phase_ == RunPhase::kFaulted || phase_ == RunPhase::kHeld) &&
                     config_.after_stop == AfterStop::kEnd;
  if (config_.running_cycles == 0 || (phase_ != RunPhase::kRunning && !holds)) return false;
  return spent_ + in_phase >= config_.running_cycles;
}

void RobotCycle::update(const rt::Tick& tick) noexcept TANDEM_RT {
  stamp(command_);
  stamp(wanted_);
  switch (phase_) {
    case RunPhase::kBringUp:
    case RunPhase::kResetting:
      controllers_->release(command_);  // every reference follows its joint until it is enabled
      controllers_->hold(state_, command_);
      (void)go_on_from_robot();
      break;
    case RunPhase::kSettling:
    case RunPhase::kHeld:
      controllers_->hold(state_, command_);
      controllers_->lead_back(command_);
      break;
    case RunPhase::kRunning:
      if (!tick.hold) run_controllers();  // else the last command goes out once more
      break;
    case RunPhase::kRetreating: go_on_retreating(); break;
    case RunPhase::kFaulted:
    case RunPhase::kShutDown:
      if (reaction_ == hal::StopCategory::kCategory0) {
        controllers_->release(command_);
      } else {
        controllers_->hold(state_, command_);
      }
      break;
    case RunPhase::kDone: break;
  }
}

void RobotCycle::run_controllers() noexcept TANDEM_RT {
  if (!controlling_) {
    start_controllers();
    fall_watch_.begin();
  }
  controlling_ = true;
  ++ran_;
  const Code code = controllers_->update(time_, state_, controlled());
  controllers_->lead_back(controlled());
  if (delay_.on()) delay_.pass(wanted_, command_);
  controllers_answered(code);
  if (const auto stray = controllers_->take_stray()) {
    fault({.index = static_cast<std::int32_t>(stray->joint),
           .code = stray->controller,
           .source = FaultSource::kStray,
           .category = config_.on_stray});
  }
}

void RobotCycle::controllers_answered(Code code) noexcept TANDEM_RT {
  if (code == Code::kOk) return;
  if (code == Code::kStopped) {
    event(EventKind::kControllersDone);
    go(RunPhase::kShutDown);
    return;
  }
  fault({.index = static_cast<std::int32_t>(controllers_->failed_controller()),
         .code = static_cast<std::uint32_t>(code),
         .source = FaultSource::kController,
         .category = hal::StopCategory::kCategory1});
}

/// Until they have brought the robot to its posture, or their time is over.
void RobotCycle::go_on_retreating() noexcept TANDEM_RT {
  const Code code = controllers_->update(time_, state_, controlled());
  if (delay_.on()) delay_.pass(wanted_, command_);
  if (code != Code::kOk && code != Code::kStopped) return controllers_answered(code);
  const bool late = time_.cycle - phase_began_ >= config_.retreat_cycles;
  if (late || code == Code::kStopped) react(hal::StopCategory::kCategory1);
}

void RobotCycle::stamp(hal::CommandImage& command) const noexcept TANDEM_RT {
  command.cycle()[0] = time_.cycle;
  command.time_ns()[0] = time_.time_ns;
}

/// From what the robot follows, when that is another loop's. False: it is not.
bool RobotCycle::go_on_from_robot() noexcept TANDEM_RT {
  const bool is_others = backend_->command_in_force(command_);
  stamp(command_);
  return is_others;
}

void RobotCycle::start_controllers() noexcept TANDEM_RT {
  if (go_on_from_robot()) limits_.follow(command_);
  if (delay_.on()) {
    controllers_->hold(state_, command_);
    delay_.fill(command_);
    wanted_.assign(command_);
  }
  controllers_->start(time_, state_, controlled());
}

void RobotCycle::limit() noexcept TANDEM_RT {
  if (limits_.apply(state_, command_) == Code::kOk) return;
  const auto codes = limits_.codes();
  for (std::size_t j = 0; j < codes.size(); ++j) {
    if (codes[j] == Code::kOk) continue;
    const auto joint = static_cast<std::int32_t>(j);
    if (joint_limited_[j] == 0) {
      event(EventKind::kLimited, joint, static_cast<std::uint32_t>(codes[j]));
      joint_limited_[j] = 1;
    }
    if (codes[j] == Code::kNotFinite && controllers_run(phase_)) {
      fault({.index = joint,
             .code = static_cast<std::uint32_t>(codes[j]),
             .source = FaultSource::kCommand,
             .category = hal::StopCategory::kCategory1});
    }
  }
}

void RobotCycle::write() noexcept TANDEM_RT {
  if (phase_ != RunPhase::kShutDown) {
    check_backend(backend_->write(command_, parameters_));
    return;
  }
  backend_->last_command(command_);
  const bool disabled = backend_->shut_down();
  const bool too_long = time_.cycle - phase_began_ >= config_.shut_down_cycles;
  if (!disabled && !too_long && read_code_ != Code::kDiverged) return;
  event(EventKind::kShutDown);
  go(RunPhase::kDone);
}

void RobotCycle::hand_over() noexcept TANDEM_RT {
  if (phase_ == RunPhase::kRunning) {
    statistics_.take(state_, command_, truth_, limits_.counters());
  }
  if (recorder_ != nullptr) {
    recorder_->push(state_channel_, time_.time_ns, state_.bytes());
    recorder_->push(command_channel_, time_.time_ns, command_.bytes());
    if (truth_ != nullptr) recorder_->push(truth_channel_, time_.time_ns, truth_->bytes());
    progress_.dropped.store(recorder_->dropped(), std::memory_order_relaxed);
  }
  progress_.phase.store(phase_, std::memory_order_relaxed);
  progress_.cycles.store(loop_.statistics().cycles, std::memory_order_relaxed);
  progress_.time_ns.store(time_.time_ns, std::memory_order_relaxed);
  progress_.running_cycles.store(ran_, std::memory_order_relaxed);
  progress_.latched.store(faults_.latched(), std::memory_order_relaxed);
  progress_.overruns.store(loop_.statistics().overruns, std::memory_order_relaxed);
  show_joints();
  show();
}

void RobotCycle::show() noexcept TANDEM_RT {
  if (observer_ == nullptr) return;
  observer_->take({.time = time_,
                   .phase = phase_,
                   .read_code = read_code_,
                   .state = state_,
                   .command = command_,
                   .truth = truth_,
                   .times = {.begin_ns = begin_ns_,
                             .wakeup_ns = wakeup_ns_,
                             .bus_ns = loop_.last_bus_ns(),
                             .work_ns = loop_.last_work_ns(),
                             .overruns = loop_.statistics().overruns,
                             .skipped = loop_.statistics().skipped}});
}

void RobotCycle::go(RunPhase next) noexcept TANDEM_RT {
  if (controlling_) controllers_->stop();
  controlling_ = false;
  if (phase_ == RunPhase::kRunning) spent_ += time_.cycle - phase_began_;
  phase_ = next;
  phase_began_ = time_.cycle;
}

void RobotCycle::event(EventKind kind, std::int32_t joint, std::uint32_t code) noexcept TANDEM_RT {
  if (recorder_ == nullptr) return;
  recorder_->push(log::Event{time_.cycle, time_.time_ns, code, joint, kind, {}});
}

void RobotCycle::trace_wait(const rt::Tick& tick) noexcept TANDEM_RT {
  if (!trace_.on()) return;
  stamps_ = &trace_.next();
  stamps_->cycle = tick.cycle;
  stamps_->begin_ns = finished_ns_ != 0 ? finished_ns_ : tick.begin_ns;
  stamps_->end_ns.fill(tick.begin_ns);
  stamps_->wakeup_ns = tick.wakeup_ns;
  stamps_->skipped = tick.skipped;
  stamps_->late = tick.late;
}

void RobotCycle::mark(Stage stage) noexcept TANDEM_RT {
  if (stamps_ != nullptr) mark(stage, clock_->now_ns());
}

void RobotCycle::mark(Stage stage, std::int64_t now_ns) noexcept TANDEM_RT {
  if (stamps_ != nullptr) stamps_->end_ns[static_cast<std::size_t>(stage)] = now_ns;
}

}  // namespace tandem::runtime
