#include "apps/control/clock_commands.hpp"

#include "rt/clock.hpp"

namespace tandem::apps {
namespace {

const char* clock_name(rt::Pacing pacing) {
  switch (pacing) {
    case rt::Pacing::kWallClock: return "real";
    case rt::Pacing::kSimulated: return "simulated";
    case rt::Pacing::kExternal: return "bus";
  }
  return "?";
}

/// Since time went on, or its rate changed, last; null where that says nothing.
Json realtime_factor(const rt::ClockState& clock, std::uint64_t cycles) {
  const double wall_s = static_cast<double>(rt::WallClock().now_ns() - clock.since_ns) * 1e-9;
  if (clock.standing || clock.since_ns == 0 || wall_s <= 0.0 || cycles < clock.since_cycle) {
    return nullptr;
  }
  const auto ns = static_cast<std::int64_t>(cycles - clock.since_cycle) * clock.period_ns;
  return static_cast<double>(ns) * 1e-9 / wall_s;
}

Json look(const runtime::RobotCycle& cycle) {
  const rt::ClockState clock = cycle.inbox().clock().state();
  const runtime::Progress& progress = cycle.progress();
  const std::int64_t time_ns = progress.time_ns.load();
  const std::uint64_t done = progress.cycles.load();
  const auto begun = static_cast<std::uint64_t>(time_ns / clock.period_ns) + (done > 0 ? 1 : 0);
  return {{"clock", clock_name(clock.pacing)},
          {"phase", runtime::to_string(progress.phase.load())},
          {"time_s", static_cast<double>(time_ns) * 1e-9},
          {"cycles", done},
          {"paused", clock.paused},
          {"standing", clock.standing},
          {"pending_steps", clock.pending_steps},
          {"rate", clock.pacing == rt::Pacing::kSimulated ? clock.rate : 1.0},
          {"realtime_factor", realtime_factor(clock, begun)}};
}

Result<Json> answer(runtime::RobotCycle& cycle, const Status& done) {
  if (!done) return std::unexpected(done.error());
  return look(cycle);
}

Result<Json> pause(runtime::RobotCycle& cycle) {
  const Result<std::uint64_t> dropped = cycle.inbox().clock().pause();
  if (!dropped) return std::unexpected(dropped.error());
  Json found = look(cycle);
  found["dropped_steps"] = *dropped;
  return found;
}

Result<Json> step(runtime::RobotCycle& cycle, const Json& request) {
  return answer(cycle, cycle.inbox().clock().step(request.value("cycles", std::uint64_t{1})));
}

}  // namespace

bool time_stands(const runtime::RobotCycle& cycle) {
  return cycle.inbox().clock().state().standing;
}

void add_clock_commands(ControlRegistry& registry, runtime::RobotCycle& cycle) {
  registry.add("clock.show", [&cycle](const Json&) -> Result<Json> { return look(cycle); });
  registry.add("clock.pause", [&cycle](const Json&) { return pause(cycle); });
  registry.add("clock.resume",
               [&cycle](const Json&) { return answer(cycle, cycle.inbox().clock().resume()); });
  registry.add("clock.step", [&cycle](const Json& request) { return step(cycle, request); });
  registry.add("clock.rate", [&cycle](const Json& request) {
    const auto rate = request["rate"].get<double>();
    return answer(cycle, cycle.inbox().clock().set_rate(rate));
  });
}

}  // namespace tandem::apps
