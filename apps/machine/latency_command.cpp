// `tandem latency`: measures under each load and prints, draws and judges what came out.
#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "apps/machine/child_process.hpp"
#include "apps/machine/commands.hpp"
#include "apps/machine/latency_measure.hpp"
#include "apps/machine/latency_report.hpp"
#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "base/process.hpp"
#include "rt/cpu_latency.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

void note(const std::string& text) { fmt::print(stderr, "note: {}\n", text); }

/// What the thread set-up says on a thread of its own: asked before anything is measured.
rt::ThreadReport granted(const rt::ThreadConfig& config) {
  rt::ThreadReport report;
  std::thread([&] { report = rt::set_up_thread(config); }).join();
  return report;
}

bool cyclictest_runs() {
  const std::string alone = "our loop is measured alone";
  if (!program_exists("cyclictest")) {
    note("cyclictest is not installed: " + alone + " (apt-get install rt-tests)");
    return false;
  }
  // It asks for this before anything else, whatever its policy will be, and ends without it.
  const rt::ThreadReport report =
      granted({.policy = rt::SchedulingPolicy::kFifo, .priority = 1, .lock_memory = false});
  if (report.complete()) return true;
  note("cyclictest does not run without the right to real-time priorities: " + alone + " (" +
       report.missing.front().how + ")");
  return false;
}

/// CPUs and mode, as they were asked for or as the machine has them.
Status choose_cpus(const LatencyOptions& options, LatencyPlan& plan) {
  const std::vector<int> usable = usable_cpus();
  plan.mode = options.mode == "turns"      ? LatencyMode::kTurns
              : options.mode == "together" ? LatencyMode::kTogether
                                           : LatencyMode::kSwap;
  plan.cpus = options.cpus;
  if (plan.cpus.empty())
    plan.cpus.assign(usable.begin(),
                     usable.begin() + std::min<std::ptrdiff_t>(2, std::ssize(usable)));
  for (const int cpu : plan.cpus) {
    if (std::ranges::find(usable, cpu) != usable.end()) continue;
    return fail(fmt::format("this process may not run on CPU {}", cpu),
                "choose one that `taskset -cp $$` shows");
  }
  const bool one = plan.cpus.front() == plan.cpus.back();
  if (plan.mode == LatencyMode::kTurns || !one) return {};
  note("one CPU only: both take turns on it");
  plan.mode = LatencyMode::kTurns;
  return {};
}

/// @param folder  to write to
Result<LatencyPlan> plan_of(const LatencyOptions& options, const std::string& folder) {
  LatencyPlan plan;
  plan.period_us = options.period_us;
  plan.duration_s = options.duration_s;
  plan.slices = options.slices;
  plan.priority = options.priority;
  plan.policy = options.policy == "fifo" ? rt::SchedulingPolicy::kFifo
                : options.policy == "rr" ? rt::SchedulingPolicy::kRoundRobin
                                         : rt::SchedulingPolicy::kOther;
  if (const Status s = choose_cpus(options, plan); !s) return std::unexpected(s.error());
  const rt::ThreadConfig wanted{
      .policy = plan.policy, .priority = plan.priority, .cpu = plan.cpus.front()};
  for (const rt::Missing& one : granted(wanted).missing) {
    note(fmt::format("could not get {}: {} ({})", one.what, one.why, one.how));
    if (one.what.starts_with("SCHED_")) {
      plan.policy = rt::SchedulingPolicy::kOther;
      note("measured with SCHED_OTHER");
    }
  }
  plan.cyclictest = cyclictest_runs();
  plan.folder = folder;
  return plan;
}

Result<std::vector<std::string>> loads_of(const LatencyOptions& options) {
  const bool stress = program_exists("stress-ng");
  if (options.load.empty() || options.load == "both") {
    if (stress) return std::vector<std::string>{"idle", "stress"};
    if (!options.load.empty())
      return fail("stress-ng is not installed", "apt-get install stress-ng");
    note("stress-ng is not installed: measured without load only (apt-get install stress-ng)");
    return std::vector<std::string>{"idle"};
  }
  if (options.load == "stress" && !stress) {
    return fail("stress-ng is not installed", "apt-get install stress-ng");
  }
  return std::vector<std::string>{options.load};
}

/// Every CPU busy, the disk and the memory too. Ends by itself should we be killed.
Result<ChildProcess> start_stress(const LatencyPlan& plan) {
  const auto limit_s = static_cast<int>(std::ceil(2.0 * plan.duration_s)) + 60;
  return ChildProcess::start(
      {"stress-ng", "--cpu", std::to_string(usable_cpus().size()), "--io", "1", "--vm", "1",
       "--vm-bytes", "64M", "--timeout", fmt::format("{}s", limit_s)},
      plan.folder + "/stress-ng.txt");
}

/// All loads, one after the other.
Result<std::vector<LatencySample>> measure(const LatencyPlan& plan,
                                           const std::vector<std::string>& loads, std::FILE* out,
                                           bool quiet) {
  const bool turns = plan.mode == LatencyMode::kTurns && plan.cyclictest;
  const double per_load_s = plan.duration_s * (turns ? 2.0 : 1.0);
  ProgressBar bar(out, per_load_s * static_cast<double>(loads.size()));
  std::vector<LatencySample> samples;
  for (const std::string& load : loads) {
    std::optional<ChildProcess> stress;
    if (load == "stress") {
      auto started = start_stress(plan);
      if (!started) return std::unexpected(started.error());
      stress.emplace(std::move(*started));
      std::this_thread::sleep_for(std::chrono::seconds(1));  // until its workers are there
    }
    const double before_s = per_load_s * static_cast<double>(samples.size());
    auto sample = measure_latency(plan, [&](double done_s) {
      if (!quiet) bar.update(before_s + std::min(done_s, per_load_s), load);
    });
    if (!sample) return std::unexpected(sample.error());
    sample->load = load;
    samples.push_back(std::move(*sample));
    if (rt::stop_requested()) break;
  }
  if (!quiet) bar.finish();
  return samples;
}

/// Draws into the draft and puts it in place; without drawings nothing is put there.
void draw(const LatencyPlan& plan, std::span<const LatencySample> samples, Draft& draft,
          std::FILE* out, bool quiet) {
  const auto files = draw_latency(plan, samples, draft.path());
  const Status placed = files ? draft.place() : std::unexpected(draft.placed(files.error()));
  if (!placed) {
    note("no plots: " + placed.error().to_string());
    return;
  }
  if (quiet) return;
  Facts facts;
  facts.add("report", draft.placed(files->page));
  facts.add("plots", draft.placed(files->images.back()));
  facts.print(out);
}

/// Measures and prints. @param draft  of the folder of options.output
Result<Json> measure_and_draw(const LatencyOptions& options, Draft& draft) {
  const auto plan = plan_of(options, draft.path());
  if (!plan) return std::unexpected(plan.error());
  const auto loads = loads_of(options);
  if (!loads) return std::unexpected(loads.error());

  std::FILE* out = human_output(options.json);
  if (!options.quiet) {
    fmt::print(out, "our loop{} at {} us, {:g} s per load, mode {}\n",
               plan->cyclictest ? " and cyclictest" : "", plan->period_us, plan->duration_s,
               to_string(plan->mode));
  }
  rt::install_stop_signals();
  const auto samples = [&] {
    const rt::NoCpuSleep awake;  // as cyclictest does, so that both have it in every mode
    return measure(*plan, *loads, out, options.quiet);
  }();
  rt::remove_stop_signals();  // drawing looks at no flag
  if (!samples) return std::unexpected(draft.placed(samples.error()));
  if (!options.quiet) {
    fmt::print(out, "\n");
    print_latency(*plan, *samples, out);
  }
  draw(*plan, *samples, draft, out, options.quiet);
  return figures_json(LatencyResult{*plan, *samples});
}

}  // namespace

Exit latency_command(const LatencyOptions& options) {
  if (const Status s = check_writable(options.json); !s) return refuse(s.error());
  Result<Json> measured;
  {
    Result<Draft> draft = Draft::folder(options.output);
    if (!draft) return refuse(draft.error());
    measured = measure_and_draw(options, *draft);
  }
  if (!measured) return refuse(measured.error());
  return end_with_json(options.json, *measured);
}

}  // namespace tandem::apps
