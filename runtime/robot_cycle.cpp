// The cycle, and what each of its stages does.
#include "runtime/robot_cycle.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rt/scoped_realtime.hpp"

namespace tandem::runtime {

using hal::StopCategory;
using log::EventKind;

namespace {

/// While one exists the cycle may not block: the real-time traps are armed, and the watchdog counts
/// the loop as working.
class AtWork {
 public:
  explicit AtWork(Heartbeat& heartbeat) noexcept : heartbeat_(&heartbeat) { heartbeat_->enter(); }
  ~AtWork() { heartbeat_->leave(); }
  AtWork(const AtWork&) = delete;
  AtWork& operator=(const AtWork&) = delete;

 private:
  rt::ScopedRealtime realtime_;
  Heartbeat* heartbeat_;
};

bool follows_position(std::int8_t mode) noexcept TANDEM_RT {
  return mode == static_cast<std::int8_t>(hal::ControlMode::kPosition);
}

}  // namespace

bool RobotCycle::step() noexcept {
  if (run_.in(RunPhase::kDone)) return false;
  rt::Tick tick = wait();
  exchange(tick);
  {
    const AtWork now(heartbeat_);
    read();
    check(tick);
  }
  await_owner();
  {
    const AtWork now(heartbeat_);
    take_inbox();
    update(tick);
    limit();
    write();
    hand_over();
  }
  return !run_.in(RunPhase::kDone);
}

/// May block, as the backend's exchange() may and nothing else: for the cycle's time and, when time
/// is simulated, for the log, and while it is paused.
rt::Tick RobotCycle::wait() noexcept {
  show_snapshot();
  // Four images, and every event that one cycle can bring.
  const std::size_t most = 4 + 16 + Inbox::kCapacity + 3 * watch_.joints() + watch_.sensors();
  if (config_.loop.pacing == rt::Pacing::kSimulated) log_.wait_for_space(most);
  const rt::Tick tick = loop_.wait();
  time_ = {tick.cycle, tick.time_ns, config_.loop.period_ns};
  begin_ns_ = tick.begin_ns;
  wakeup_ns_ = tick.wakeup_ns;
  trace_.begin(tick);
  return tick;
}

/// May block until the robot has answered, which does not count as the cycle's work.
void RobotCycle::exchange(rt::Tick& tick) noexcept {
  backend_->exchange(time_);
  if (const std::uint64_t missed = backend_->missed(); missed > 0) {
    loop_.skip(tick, missed);
    time_ = {tick.cycle, tick.time_ns, config_.loop.period_ns};
  }
  if (backend_->waits_for_bus()) trace_.mark(CycleStage::kExchange, loop_.exchanged());
}

void RobotCycle::read() noexcept TANDEM_RT {
  read_code_ = backend_->read(time_, state_);
  loop_.shift(backend_->clock_shift_ns());
  state_.cycle()[0] = time_.cycle;
  state_.time_ns()[0] = time_.time_ns;
  if (!started_) event(EventKind::kStarted);
  started_ = true;
  for (int most = 4; most > 0; --most) {  // of a cycle, for there is only so much room in the log
    const hal::InjectedFault injected = backend_->next_injected();
    if (injected.kind == hal::FaultKind::kNone) break;
    log_.event(time_, injected);
  }
  trace_.mark(CycleStage::kRead, *clock_);
}

/// Checks the loop, the joints, the sensors, the body and the backend; then what time brings.
void RobotCycle::check(const rt::Tick& tick) noexcept TANDEM_RT {
  if (tick.skipped > 0) event(EventKind::kOverrun, -1, static_cast<std::uint32_t>(tick.skipped));
  if (tick.stop && !run_.in(RunPhase::kFaulted) && !run_.in(RunPhase::kShutDown)) {
    fault({.source = FaultSource::kOverrun, .category = StopCategory::kCategory1});
  }
  if (estimator_ != nullptr) estimator_->update(state_);
  if (!run_.in(RunPhase::kBringUp) && !run_.in(RunPhase::kShutDown)) {
    while (const auto found = watch_.next_joint(state_)) fault(*found);
    while (const auto found = watch_.next_sensor(state_)) fault(*found);
  } else if (run_.in(RunPhase::kShutDown)) {
    while (const auto found = watch_.next_disobedient(state_)) fault(*found);
  }
  if (run_.controllers_run() && truth_ != nullptr) {
    if (const auto found = watch_.fall(*truth_)) fault(*found);
  }
  check_collisions();
  check_link();
  check_backend(read_code_);
  advance_phase();
  watch_drive_resets();
  watch_homing();
}

/// While something moves: a robot that lies, or that somebody holds, feels more than itself. What
/// touches it already when an operator's motion begins is no collision of that motion: it may be
/// what the robot is to be led away from.
void RobotCycle::check_collisions() noexcept TANDEM_RT {
  const bool held = run_.in(RunPhase::kHeld);
  if (estimator_ == nullptr || !(run_.controllers_run() || held)) return;
  const auto found = estimator_->collision();
  if (!found || (held && !controllers_->leads())) return;
  const double thousandths = std::clamp(1e3 * std::abs(found->torque_Nm), 0.0, 4e9);
  const auto joints = static_cast<std::int32_t>(estimator_->image().joints());
  const auto channel = static_cast<std::int32_t>(found->joint);
  fault({.index = channel < joints ? channel : joints - 1 - channel,
         .code = static_cast<std::uint32_t>(thousandths),
         .source = FaultSource::kCollision,
         .category = estimator_->reaction()});
}

const hal::EstimateImage* RobotCycle::estimate() const noexcept TANDEM_RT {
  return estimator_ == nullptr ? nullptr : &estimator_->image();
}

/// A missed sample shows as age, a lost command as the board's own time-out, and a drive's fault
/// as its joint's: the joint's stop category decides then. All else stops the robot.
void RobotCycle::check_backend(Code code) noexcept TANDEM_RT {
  if (run_.in(RunPhase::kShutDown)) return;
  if (code == Code::kDiverged) {
    fault({.code = static_cast<std::uint32_t>(code),
           .source = FaultSource::kBackend,
           .category = StopCategory::kCategory1});
    return on(RunEvent::kEnd);  // there is nothing left to wait for
  }
  if (run_.in(RunPhase::kFaulted) || run_.in(RunPhase::kResetting)) return;
  if (backend_->phase() == hal::Phase::kFault && code == Code::kOk) code = Code::kFault;
  if (code == Code::kOk || code == Code::kTimeout || code == Code::kQueueFull) return;
  if (code == Code::kFault && watch_.joint_in_fault()) return;
  fault({.code = static_cast<std::uint32_t>(code),
         .source = FaultSource::kBackend,
         .category = StopCategory::kCategory1});
}

/// The phase changes that nobody requests: when the backend is ready, and when time is over.
void RobotCycle::advance_phase() noexcept TANDEM_RT {
  const bool over = run_.time_is_over(time_.cycle);
  switch (run_.phase()) {
    case RunPhase::kBringUp:
      if (backend_->phase() == hal::Phase::kOperational) {
        event(EventKind::kBringUpDone);
        wait_for_homing();
        on(RunEvent::kEnabled, held_back_ != 0);
      } else if (over) {
        fault({.source = FaultSource::kBringUp, .category = StopCategory::kCategory1});
      }
      break;
    case RunPhase::kSettling:
      if (over) on(RunEvent::kSettled);
      break;
    case RunPhase::kResetting: watch_reset(); break;
    case RunPhase::kRunning:
    case RunPhase::kFaulted:
    case RunPhase::kHeld:
      if (!over) break;
      if (ends_unhomed()) break;
      event(EventKind::kControllersDone);
      on(RunEvent::kFinished);
      break;
    case RunPhase::kRetreating:  // update() looks after this one,
    case RunPhase::kShutDown:    // and write() after this
    case RunPhase::kDone: break;
  }
}

void RobotCycle::update(const rt::Tick& tick) noexcept TANDEM_RT {
  std::ranges::fill(written_, std::uint8_t{0});
  ends_with_command_ = run_.controllers_run();
  stamp(command_);
  stamp(wanted_);
  if (std::exchange(brakes_, false)) controllers_->brake(state_, command_);
  switch (run_.phase()) {
    case RunPhase::kBringUp:
    case RunPhase::kResetting:
      controllers_->release(command_);  // every reference follows its joint until it is enabled
      controllers_->hold(state_, command_);
      (void)go_on_from_robot();
      break;
    case RunPhase::kSettling:
    case RunPhase::kHeld:
      controllers_->hold(state_, command_);
      hold_drives_in_reset(command_);
      hold_unhomed(command_);
      break;
    case RunPhase::kRunning:
      // Else the last command goes out once more.
      if (!tick.hold || controllers_->changes_hands()) run_controllers();
      break;
    case RunPhase::kRetreating: retreat_further(); break;
    case RunPhase::kFaulted:
    case RunPhase::kShutDown:
      if (run_.latched() == StopCategory::kCategory0) {
        controllers_->release(command_);
      } else {
        controllers_->hold(state_, command_);
      }
      break;
    case RunPhase::kDone: break;
  }
  trace_.mark(CycleStage::kUpdate, *clock_);
}

void RobotCycle::run_controllers() noexcept TANDEM_RT {
  if (!controlling_) {
    start_controllers();
    take_from_owner();
    watch_.controllers_start();
  }
  controlling_ = true;
  ++ran_;
  offer_measured(controlled());
  const Code code = controllers_->update(time_, state_, controlled());
  note_written(controlled());
  controllers_->lead_back(controlled());
  hold_drives_in_reset(controlled());
  hold_unhomed(controlled());
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
    return on(RunEvent::kFinished);
  }
  fault({.index = static_cast<std::int32_t>(controllers_->failed_controller()),
         .code = static_cast<std::uint32_t>(code),
         .source = FaultSource::kController,
         .category = StopCategory::kCategory1});
}

/// The position reference of a joint outside position control is where it is, unless a controller
/// writes another one in this cycle: what it wants the joint to follow by other means.
void RobotCycle::offer_measured(hal::CommandImage& command) noexcept TANDEM_RT {
  const auto measured = state_.position_rad();
  const auto mode = command.mode();
  for (std::size_t j = 0; j < written_.size(); ++j) {
    const bool offers = !follows_position(mode[j]) && std::isfinite(measured[j]);
    written_[j] = offers ? 1 : 0;
    if (offers) command.position_rad()[j] = measured[j];
  }
}

void RobotCycle::note_written(const hal::CommandImage& command) noexcept TANDEM_RT {
  const auto measured = std::as_const(state_).position_rad(), reference = command.position_rad();
  const auto mode = command.mode();
  for (std::size_t j = 0; j < written_.size(); ++j) {
    if (follows_position(mode[j]) || reference[j] == measured[j]) written_[j] = 0;
  }
}

/// The command as log and statistics have it: what was sent, but for references that no drive
/// follows.
const hal::CommandImage& RobotCycle::told() noexcept TANDEM_RT {
  if (std::ranges::none_of(written_, [](std::uint8_t one) { return one != 0; })) return command_;
  told_.assign(command_);
  for (std::size_t j = 0; j < written_.size(); ++j) {
    if (written_[j] != 0) told_.position_rad()[j] = written_rad_[j];
  }
  return told_;
}

/// Until they have brought the robot to its posture, or their time is over.
void RobotCycle::retreat_further() noexcept TANDEM_RT {
  offer_measured(controlled());
  const Code code = controllers_->update(time_, state_, controlled());
  note_written(controlled());
  if (delay_.on()) delay_.pass(wanted_, command_);
  if (code != Code::kOk && code != Code::kStopped) return controllers_answered(code);
  const bool late = run_.time_is_over(time_.cycle);
  if (late || code == Code::kStopped) react(StopCategory::kCategory1);
}

/// The image that controllers write.
hal::CommandImage& RobotCycle::controlled() noexcept TANDEM_RT {
  return delay_.on() ? wanted_ : command_;
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
  const auto asked = std::as_const(command_).position_rad();
  for (std::size_t j = 0; j < written_.size(); ++j) {
    const bool tells =
        written_[j] != 0 && std::isfinite(asked[j]) && !follows_position(command_.mode()[j]);
    written_[j] = tells ? 1 : 0;
    written_rad_[j] = asked[j];
  }
  const Code limited = limits_.apply(state_, command_);
  const auto codes = limits_.codes();
  for (std::size_t j = 0; limited != Code::kOk && j < codes.size(); ++j) {
    if (codes[j] == Code::kOk) continue;
    const auto joint = static_cast<std::int32_t>(j);
    if (joint_limited_[j] == 0) {
      event(EventKind::kLimited, joint, static_cast<std::uint32_t>(codes[j]));
      joint_limited_[j] = 1;
    }
    if (codes[j] == Code::kNotFinite && run_.controllers_run()) {
      fault({.index = joint,
             .code = static_cast<std::uint32_t>(codes[j]),
             .source = FaultSource::kCommand,
             .category = StopCategory::kCategory1});
    }
  }
  trace_.mark(CycleStage::kLimit, *clock_);
}

void RobotCycle::write() noexcept TANDEM_RT {
  if (!run_.in(RunPhase::kShutDown)) {
    for (std::size_t j = 0; j < resets_.size(); ++j) {  // told once: the cause may stay
      if (resets_[j] == reset_cycles_) command_.fault_reset()[j] = 1;
    }
    check_backend(backend_->write(command_, controllers_->gains()));
  } else {
    if (ends_with_command_) backend_->last_command(command_);
    const bool disabled = backend_->shut_down();
    if (disabled || run_.time_is_over(time_.cycle) || read_code_ == Code::kDiverged) {
      while (const auto found = watch_.next_disobedient(state_)) fault(*found);
      event(EventKind::kShutDown);
      on(RunEvent::kDisabled);
    }
  }
  trace_.mark(CycleStage::kWrite, *clock_);
}

/// To the log, the threads that watch the run, and those that wait for an answer.
void RobotCycle::hand_over() noexcept TANDEM_RT {
  const hal::CommandImage& command = told();
  if (run_.in(RunPhase::kRunning)) {
    statistics_.take(state_, command, truth_, limits_.counters(), estimate());
  }
  if (!ends(run_.phase())) statistics_.take_base(truth_);
  log_.images(time_, state_, command, truth_, estimate());
  progress_.dropped.store(log_.dropped(), std::memory_order_relaxed);
  progress_.phase.store(run_.phase(), std::memory_order_relaxed);
  progress_.cycles.store(loop_.statistics().cycles, std::memory_order_relaxed);
  progress_.time_ns.store(time_.time_ns, std::memory_order_relaxed);
  progress_.running_cycles.store(ran_, std::memory_order_relaxed);
  progress_.latched.store(faults_.latched(), std::memory_order_relaxed);
  progress_.overruns.store(loop_.statistics().overruns, std::memory_order_relaxed);
  show_joints();
  show_sensors();
  show();
  inbox_.confirm(time_.cycle);
  trace_.end(loop_.finish());
}

void RobotCycle::show() noexcept TANDEM_RT {
  if (observer_ == nullptr) return;
  observer_->take({.time = time_,
                   .phase = run_.phase(),
                   .read_code = read_code_,
                   .state = state_,
                   .command = told(),
                   .truth = truth_,
                   .estimate = estimate(),
                   .times = {.begin_ns = begin_ns_,
                             .wakeup_ns = wakeup_ns_,
                             .bus_ns = loop_.last_bus_ns(),
                             .work_ns = loop_.last_work_ns(),
                             .overruns = loop_.statistics().overruns,
                             .skipped = loop_.statistics().skipped}});
}

/// What is asked of a joint is what its owner wants, before a delay and a transfer.
void RobotCycle::show_joints() noexcept TANDEM_RT {
  const hal::CommandImage& wanted = controlling_ ? controlled() : command_;
  const hal::StateImage& state = state_;
  const auto position = state.position_rad(), velocity = state.velocity_rad_s();
  const auto torque = state.torque_Nm(), acceleration = state.acceleration_rad_s2();
  const auto motor_position = state.motor_position_rad();
  const auto motor_velocity = state.motor_velocity_rad_s();
  const auto current = state.current_A(), voltage = state.voltage_V();
  const auto temperature = state.temperature_C();
  const auto commanded = std::as_const(command_).position_rad();
  const auto fault = state.fault(), age = state.age_cycles();
  const auto drive_mode = state.mode();
  const auto drive_state = state.drive_state();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto impedance = controllers_->wanted_impedance(j, wanted);
    JointStatus& joint = joints_[j];  // all of it, but field by field: g++ clears a whole one first
    joint.cycle = time_.cycle;
    joint.position_rad = position[j];
    joint.velocity_rad_s = velocity[j];
    joint.torque_Nm = torque[j];
    joint.acceleration_rad_s2 = acceleration[j];
    joint.motor_position_rad = motor_position[j];
    joint.motor_velocity_rad_s = motor_velocity[j];
    joint.current_A = current[j];
    joint.voltage_V = voltage[j];
    joint.temperature_C = temperature[j];
    joint.commanded_rad = commanded[j];
    joint.stiffness_Nm_rad = impedance.stiffness_Nm_rad;
    joint.damping_Nms_rad = impedance.damping_Nms_rad;
    joint.fault = fault[j];
    joint.age_cycles = age[j];
    joint.owner = controllers_->owner(j);
    joint.mode = wanted.mode()[j];
    joint.interaction = wanted.interaction()[j];
    joint.drive_mode = drive_mode[j];
    joint.drive_state = drive_state[j];
    joint.moving = controllers_->leads(j) ? std::uint8_t{1} : std::uint8_t{0};
    joint.resetting = resets_[j] != 0 ? std::uint8_t{1} : std::uint8_t{0};
    joint.homing = homings_[j];
  }
  services_.show(joints_);
  if (controllers_->gains().revision() != shown_gains_) show_gains();
}

void RobotCycle::show_gains() noexcept TANDEM_RT {
  services_.show(controllers_->gains());
  shown_gains_ = controllers_->gains().revision();
}

void RobotCycle::show_sensors() noexcept TANDEM_RT {
  for (std::size_t s = 0; s < sensors_.size(); ++s) {
    SensorStatus& sensor = sensors_[s];
    sensor.cycle = time_.cycle;
    sensor.age_cycles = state_.sensor_age_cycles()[s];
    // One that was never heard is older than the run.
    sensor.valid =
        sensor.age_cycles <= std::min<std::uint64_t>(config_.lost_after_cycles, time_.cycle);
    std::ranges::copy(state_.sensor_values(s), sensor.values.begin());
  }
  services_.show(sensors_);
}

/// The next phase, if this is one. Controllers stop with it, but for a retreat, which they carry
/// out. Joints that a stop finds in motion brake.
void RobotCycle::on(RunEvent event, bool holds_back) noexcept TANDEM_RT {
  if (!run_.on(event, time_.cycle, holds_back) || run_.in(RunPhase::kRetreating)) return;
  if (controlling_) controllers_->stop();
  if (controlling_ && delay_.on()) controllers_->was_sent_before(delay_.before());
  controlling_ = false;
  brakes_ = run_.in(RunPhase::kFaulted) || run_.in(RunPhase::kShutDown);
}

void RobotCycle::event(EventKind kind, std::int32_t joint, std::uint32_t code) noexcept TANDEM_RT {
  log_.event(time_, kind, joint, code);
}

}  // namespace tandem::runtime
