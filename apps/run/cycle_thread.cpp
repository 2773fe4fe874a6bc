#include "apps/run/cycle_thread.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "apps/can/bus_watch.hpp"
#include "apps/control/clock_commands.hpp"
#include "apps/run/loop_crash.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;

std::string progress_note(const runtime::RobotCycle& cycle) {
  if (time_stands(cycle)) return "paused";
  const runtime::RunPhase phase = cycle.progress().phase.load();
  return phase == runtime::RunPhase::kRunning ? "" : runtime::to_string(phase);
}

/// For who looks at the service: the phase, and what a person may do about it.
std::string service_status(const runtime::RobotCycle& cycle) {
  if (time_stands(cycle)) return "simulated time is paused: tandem clock resume";
  const runtime::RunPhase phase = cycle.progress().phase.load();
  const std::string name = runtime::to_string(phase);
  if (phase == runtime::RunPhase::kHeld) return name + ": tandem controller start";
  if (phase == runtime::RunPhase::kFaulted) return name + ": tandem fault show, tandem fault reset";
  return name;
}

/// Says once why a run that was just enabled does not start, and at once which homing failed.
class HomingNote {
 public:
  void look(runtime::RobotCycle& cycle, const hal::RobotConfig& robot) {
    look_for_failures(cycle, robot);
    if (told_ || cycle.progress().phase.load() != runtime::RunPhase::kHeld) return;
    told_ = true;
    if (cycle.progress().resets.load() > 0) return;
    std::string names;
    for (const hal::JointConfig& joint : robot.joints) {
      if (!joint.homing || !joint.homing->required || joint.homing->at_start) continue;
      names += (names.empty() ? "" : ", ") + joint.name;
    }
    if (names.empty()) return;
    restart_line(stderr);
    fmt::print(stderr,
               "held until these are homed: {} (tandem joint home NAME; then tandem controller "
               "start)\n",
               names);
  }

 private:
  void look_for_failures(runtime::RobotCycle& cycle, const hal::RobotConfig& robot) {
    if (std::ranges::none_of(robot.joints, [](const auto& one) { return one.homing.has_value(); }))
      return;
    failures_.resize(robot.joints.size());
    const auto joints = cycle.services().joints();
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const hal::FaultCause error = joints[j].look.homing.error;
      if (std::exchange(failures_[j], error) == error || error == hal::FaultCause::kNone) continue;
      restart_line(stderr);
      fmt::print(stderr,
                 "{}: the homing (method {}) failed: {}; {}; tandem joint home {} tries again\n",
                 joints[j].name, robot.joints[j].homing ? robot.joints[j].homing->method : 0,
                 hal::row_of(error).words, hal::row_of(error).advice, joints[j].name);
    }
  }

  bool told_ = false;
  std::vector<hal::FaultCause> failures_;  // by joint: of its last homing
};

/// Prints each warning when it happens; in a run that waits for its reset each fault, too.
class FaultNotes {
 public:
  explicit FaultNotes(bool waits) : waits_(waits) {}
  void look(const runtime::RobotCycle& cycle) {
    look_back(cycle);
    if (cycle.fault_log().size() <= told_) return;
    const std::vector<runtime::FaultReport> faults = cycle.faults();
    restart_line(stderr);
    bool stopped = false;
    for (; told_ < faults.size(); ++told_) {
      const runtime::FaultReport& fault = faults[told_];
      const bool warns = fault.category == hal::StopCategory::kWarn;
      if (!warns && !waits_) continue;
      stopped = stopped || !warns;
      fmt::print(stderr, "{}: {:.3f} s: {}{}{}\n", warns ? "warning" : "fault", fault.time_s,
                 fault.joint, fault.joint.empty() ? "" : ": ", shown(fault.text, 2'000));
    }
    if (stopped) {
      fmt::print(stderr, "the run is stopped, and waits: tandem fault show, tandem fault reset\n");
    }
  }

 private:
  /// Where time went to another moment, faults are those of that moment.
  void look_back(const runtime::RobotCycle& cycle) {
    const runtime::Progress& progress = cycle.progress();
    const std::uint64_t travels = progress.travels.load(std::memory_order_acquire);
    if (std::exchange(travels_, travels) == travels) return;
    const double now_s = 1e-9 * static_cast<double>(progress.went_to_ns.load());
    const std::vector<runtime::FaultReport> faults = cycle.faults();
    const auto before = static_cast<std::size_t>(
        std::ranges::count_if(faults, [&](const auto& one) { return one.time_s <= now_s; }));
    restart_line(stderr);
    fmt::print(
        stderr, "time went to {:.6g} s{}\n", now_s,
        before < told_ ? ": " + counted(told_ - before, "fault") + " since then did not come" : "");
    told_ = std::min(told_, before);
  }

  bool waits_;
  std::size_t told_ = 0;
  std::uint64_t travels_ = 0;
};

/// Prints of each joint the first of its commands that a limit changed: the table counts them.
class LimitNotes {
 public:
  void look(const runtime::RobotCycle& cycle) {
    for (const auto& one : cycle.limits_met(seen_)) {
      if (!told_.insert(one.joint).second) continue;
      restart_line(stderr);
      fmt::print(stderr, "{:.3f} s: {}: limited: {}\n", one.time_s, one.joint, one.text);
    }
  }

 private:
  std::uint64_t seen_ = 0;
  std::set<std::string> told_;
};

/// Prints what controllers say, up to some lines: the log has them all.
class TextNotes {
 public:
  void look(const runtime::TextHistory& texts) {
    if (texts.count() == seen_) return;
    lines_.clear();
    const std::uint64_t gone = texts.read(seen_, lines_);
    if (told_ > kMost) return;
    restart_line(stderr);
    for (const hal::TextEvent& one : lines_) {
      if (++told_ > kMost) break;
      fmt::print(stderr, "{:.3f} s: {}: {}{}\n", 1e-9 * static_cast<double>(one.time_ns),
                 shown(one.controller()), one.level == hal::TextLevel::kWarn ? "warning: " : "",
                 one.words());
    }
    told_ += gone;
    if (told_ > kMost) fmt::print(stderr, "what controllers say from now on is in the log alone\n");
  }

 private:
  static constexpr std::uint64_t kMost = 200;
  std::uint64_t seen_ = 0, told_ = 0;
  std::vector<hal::TextEvent> lines_;
};

/// Seconds that no cycle of simulated time lasts, at whatever rate: time was paused meanwhile, or
/// the process suspended. Real time goes on.
double longest_cycle_s(runtime::RobotCycle& cycle) {
  const rt::ClockState clock = cycle.inbox().clock().state();
  if (clock.pacing != rt::Pacing::kSimulated) return std::numeric_limits<double>::infinity();
  return std::max(0.5, 2e-9 * static_cast<double>(clock.period_ns) / rt::kSlowest);
}

/// Adds the `seconds` of a cycle that began in `phase`.
void count_time(RunTimes& times, runtime::RunPhase phase, double seconds, double longest_s) {
  using enum runtime::RunPhase;
  if (seconds > longest_s) {
    times.stood_s += seconds;
  } else if (phase == kRunning) {
    times.running_s += seconds;
  } else if (phase == kRetreating || phase == kFaulted || phase == kResetting || phase == kHeld) {
    times.stopped_s += seconds;
  }
}

void warn_of_log(const log::Recorder& recorder) {
  say(Said::kWarning,
      fmt::format("{}: nothing is logged any more: {}; the run continues without a log (end it "
                  "with Ctrl-C or tandem ask '{{\"do\": \"run.stop\"}}', and start it again)",
                  recorder.path(), recorder.trouble()));
}

}  // namespace

void CycleThread::run(runtime::RobotCycle& cycle, const rt::ThreadConfig& config) {
  stand_still_on_crash(cycle.heartbeat());
  report_ = rt::set_up_thread(config);
  const double longest_s = longest_cycle_s(cycle);
  SteadyClock::time_point began = SteadyClock::now();
  bool more = true;
  while (more) {
    const runtime::RunPhase phase = cycle.phase();
    more = cycle.step();
    const SteadyClock::time_point now = SteadyClock::now();
    count_time(times_, phase, std::chrono::duration<double>(now - began).count(), longest_s);
    began = now;
  }
  done_.store(true, std::memory_order_release);
  ended_.release();
}

void watch(runtime::RobotCycle& cycle, CycleThread& loop, const WiredComposition& c,
           const CycleGuard& guard, const log::Recorder* recorder, ServiceNotice& notice,
           std::FILE* out, bool waits, bool quiet) {
  const runtime::Experiment& e = c.experiment;
  const double period_s = static_cast<double>(e.loop.period_ns) * 1e-9;
  const runtime::Progress& progress = cycle.progress();
  ProgressBar bar(out, static_cast<double>(e.cycles()) * period_s);
  BusWatch buses(c.open_buses(), stderr);
  FaultNotes faults(waits);
  HomingNote homing;
  TextNotes texts;
  LimitNotes limits;
  // What has no end has no share that is done: then the run's time, as all other lines have it.
  const auto done_s = [&] {
    return e.endless() ? static_cast<double>(progress.time_ns.load()) * 1e-9
                       : static_cast<double>(progress.running_cycles.load()) * period_s;
  };
  bool logged = recorder != nullptr;
  while (!loop.done() && !guard.gave_up()) {
    if (logged && recorder->failed()) {
      logged = false;
      warn_of_log(*recorder);
    }
    if (!quiet) buses.look();
    if (!quiet) homing.look(cycle, e.robot);
    if (!quiet) faults.look(cycle);
    if (!quiet) texts.look(cycle.services().texts());
    if (!quiet) limits.look(cycle);
    if (!quiet) bar.update(done_s(), progress_note(cycle));
    notice.status(service_status(cycle));
    loop.await(std::chrono::milliseconds(20));
  }
  if (!quiet) {
    texts.look(cycle.services().texts());
    limits.look(cycle);
    bar.update(done_s(), progress_note(cycle));
    bar.finish();
  }
}

}  // namespace tandem::apps
