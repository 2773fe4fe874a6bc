#include "apps/run/pace.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "base/process.hpp"

namespace tandem::apps {

std::string pace_text(const WiredComposition& c) {
  const runtime::HalOptions& hal = c.experiment.hal;
  std::string where = hal.backend == runtime::BackendKind::kWire
                          ? "over " + wire_name(c.experiment.robot) + ", "
                          : "";
  if (hal.backend == runtime::BackendKind::kDds) where = "over DDS, ";
  if (c.backend->pace() == hal::Pace::kBus) return where + "at the server's pace";
  if (c.backend->pace() == hal::Pace::kWallClock) return where + "in real time";
  const std::string how = hal.lockstep && !where.empty() ? "in lockstep, " : "";
  const rt::CyclicLoopConfig& loop = c.experiment.loop;
  return where + how + (loop.rate > 0.0 ? fmt::format("rate {:g}", loop.rate) : "free running") +
         (loop.start_paused ? ", paused: tandem clock resume" : "") +
         (time_limits_are_waived() ? ", without limits of time" : "");
}

Status check_pace(const WiredComposition& c, const RunOptions& options) {
  const bool simulated = c.backend->pace() == hal::Pace::kSimulatedClock;
  if (options.serves && c.experiment.teleoperation && simulated &&
      options.rate.value_or(c.experiment.loop.rate) != 1.0) {
    return fail("a robot behind a link keeps real time, as its operator does", "add --realtime");
  }
  if (simulated) return {};
  if (c.remote != nullptr) {
    if (!options.start_paused && options.rate.value_or(1.0) == 1.0) return {};
    const bool own = c.backend->pace() == hal::Pace::kWallClock;
    return fail(own ? "the operator's end of a link keeps real time, as the robot's does"
                    : "the server gives the pace",
                own ? "leave --rate and --start-paused out"
                    : "give --rate and --start-paused to `tandem serve`");
  }
  if (options.start_paused) {
    return fail("boards on a bus keep real time, which cannot be paused",
                "leave --start-paused out, or add --lockstep for emulated boards");
  }
  if (options.rate.value_or(1.0) == 1.0) return {};
  return fail("boards on a bus keep real time, so --rate cannot be other than 1",
              "leave --rate out, or add --lockstep for emulated boards");
}

void set_pace(const WiredComposition& c, RunOptions& options) {
  const bool simulated = c.backend->pace() == hal::Pace::kSimulatedClock;
  const bool says_none = !options.rate && c.experiment.loop.rate == 0.0;
  if (options.studio.wanted && simulated && says_none) options.rate = 1.0;
}

void note_overrun_policy(const WiredComposition& c, const RunOptions& options) {
  const rt::CyclicLoopConfig& loop = c.experiment.loop;
  const bool paced = options.rate.value_or(loop.rate) > 0.0;
  if (c.backend->pace() != hal::Pace::kSimulatedClock || !paced) return;
  if (loop.on_overrun == rt::OverrunPolicy::kSkip) return;
  fmt::print(stderr,
             "note: [overrun] holds for the wall clock; this run's time is simulated: a late cycle "
             "is counted, and neither skips one nor stops the run (docs/realtime.md)\n");
}

}  // namespace tandem::apps
