// The cycle, and what each of its stages does.
#include "runtime/robot_cycle.hpp"

#include <algorithm>

#include "hal/sim/fault_injection.hpp"
#include "rt/scoped_realtime.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/events.hpp"
#include "runtime/fault_text.hpp"
#include "runtime/time_machine.hpp"

namespace tandem::runtime {

using hal::FaultCause;
using hal::StopCategory;
using log::EventKind;

namespace {

/// That begin or end in a cycle: every one may do both.
constexpr std::size_t kMostInjected = 2 * sim::FaultInjection::kMostFaults;

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

}  // namespace

RobotCycle::RobotCycle(const CycleParts& parts, const CycleConfig& config)
    : now_(parts, config),
      resets_(now_),
      homing_(now_, resets_),
      arbiter_(now_, resets_, homing_),
      waiting_(now_, arbiter_, homing_),
      response_(now_, resets_, arbiter_, waiting_),
      owner_(now_, arbiter_, response_),
      requests_{now_, resets_, homing_, arbiter_, waiting_, response_, services_},
      services_(parts.robot, parts.controllers, now_.inbox, now_.progress,
                parts.controllers.gains(), now_.log, parts.backend.set_link({})),
      shown_(now_, resets_, homing_, arbiter_, services_),
      trace_(config.trace_cycles),
      limited_(parts.robot.joints.size()),
      limits_met_(parts.robot.joints.size()) {
  if (now_.events != nullptr && now_.events->asks())
    services_.asker().attend_by([this] { attend(); }, false);
}

bool RobotCycle::begin() noexcept {
  if (now_.run.in(RunPhase::kDone)) return false;
  wait();
  exchange();
  {
    const AtWork now(heartbeat_);
    read();
    check();
  }
  return true;
}

bool RobotCycle::finish() noexcept {
  owner_.await();
  if (now_.events != nullptr && !now_.outside.closed) ask_events();
  {
    const AtWork now(heartbeat_);
    take_inbox();
    update();
    limit();
    write();
    now_.controllers.shadows().run(now_.time, now_.state, now_.loop.due_ns());
    hand_over();
  }
  return !now_.run.in(RunPhase::kDone);
}

void RobotCycle::attend() noexcept {
  const AtWork now(heartbeat_);
  const RunPhase before = now_.progress.phase.load();
  requests_.carry_out();
  shown_.show();
  // The controllers start in this cycle, and forget what came before.
  const bool starting = now_.run.in(RunPhase::kRunning) && !arbiter_.controls();
  if (starting) now_.progress.phase.store(before);
}

/// In simulated time, which waits for it. A cycle that asked is played again by nobody.
void RobotCycle::ask_events() noexcept {
  Events& events = *now_.events;
  while (const auto event = events.next_ask(now_.time.time_ns)) {
    now_.outside.came = true;
    services_.asker().here(true);
    const std::string why = events.ask(*event, now_.time.time_ns);
    services_.asker().here(false);
    hal::TextEvent text;
    text.cycle = now_.time.cycle;
    text.time_ns = now_.time.time_ns;
    text.level = why.empty() ? hal::TextLevel::kInfo : hal::TextLevel::kWarn;
    text.set_controller(events.spec(*event).name);
    text.append(why.empty() ? "done: " + events.spec(*event).ask : "refused: " + why);
    now_.log.text(text);
    services_.show(text);
  }
}

/// Where time can go back: to the cycle that somebody wants, if one does.
void RobotCycle::travel() noexcept {
  if (now_.time_machine != nullptr && !now_.outside.closed) now_.time_machine->attend(*this);
}

/// May block, as the backend's exchange() may and nothing else: for the cycle's time and, when time
/// is simulated, for the log, and while it is paused.
void RobotCycle::wait() noexcept {
  do {
    travel();
    show_snapshot();
    await_tick();
  } while (now_.tick.called);
  if (now_.time_machine != nullptr && !now_.outside.closed) {
    if (const auto branch = now_.time_machine->begins(now_.tick.cycle)) now_.log.branch(*branch);
  }
  if (forgotten_) {
    forgotten_->cycle = now_.tick.cycle;
    forgotten_->time_ns = now_.tick.time_ns;
    now_.log.text(*forgotten_);
    forgotten_.reset();
  }
  trace_.begin(now_.tick);
}

void RobotCycle::await_tick() noexcept {
  // Four images, a line about time, a sample of each input, which may be long, every event that one
  // cycle can bring, and what the controllers tell.
  constexpr std::size_t kSlotsOfInput =
      8 * (InputBlock::kMostValues + 2) / log::Recorder::kLateSlotBytes + 1;
  const std::size_t most =
      (now_.events != nullptr ? now_.events->size() : 0) + 5 + 12 +
      (now_.truth != nullptr ? kMostInjected : 4) + Inbox::kCapacity * kMostParameterChanges +
      ControllerHost::kToldParameters + 4 * now_.watch.joints() + now_.watch.sensors() +
      kSlotsOfInput * now_.controllers.inputs() + kMostControllers * (3 + TextEventSlots::kSlots);
  if (now_.config.loop.pacing == rt::Pacing::kSimulated) now_.log.wait_for_space(most);
  now_.tick = now_.loop.wait();
}

/// May block until the robot has answered, which does not count as the cycle's work.
void RobotCycle::exchange() noexcept {
  const auto tell_time = [this] {
    now_.time = {now_.tick.cycle, now_.tick.time_ns, now_.config.loop.period_ns};
  };
  tell_time();
  now_.backend.exchange(now_.time);
  if (const std::uint64_t missed = now_.backend.missed(); missed > 0) {
    now_.loop.skip(now_.tick, missed);
    tell_time();
  }
  if (now_.backend.waits_for_bus()) trace_.mark(CycleStage::kExchange, now_.loop.exchanged());
}

void RobotCycle::read() noexcept TANDEM_RT {
  now_.read_code = now_.backend.read(now_.time, now_.state);
  now_.loop.shift(now_.backend.clock_shift_ns());
  now_.state.cycle()[0] = now_.time.cycle;
  now_.state.time_ns()[0] = now_.time.time_ns;
  if (!started_) now_.event(EventKind::kStarted);
  started_ = true;
  for (std::size_t most = kMostInjected; most > 0; --most) {
    const hal::InjectedFault injected = now_.backend.next_injected();
    if (injected.kind == hal::FaultKind::kNone) break;
    now_.log.event(now_.time, injected);
  }
  trace_.mark(CycleStage::kRead, now_.clock);
}

/// Checks the loop, the joints, the sensors, the body and the backend; then what time brings.
void RobotCycle::check() noexcept TANDEM_RT {
  const RunMachine& run = now_.run;
  const rt::Tick& tick = now_.tick;
  // What came between two cycles, such as another program, is no controller's doing.
  const bool took_too_long = tick.late && took_ns_ >= now_.time.period_ns;
  const auto slow = now_.controllers.begin_cycle(took_too_long ? took_ns_ : 0);
  if (slow.shadow) now_.loop.forgive_late();  // it has ended: it is no fault of the run
  if (tick.skipped > 0) {
    const auto skipped = static_cast<std::uint32_t>(tick.skipped);
    now_.event(EventKind::kOverrun, -1, skipped, slow.controller);
  }
  const bool stops = tick.stop && !slow.shadow;
  if (stops && !run.in(RunPhase::kFaulted) && !run.in(RunPhase::kShutDown)) {
    response_.raise({.cause = FaultCause::kOverrun, .controller = slow.controller});
  }
  if (now_.estimator != nullptr) now_.estimator->update(now_.state);
  if (!run.in(RunPhase::kBringUp) && !run.in(RunPhase::kShutDown)) {
    while (const auto found = now_.watch.next_joint(now_.state)) response_.raise(*found);
    while (const auto found = now_.watch.next_sensor(now_.state)) response_.raise(*found);
  } else if (run.in(RunPhase::kShutDown)) {
    while (const auto found = now_.watch.next_disobedient(now_.state)) response_.raise(*found);
  }
  if (run.controllers_run() && now_.truth != nullptr) {
    if (const auto found = now_.watch.fall(*now_.truth)) response_.raise(*found);
  }
  if (now_.estimator != nullptr && (run.controllers_run() || run.in(RunPhase::kHeld))) {
    // What touches the robot already when an operator's motion begins is no collision of that
    // motion: it may be what the robot is to be led away from.
    const bool moves = run.controllers_run() || now_.controllers.references().leads();
    if (const auto found = FaultWatch::collision(*now_.estimator, moves)) response_.raise(*found);
  }
  response_.check_link();
  response_.check_backend(now_.read_code);
  advance_phase();
  arbiter_.tell_resets(false);
  resets_.watch(arbiter_.command());
  while (const auto ended = homing_.next_ended()) arbiter_.end_homing(*ended);
  if (const auto failed = waiting_.home_at_start()) response_.raise(*failed);
}

/// The phase changes that nobody requests: when the backend is ready, and when time is over.
void RobotCycle::advance_phase() noexcept TANDEM_RT {
  const bool over = now_.run.time_is_over(now_.time.cycle);
  switch (now_.run.phase()) {
    case RunPhase::kBringUp:
      if (now_.backend.phase() == hal::Phase::kOperational) {
        now_.event(EventKind::kBringUpDone);
        waiting_.wait_for_homing();
        arbiter_.on(RunEvent::kEnabled, waiting_.any());
      } else if (over) {
        response_.raise({.cause = FaultCause::kBringUp});
      }
      break;
    case RunPhase::kSettling:
      if (over) arbiter_.on(RunEvent::kSettled);
      break;
    case RunPhase::kResetting:
      if (!response_.watch_reset()) break;
      waiting_.hold_back();
      arbiter_.on(RunEvent::kEnabled, waiting_.any());
      break;
    case RunPhase::kRunning:
    case RunPhase::kFaulted:
    case RunPhase::kHeld:
      if (!over) break;
      if (const auto unhomed = waiting_.unhomed()) {
        response_.raise(*unhomed);
        break;
      }
      now_.event(EventKind::kControllersDone);
      arbiter_.on(RunEvent::kFinished);
      break;
    case RunPhase::kRetreating:  // update() looks after this one,
    case RunPhase::kShutDown:    // and write() after this
    case RunPhase::kDone: break;
  }
}

/// After everything that may change the phase. Stops come first, from wherever they come: a stop
/// wins over all that was asked before it and in its cycle.
void RobotCycle::take_inbox() noexcept TANDEM_RT {
  if (!now_.outside.closed) hear();
  requests_.carry_out_waiting();
  now_.controllers.tell_parameters(now_.time, now_.log);
  trace_.mark(CycleStage::kCheck, now_.clock);
}

void RobotCycle::hear() noexcept TANDEM_RT {
  const hal::RemoteCommand wish = owner_.follow();
  const Inbox::Urgent asked = now_.inbox.take_urgent();
  const StopCategory declared = now_.robot.emergency_stop;
  if (asked.emergency_stop != StopCategory::kWarn) {
    now_.log.given(now_.time, {.values = {static_cast<double>(asked.emergency_stop)},
                               .kind = log::GivenKind::kStop});
    response_.raise({.cause = FaultCause::kByRequest, .category = asked.emergency_stop});
  }
  if (asked.by_watchdog) {
    // Not category 2: who hung cannot be trusted to retreat.
    response_.raise({.index = asked.controller,
                     .cause = FaultCause::kByWatchdog,
                     .category = std::min(declared, StopCategory::kCategory1)});
  }
  if (const auto stop = rt::take_emergency_stop(); stop != rt::EmergencyStop::kNone) {
    now_.outside.came = true;
    response_.raise({.cause = stop == rt::EmergencyStop::kOnRequest ? FaultCause::kByRequest
                                                                    : FaultCause::kBySignal,
                     .category = declared});
  }
  if (wish.reset) response_.begin_reset(wish.reset_cycle);
  if (asked.reset) {
    const double known = asked.known == Inbox::kNow ? -1.0 : static_cast<double>(asked.known);
    now_.log.given(now_.time, {.values = {known}, .kind = log::GivenKind::kReset});
    response_.begin_reset(asked.known);
  }
  const bool end = asked.end || rt::stop_requested();
  if (asked.any()) now_.outside.came = true;
  if (end && !now_.run.in(RunPhase::kShutDown)) {
    now_.event(EventKind::kStopRequested);
    arbiter_.on(RunEvent::kEnd);
  }
  requests_.carry_out();
}

void RobotCycle::update() noexcept TANDEM_RT {
  ends_with_command_ = now_.run.controllers_run();
  const bool watches = now_.run.in(RunPhase::kRunning);
  response_.check_controllers(arbiter_.write(now_.tick.hold));
  const auto stray = watches ? now_.controllers.take_stray() : std::nullopt;
  if (stray) {
    response_.raise({.index = static_cast<std::int32_t>(stray->joint),
                     .code = stray->controller,
                     .cause = FaultCause::kStray,
                     .category = now_.config.on_stray,
                     .controller = static_cast<std::int32_t>(stray->controller)});
    if (now_.config.on_stray == hal::StopCategory::kWarn) {  // it is taken back: nothing stays
      now_.faults.clear_latched(now_.time.time_ns, [](const FaultRecord& record) {
        return record.cause == FaultCause::kStray;
      });
    }
  }
  trace_.mark(CycleStage::kUpdate, now_.clock);
}

void RobotCycle::limit() noexcept TANDEM_RT {
  const Code limited = now_.limits.apply(now_.state, arbiter_.to_limit());
  note_limits();
  const auto codes = now_.limits.codes();
  for (std::size_t j = 0; limited != Code::kOk && j < codes.size(); ++j) {
    if (codes[j] == Code::kNotFinite && now_.run.controllers_run()) {
      response_.raise({.index = static_cast<std::int32_t>(j),
                       .code = static_cast<std::uint32_t>(codes[j]),
                       .cause = FaultCause::kCommand,
                       .controller = now_.controllers.owner_id(j),
                       .met = now_.limits.met()[j]});
    }
  }
  trace_.mark(CycleStage::kLimit, now_.clock);
}

/// Each joint's first command that a limit changed, whichever limit, and its first one that was a
/// controller's.
void RobotCycle::note_limits() noexcept TANDEM_RT {
  const auto counters = now_.limits.counters();
  for (std::size_t j = 0; j < counters.size(); ++j) {
    const hal::LimitCounters& now = counters[j];
    const std::uint64_t met = std::uint64_t{now.not_finite} + now.out_of_range + now.too_fast;
    if (std::exchange(limits_met_[j], met) == met) continue;
    const std::int32_t owner = now_.controllers.owner_id(j);
    const std::int32_t before = limited_[j].controller;
    if (before >= 0 || (before != kNever && owner < 0)) continue;
    limited_[j] = {.met = now_.limits.met()[j], .controller = owner};
    now_.event(EventKind::kLimited, static_cast<std::int32_t>(j),
               static_cast<std::uint32_t>(now_.limits.codes()[j]), owner, limited_[j].met);
    shown_.tell({.cycle = now_.time.cycle,
                 .time_ns = now_.time.time_ns,
                 .met = limited_[j].met,
                 .joint = static_cast<std::int32_t>(j),
                 .controller = owner});
  }
}

void RobotCycle::write() noexcept TANDEM_RT {
  if (!now_.run.in(RunPhase::kShutDown)) {
    arbiter_.tell_resets(true);
    response_.check_backend(now_.backend.write(arbiter_.command(), now_.controllers.gains()));
  } else {
    if (ends_with_command_) now_.backend.last_command(arbiter_.command());
    const bool disabled = now_.backend.shut_down();
    const bool over = now_.run.time_is_over(now_.time.cycle);
    if (disabled || over || now_.read_code == Code::kDiverged) {
      while (const auto found = now_.watch.next_disobedient(now_.state)) response_.raise(*found);
      now_.event(EventKind::kShutDown);
      arbiter_.on(RunEvent::kDisabled);
    }
  }
  trace_.mark(CycleStage::kWrite, now_.clock);
}

/// To the log, the threads that watch the run, and those that wait for an answer.
void RobotCycle::hand_over() noexcept TANDEM_RT {
  shown_.take();
  if (now_.events != nullptr) now_.events->take(shown_.view());
  if (!now_.outside.closed) {
    now_.inbox.confirm(now_.time.cycle);
    if (now_.run.in(RunPhase::kDone)) now_.inbox.close();
  }
  const std::int64_t now_ns = now_.loop.finish();
  now_.controllers.shadows().note_end_of_cycle(now_ns);
  took_ns_ = now_ns - now_.tick.begin_ns + std::max<std::int64_t>(now_.tick.wakeup_ns, 0);
  trace_.note(now_.controllers.calls());
  trace_.end(now_ns);
}

}  // namespace tandem::runtime
