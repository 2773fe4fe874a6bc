#include "runtime/robot_cycle.hpp"

#include "rt/scoped_realtime.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::runtime {

using log::EventKind;

// A run's course, one cycle: everything else in this file is one of its stages.

bool RobotCycle::step() noexcept {
  if (phase_ == RunPhase::kDone) return false;
  const rt::Tick tick = wait();
  time_ = {tick.cycle, tick.time_ns, config_.loop.period_ns};
  trace_wait(tick);
  exchange();
  cycle(tick);
  return phase_ != RunPhase::kDone;
}

void RobotCycle::cycle(const rt::Tick& tick) noexcept TANDEM_RT {
  const rt::ScopedRealtime in_cycle;
  read();
  mark(Stage::kRead);
  check(tick);
  mark(Stage::kCheck);
  update(tick);
  mark(Stage::kUpdate);
  limit();
  mark(Stage::kLimit);
  write();
  mark(Stage::kWrite);
  hand_over();
  finished_ns_ = loop_.finish();
  mark(Stage::kHandOver, finished_ns_);
}

/// May block, as the backend's exchange() may and nothing else: for the cycle's time and, when time
/// is simulated, for the log.
rt::Tick RobotCycle::wait() noexcept {
  // Three images, and every event that one cycle can bring.
  const std::size_t most = 3 + 8 + 3 * joint_faulted_.size() + sensor_lost_.size();
  const bool may_wait = config_.loop.pacing == rt::Pacing::kSimulated;
  if (may_wait && recorder_ != nullptr) recorder_->wait_for_space(most);
  return loop_.wait();
}

/// May block until the robot has answered, which does not count as the cycle's work.
void RobotCycle::exchange() noexcept {
  backend_->exchange(time_);
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
  if (tick.stop) fault(FaultSource::kOverrun, -1, 0);
  if (phase_ != RunPhase::kBringUp && phase_ != RunPhase::kShutDown) {
    check_joints();
    check_sensors();
  }
  check_backend(read_code_);
  advance_phase();
}

/// The run's course when nothing goes wrong, and the request to end it.
void RobotCycle::advance_phase() noexcept TANDEM_RT {
  const std::uint64_t in_phase = time_.cycle - phase_began_;
  if (phase_ == RunPhase::kBringUp) {
    if (backend_->phase() == hal::Phase::kOperational) {
      event(EventKind::kBringUpDone);
      go(config_.settle_cycles > 0 ? RunPhase::kSettling : RunPhase::kRunning);
    } else if (in_phase >= config_.bring_up_cycles) {
      fault(FaultSource::kBringUp, -1, 0);
    }
  } else if (phase_ == RunPhase::kSettling) {
    if (in_phase >= config_.settle_cycles) go(RunPhase::kRunning);
  } else if (phase_ != RunPhase::kShutDown && config_.running_cycles != 0 &&
             in_phase >= config_.running_cycles) {
    event(EventKind::kControllersDone);
    go(RunPhase::kShutDown);
  }
  const bool stop = stop_requested_.load(std::memory_order_relaxed) || rt::stop_requested();
  if (stop && phase_ != RunPhase::kShutDown) {
    event(EventKind::kStopRequested);
    go(RunPhase::kShutDown);
  }
}

void RobotCycle::update(const rt::Tick& tick) noexcept TANDEM_RT {
  command_.cycle()[0] = time_.cycle;
  command_.time_ns()[0] = time_.time_ns;
  switch (phase_) {
    case RunPhase::kBringUp:
      controllers_->release(command_);  // every reference follows its joint until it is enabled
      controllers_->hold(state_, command_);
      break;
    case RunPhase::kSettling: controllers_->hold(state_, command_); break;
    case RunPhase::kRunning:
      if (!tick.hold) run_controllers();  // else the last command goes out once more
      break;
    case RunPhase::kHolding:
    case RunPhase::kShutDown:
      if (disable_) {
        controllers_->release(command_);
      } else {
        controllers_->hold(state_, command_);
      }
      break;
    case RunPhase::kDone: break;
  }
}

void RobotCycle::run_controllers() noexcept TANDEM_RT {
  if (ran_ == 0) controllers_->start(time_, state_, command_);
  ++ran_;
  const Code code = controllers_->update(time_, state_, command_);
  if (code == Code::kOk) return;
  if (code == Code::kStopped) {
    if (controllers_->size() == 0) return;  // nobody to be done: hold for the duration
    event(EventKind::kControllersDone);
    go(RunPhase::kShutDown);
    return;
  }
  fault(FaultSource::kController, static_cast<std::int32_t>(controllers_->culprit()),
        static_cast<std::uint32_t>(code));
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
    if (codes[j] == Code::kNotFinite && phase_ == RunPhase::kRunning) {
      fault(FaultSource::kCommand, joint, static_cast<std::uint32_t>(codes[j]));
    }
  }
}

void RobotCycle::write() noexcept TANDEM_RT {
  if (phase_ != RunPhase::kShutDown) {
    check_backend(backend_->write(command_, parameters_));
    return;
  }
  const bool disabled = backend_->shut_down();
  const bool too_long = time_.cycle - phase_began_ >= config_.shut_down_cycles;
  if (!disabled && !too_long && read_code_ != Code::kDiverged) return;
  event(EventKind::kShutDown);
  go(RunPhase::kDone);
}

void RobotCycle::hand_over() noexcept TANDEM_RT {
  if (phase_ == RunPhase::kRunning) statistics_.take(state_, command_, truth_);
  if (recorder_ != nullptr) {
    recorder_->push(state_channel_, time_.time_ns, state_.bytes());
    recorder_->push(command_channel_, time_.time_ns, command_.bytes());
    if (truth_ != nullptr) recorder_->push(truth_channel_, time_.time_ns, truth_->bytes());
    progress_.dropped.store(recorder_->dropped(), std::memory_order_relaxed);
  }
  progress_.phase.store(phase_, std::memory_order_relaxed);
  progress_.cycles.store(loop_.statistics().cycles, std::memory_order_relaxed);
  progress_.running_cycles.store(ran_, std::memory_order_relaxed);
  progress_.overruns.store(loop_.statistics().overruns, std::memory_order_relaxed);
}

/// A missed sample shows as age, a lost command as the board's own time-out, and a drive's fault
/// as its joint's: the joint's stop category decides then. All else ends the run.
void RobotCycle::check_backend(Code code) noexcept TANDEM_RT {
  if (phase_ == RunPhase::kShutDown) return;
  const bool latched = backend_->phase() == hal::Phase::kFault;
  if (latched && code == Code::kOk) code = Code::kFault;
  if (code == Code::kOk || code == Code::kTimeout || code == Code::kQueueFull) return;
  if (code == Code::kFault && joint_fault_) return;
  fault(FaultSource::kBackend, -1, static_cast<std::uint32_t>(code));
}

void RobotCycle::check_joints() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joint_faulted_.size(); ++j) {
    if (joint_faulted_[j] != 0) continue;
    const auto drive = static_cast<hal::DriveState>(state_.drive_state()[j]);
    const bool faulted = drive == hal::DriveState::kFault ||
                         drive == hal::DriveState::kFaultReactionActive || state_.fault()[j] != 0;
    const bool lost = state_.age_cycles()[j] > config_.lost_after_cycles;
    if (!faulted && !lost) continue;
    joint_faulted_[j] = 1;
    joint_fault_ = true;
    const auto joint = static_cast<std::int32_t>(j);
    if (faulted) {
      fault(FaultSource::kDrive, joint, state_.fault()[j]);
    } else {
      fault(FaultSource::kJointLost, joint, state_.age_cycles()[j]);
    }
  }
}

void RobotCycle::check_sensors() noexcept TANDEM_RT {
  const auto ages = state_.sensor_age_cycles();
  for (std::size_t s = 0; s < ages.size(); ++s) {
    const std::uint8_t lost = ages[s] > config_.lost_after_cycles ? 1 : 0;
    if (lost != 0 && sensor_lost_[s] == 0) {
      fault(FaultSource::kSensorLost, static_cast<std::int32_t>(s), ages[s]);
    }
    sensor_lost_[s] = lost;
  }
}

void RobotCycle::fault(FaultSource source, std::int32_t index,
                       std::uint32_t code) noexcept TANDEM_RT {
  const bool of_joint = source == FaultSource::kDrive || source == FaultSource::kJointLost ||
                        source == FaultSource::kCommand;
  const bool of_sensor = source == FaultSource::kSensorLost;
  event(of_sensor ? EventKind::kSensorLost : EventKind::kFault, of_joint ? index : -1, code);
  if (fault_count_ < faults_.size()) {
    faults_[fault_count_++] = {time_.cycle, time_.time_ns, index, code, source, {}};
  }
  if (of_sensor) return;  // told, but the joints can still be controlled
  const bool of_drive = source == FaultSource::kDrive || source == FaultSource::kJointLost;
  react(of_drive ? robot_->joints[static_cast<std::size_t>(index)].on_fault
                 : hal::StopCategory::kCategory1);
}

void RobotCycle::react(hal::StopCategory category) noexcept TANDEM_RT {
  switch (category) {
    case hal::StopCategory::kWarn: return;
    case hal::StopCategory::kHold:
      if (phase_ == RunPhase::kRunning) controllers_->stop();
      if (phase_ == RunPhase::kRunning || phase_ == RunPhase::kSettling) {
        phase_ = RunPhase::kHolding;  // the run's time goes on: phase_began_ stays
      }
      return;
    case hal::StopCategory::kCategory0: disable_ = true; [[fallthrough]];
    case hal::StopCategory::kCategory1:
      if (phase_ != RunPhase::kShutDown) go(RunPhase::kShutDown);
  }
}

void RobotCycle::go(RunPhase next) noexcept TANDEM_RT {
  if (phase_ == RunPhase::kRunning && ran_ > 0) controllers_->stop();
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
