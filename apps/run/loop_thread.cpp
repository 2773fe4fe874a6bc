#include "apps/run/loop_thread.hpp"

#include <fmt/core.h>

#include <chrono>

#include "apps/can/bus_watch.hpp"
#include "apps/control/clock_control.hpp"
#include "apps/text/console.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;

std::string progress_note(const runtime::RobotCycle& cycle) {
  if (time_stands(cycle)) return "paused";
  const runtime::RunPhase phase = cycle.progress().phase.load();
  return phase == runtime::RunPhase::kRunning ? "" : runtime::to_string(phase);
}

void warn_of_log(const log::Recorder& recorder) {
  fmt::print(stderr,
             "warning: {}: nothing is logged any more: {}; the run continues without a log (end it "
             "with Ctrl-C or tandem ask '{{\"do\": \"run.stop\"}}', and start it again)\n",
             recorder.path(), recorder.trouble());
}

}  // namespace

void LoopThread::run(runtime::RobotCycle& cycle, const rt::ThreadConfig& config) {
  report_ = rt::set_up_thread(config);
  SteadyClock::time_point began = SteadyClock::now();
  auto before = runtime::RunPhase::kBringUp;
  bool more = true;
  while (more) {
    more = cycle.step();
    const runtime::RunPhase now = cycle.phase();
    if (now == before) continue;
    const SteadyClock::time_point time = SteadyClock::now();
    if (now == runtime::RunPhase::kRunning) began = time;
    if (before == runtime::RunPhase::kRunning) {
      wall_s_ += std::chrono::duration<double>(time - began).count();
    }
    before = now;
  }
  done_.store(true, std::memory_order_release);
}

void watch(const runtime::RobotCycle& cycle, const LoopThread& loop, const Composition& c,
           const LoopGuard& guard, const log::Recorder* recorder, std::FILE* out, bool quiet) {
  const runtime::Experiment& e = c.experiment;
  const double period_s = static_cast<double>(e.loop.period_ns) * 1e-9;
  const runtime::Progress& progress = cycle.progress();
  ProgressBar bar(out, static_cast<double>(e.cycles()) * period_s);
  BusWatch buses(c.can_buses(), stderr);
  bool logged = recorder != nullptr;
  while (!loop.done() && !guard.gave_up()) {
    if (logged && recorder->failed()) {
      logged = false;
      warn_of_log(*recorder);
    }
    if (!quiet) buses.look();
    if (!quiet) {
      bar.update(static_cast<double>(progress.running_cycles.load()) * period_s,
                 progress_note(cycle));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (!quiet) {
    bar.update(static_cast<double>(progress.running_cycles.load()) * period_s,
               progress_note(cycle));
    bar.finish();
  }
}

}  // namespace tandem::apps
