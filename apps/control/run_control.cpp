#include "apps/control/run_control.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "apps/control/clock_commands.hpp"
#include "apps/control/controller_control.hpp"
#include "apps/control/fault_table.hpp"
#include "apps/control/input_control.hpp"
#include "apps/control/joint_control.hpp"
#include "apps/control/sensor_control.hpp"
#include "apps/control/signal_control.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::microseconds kLook{200};  // between two looks for a confirmation

/// How long a stop may take to be confirmed. What is simulated may be slow without being stuck.
std::chrono::nanoseconds stop_patience(const rt::ClockState& clock) {
  constexpr std::chrono::nanoseconds kOnRobot = std::chrono::milliseconds(100);
  constexpr std::chrono::nanoseconds kElsewhere = std::chrono::seconds(1);
  constexpr std::chrono::nanoseconds kMost = kStopAnswer - std::chrono::milliseconds(500);
  constexpr double kCycles = 10.0;
  const double rate = clock.rate > 0.0 ? clock.rate : 1.0;
  const double cycles_ns = kCycles * static_cast<double>(clock.period_ns) / rate;
  if (cycles_ns >= static_cast<double>(kMost.count())) return kMost;
  const bool on_robot = clock.pacing == rt::Pacing::kWallClock;
  const std::chrono::nanoseconds cycles(static_cast<std::int64_t>(cycles_ns));
  return std::min(kMost, cycles + (on_robot ? kOnRobot : kElsewhere));
}

Json status(const runtime::RobotCycle& cycle) {
  const runtime::Progress& progress = cycle.progress();
  return {{"phase", runtime::to_string(progress.phase.load())},
          {"paused", time_stands(cycle)},
          {"cycles", progress.cycles.load()},
          {"running_cycles", progress.running_cycles.load()},
          {"total_cycles", progress.total_cycles.load()},
          {"overruns", progress.overruns.load()},
          {"dropped", progress.dropped.load()},
          {"latched", progress.latched.load()},
          {"resets", progress.resets.load()},
          {"failed_resets", progress.failed_resets.load()}};
}

/// Null: nothing was measured.
Json measured(const rt::Histogram& of) {
  const rt::Percentiles found = of.percentiles();  // which may be read beside the loop
  return found.max == 0 ? Json(nullptr) : percentiles_json(found);
}

/// Buckets as pairs, upper end [ns] and count: they may be read beside the loop, too.
Json bins(const rt::Histogram& of) {
  Json all = Json::array();
  for (const rt::HistogramBin& one : of.bins()) all.push_back({one.upper_ns, one.count});
  return all;
}

Json loop(const runtime::RobotCycle& cycle, const hal::RobotConfig& robot, const RunWires& wires) {
  const rt::CycleStatistics& times = cycle.loop();
  return {{"robot", robot.name},
          {"hal", wires.hal},
          {"cycles", cycle.progress().cycles.load()},
          {"period_ns", cycle.inbox().clock().state().period_ns},
          {"overruns", cycle.progress().overruns.load()},
          {"cycle_ns", measured(times.work)},
          {"wakeup_ns", measured(times.wakeup)},
          {"bus_ns", measured(times.bus)},
          {"histograms",
           {{"cycle_ns", bins(times.work)},
            {"wakeup_ns", bins(times.wakeup)},
            {"bus_ns", bins(times.bus)}}},
          {"buses", wires.buses ? wires.buses() : Json::array()}};
}

Result<Json> reset(runtime::RobotCycle& cycle, std::uint64_t after_stop) {
  using runtime::RunPhase;
  const RunPhase phase = cycle.progress().phase.load();
  Json answer = status(cycle);
  if (cycle.inbox().stop_waits()) {
    return fail("an emergency stop waits for the loop", "let it be carried out first");
  }
  if (cycle.progress().latched.load() == 0) return answer;  // nothing to do is no error
  if (phase == RunPhase::kRetreating) {
    return fail("the robot is on its way to a safe posture", "reset it when that is over");
  }
  if (phase == RunPhase::kBringUp || phase == RunPhase::kShutDown || phase == RunPhase::kDone) {
    return fail(fmt::format("the run is in the phase {}", runtime::to_string(phase)),
                "a fault is reset while the run waits for it: tandem run --on-fault wait");
  }
  answer["faults"] = figures_json(cycle.faults());  // before it
  cycle.inbox().reset_faults(after_stop);
  return answer;
}

/// Category 2 is category 1 where no controller can retreat: the loop's own record says which.
hal::StopCategory carried_out_category(const runtime::RobotCycle& cycle, std::uint64_t at_cycle,
                                       hal::StopCategory asked) {
  if (asked != hal::StopCategory::kCategory2) return asked;
  for (const runtime::FaultReport& fault : cycle.faults()) {
    if (fault.cycle == at_cycle && fault.category == asked) return asked;
  }
  return hal::StopCategory::kCategory1;
}

Result<Json> stop(runtime::RobotCycle& cycle, const Json& request, hal::StopCategory category) {
  if (request.contains("category")) {
    category = static_cast<hal::StopCategory>(request["category"].get<std::int64_t>());
  }
  const std::uint32_t number = cycle.inbox().emergency_stop(category);
  const rt::ClockState clock = cycle.inbox().clock().state();
  const auto patience = stop_patience(clock);
  const auto deadline = SteadyClock::now() + patience;
  Json answer{{"category", hal::to_string(category)}, {"paused", false}, {"confirmed", true}};
  for (;;) {
    const bool over = cycle.inbox().closed();  // before: its last cycle confirms, and then closes
    if (const auto carried_out = cycle.inbox().confirmed(number)) {
      answer["cycle"] = *carried_out;
      answer["category"] = hal::to_string(carried_out_category(cycle, *carried_out, category));
      return answer;
    }
    if (time_stands(cycle)) {  // the loop waits, and nothing moves until it has seen the stop
      answer["paused"] = true;
      answer["confirmed"] = false;
      return answer;
    }
    if (over) return fail("the run is over: its loop stops nothing any more");
    if (SteadyClock::now() > deadline) break;
    std::this_thread::sleep_for(kLook);
  }
  return fail(fmt::format("the emergency stop is latched, but not confirmed by the loop within "
                          "{:.3g} s: the loop hangs, or is very slow",
                          std::chrono::duration<double>(patience).count()),
              "stop the robot by its own stop circuit");
}

Result<Json> set_link(runtime::RobotCycle& cycle, const Json& request) {
  constexpr double kLongest_s = 60.0;
  hal::LinkChange change;
  for (const auto& [key, value] :
       {std::pair{"delay_s", &change.delay_s}, {"jitter_s", &change.jitter_s}}) {
    if (!request.contains(key)) continue;
    *value = request[key].get<double>();
    if (!(*value >= 0.0 && *value <= kLongest_s))
      return fail_at(key, "is no time of a link", "give 0 to 60 s");
  }
  if (request.contains("loss")) change.loss = request["loss"].get<double>();
  if (std::isnan(change.delay_s) && std::isnan(change.jitter_s) && std::isnan(change.loss))
    return fail("link.set: nothing is to be set", "give delay_s, jitter_s or loss");
  const std::string way = request.value("way", std::string("both"));
  change.up = way != "down";
  change.down = way != "up";
  const auto asked = cycle.services().set_link(change);
  if (!asked) return std::unexpected(asked.error());
  return asked_json(*asked);
}

}  // namespace

void add_run_commands(ControlRegistry& registry, runtime::RobotCycle& cycle,
                      const hal::RobotConfig& robot, JudgeGains judge, TryController trial,
                      RunWires wires) {
  RunPast past = std::move(wires.past);
  registry.stops_by([&cycle] { return cycle.progress().stopped_before.load(); });
  registry.add("status", [&cycle](const Json&) -> Result<Json> { return status(cycle); });
  add_group_commands(registry, cycle, robot, std::move(wires.lead));
  registry.add("loop.show",
               [&cycle, &robot, wires = std::move(wires)](const Json&) -> Result<Json> {
                 return loop(cycle, robot, wires);
               });
  registry.add("fault.show", [&cycle](const Json&) -> Result<Json> {
    Json answer = status(cycle);
    answer["faults"] = figures_json(cycle.faults());
    answer["lost"] = cycle.fault_log().lost();
    return answer;
  });
  registry.add(*command_row("fault.reset"), [&cycle](const Json&, std::uint64_t after_stop) {
    return reset(cycle, after_stop);
  });
  registry.add("estop", [&cycle, &robot](const Json& request) {
    return stop(cycle, request, robot.emergency_stop);
  });
  registry.add("run.stop", [&cycle](const Json&) -> Result<Json> {
    cycle.inbox().end_run();
    return Json::object();
  });
  registry.add("link.set", [&cycle](const Json& request) { return set_link(cycle, request); });
  add_controller_commands(registry, cycle.services(), robot, std::move(trial));
  add_joint_commands(registry, cycle, robot, std::move(judge));
  add_input_commands(registry, cycle.services());
  add_sensor_commands(registry, cycle.services());
  add_signal_commands(registry, cycle.services(), robot);
  add_clock_commands(registry, cycle, std::move(past));
}

}  // namespace tandem::apps
