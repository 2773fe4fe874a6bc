// A run's whole state as bytes, and cycles that are played once more from them.
#include "base/counted.hpp"
#include "rt/scoped_realtime.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/events.hpp"
#include "runtime/fault_text.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

using hal::FaultCause;

namespace {

/// "joint.move of joint1", "controller.set squat.kp": what was asked for.
std::string words_of(const CycleRequest& request, const hal::RobotConfig& robot) {
  using enum CycleRequest::Kind;
  std::string words(asked_as(request.kind));
  if (request.kind >= kJoint && request.kind <= kHome)
    words += " of " + robot.joints[request.joint].name;
  if (request.kind == kSet && !request.changes->empty())
    words += " " + request.changes->front().name;
  return words;
}

}  // namespace

void RobotCycle::archive(Archive& ar) {
  std::uint64_t controllers = now_.controllers.fingerprint();
  // First: restore() looks at them before anything changes.
  ar(now_.identity, controllers, kept_elsewhere_);
  ar(now_, resets_, homing_, arbiter_, waiting_, response_);
  ar(now_.controllers, shown_, started_, limited_, limits_met_);
  if (now_.events != nullptr && !now_.events->apart()) ar(*now_.events);
}

Status RobotCycle::write_down(Archive& ar, bool backend) {
  kept_elsewhere_ = {};
  if (backend) {
    auto kept = now_.backend.keep();
    if (!kept) return std::unexpected(std::move(kept.error()));
    kept_elsewhere_ = *kept;
  }
  archive(ar);
  if (!backend || now_.backend.archive(ar)) return {};
  return fail("this robot cannot be saved", "snapshots need a simulated robot");
}

/// Where a robot's cycle is not simulated, under the traps: this takes no heap.
void RobotCycle::show_snapshot() noexcept {
  SnapshotPort* const port = now_.snapshots;
  if (port == nullptr || !port->wanted()) return;
  const std::int64_t begin_ns = now_.clock.now_ns();
  if (port->whole()) {
    (void)write_down(port->archive(), true);
  } else {
    const rt::ScopedRealtime now;
    (void)write_down(port->archive(), false);
  }
  port->taken(now_.loop.next_cycle(), now_.clock.now_ns() - begin_ns);
}

void RobotCycle::replay(bool on) noexcept {
  now_.outside.closed = on;
  now_.loop.replay(on);
  now_.log.mute(on);
  shown_.mute(on);
  trace_.mute(on);
}

void RobotCycle::show_again() noexcept {
  Progress& progress = now_.progress;
  // A stop of a future that does not come is none that anybody knows.
  const std::uint64_t next = now_.loop.next_cycle();
  if (progress.stopped_before.load() > next) progress.stopped_before.store(next);
  shown_.show();
  progress.went_to_ns.store(now_.time.time_ns, std::memory_order_relaxed);
  progress.travels.fetch_add(1, std::memory_order_release);
  if (now_.observer != nullptr) (void)shown_.show_to(*now_.observer);
}

void RobotCycle::forget_waiting() {
  services_.forget_after(now_.time.time_ns);
  shown_.forget_after(now_.time.time_ns);
  std::size_t requests = 0;
  std::string asked;
  for (; const auto request = now_.inbox.take_request(); ++requests) {
    asked += (asked.empty() ? "" : ", ") + words_of(*request, now_.robot);
    now_.inbox.answer(
        {.number = request->number, .cycle = now_.time.cycle, .reason = RejectReason::kTimeWent});
  }
  const std::size_t samples = now_.controllers.forget_waiting();
  const std::size_t faults = now_.backend.forget_waiting();
  std::string what;
  for (const auto& [count, one] :
       {std::pair{requests, "request"}, {samples, "sample of an input"}, {faults, "fault"}}) {
    if (count > 0) what += (what.empty() ? "" : ", ") + counted(count, one);
    if (!asked.empty()) what += " (" + std::exchange(asked, {}) + ")";
  }
  if (what.empty()) return;
  hal::TextEvent text{.cycle = now_.time.cycle, .time_ns = now_.time.time_ns};
  text.level = hal::TextLevel::kWarn;
  text.set_controller("time");
  text.append("went elsewhere: dropped what waited for the next cycle: " + what);
  services_.show(text);
  forgotten_ = text;
}

bool RobotCycle::is_urgent() const noexcept {
  return now_.inbox.is_urgent() || rt::stop_requested() || rt::emergency_stop_waits();
}

Events* RobotCycle::events_apart() noexcept {
  return now_.events != nullptr && now_.events->apart() ? now_.events : nullptr;
}

std::string RobotCycle::unarchived() const {
  for (const HostedController* one : now_.controllers.loaded()) {
    if (one != nullptr && one->lacks_archive) return one->name;
  }
  return {};
}

Result<std::vector<std::byte>> RobotCycle::save() {
  Archive ar;
  if (Status written = write_down(ar, true); !written) return std::unexpected(written.error());
  return std::vector<std::byte>(ar.bytes().begin(), ar.bytes().end());
}

Status RobotCycle::restore(std::span<const std::byte> snapshot) {
  Archive ar(snapshot);
  RunIdentity identity;
  std::uint64_t controllers = 0;
  hal::KeptElsewhere elsewhere;
  Archive first(snapshot);
  first(identity, controllers, elsewhere);
  if (const std::string other = now_.identity.difference(identity); !other.empty()) {
    return fail("the snapshot is of another run: '" + other + "' is not the same",
                "restore it where robot, experiment, kernels, options and seed are those that it "
                "was saved with");
  }
  if (controllers != now_.controllers.fingerprint()) {
    return fail("the snapshot was taken with other controllers than are loaded now",
                "load and unload, in the same order, what was loaded then");
  }
  if (elsewhere.number != 0) {
    if (Status there = now_.backend.go_back(elsewhere); !there) return there;
  }
  archive(ar);
  if (!now_.backend.archive(ar)) {
    return fail("this robot cannot be rewound", "snapshots need a simulated robot");
  }
  if (ar.ok() && ar.at_end()) return {};
  return fail("the snapshot is of another robot or experiment",
              "restore it with the configuration that it was saved with");
}

// Results.

bool RobotCycle::show_last_cycle(hal::CycleObserver& observer) const {
  bool shown = false;
  now_.inbox.clock().while_standing([&] { shown = shown_.show_to(observer); });
  return shown;
}

std::vector<FaultReport> RobotCycle::faults() const {
  const FaultContext about{now_.robot, now_.backend, now_.controllers, now_.config};
  const FaultLog& log = now_.faults;
  std::vector<FaultReport> out;
  for (std::size_t i = 0; i < log.size(); ++i)
    out.push_back(in_words(log[i], log.cleared_ns(i), about));
  // The backend's own words are the loop's until the loop has stopped.
  if (now_.progress.phase.load() != RunPhase::kDone) return out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::string status = out[i].latched ? now_.backend.status_text() : std::string();
    if (status.empty()) continue;
    if (log[i].cause == FaultCause::kBackend) out[i].text = status;
    if (log[i].cause == FaultCause::kBringUp) out[i].text += ": " + status;
  }
  return out;
}

std::vector<RobotCycle::LimitReport> RobotCycle::limits_met(std::uint64_t& seen) const {
  std::vector<LimitReport> reports;
  if (shown_.limits().count() == seen) return reports;
  std::vector<LimitNote> notes;
  (void)shown_.limits().read(seen, notes);
  for (const LimitNote& one : notes) {
    std::string text = hal::in_words(one.met);
    if (one.controller >= 0) {
      const auto controller = static_cast<std::size_t>(one.controller);
      text += ", by '" + now_.controllers.name(controller) + "'";
    }
    reports.push_back({.time_s = 1e-9 * static_cast<double>(one.time_ns),
                       .cycle = one.cycle,
                       .joint = now_.robot.joints[static_cast<std::size_t>(one.joint)].name,
                       .text = std::move(text)});
  }
  return reports;
}

std::string RobotCycle::drive_fault(std::size_t joint, std::uint32_t code) const {
  if (code == 0) return {};
  const FaultLog& log = now_.faults;
  FaultCause cause = FaultCause::kDrive;
  for (std::size_t i = 0; i < log.size(); ++i) {
    const bool its = hal::is_of_drive(log[i].cause) && log[i].cause != FaultCause::kJointLost &&
                     log[i].index == static_cast<std::int32_t>(joint);
    if (its && log.cleared_ns(i) == FaultLog::kLatched) cause = log[i].cause;
  }
  return now_.backend.fault_text(cause, code);
}

}  // namespace tandem::runtime
