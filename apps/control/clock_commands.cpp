#include "apps/control/clock_commands.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

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
          {"period_s", 1e-9 * static_cast<double>(clock.period_ns)},
          {"pending_steps", clock.pending_steps},
          {"rate", clock.pacing == rt::Pacing::kSimulated ? clock.rate : 1.0},
          {"realtime_factor", realtime_factor(clock, begun)}};
}

double period_of(const runtime::RobotCycle& cycle) {
  return 1e-9 * static_cast<double>(cycle.config().loop.period_ns);
}

/// Time of the moment before cycle `next`: that of the cycle before.
double seconds_of(const runtime::RobotCycle& cycle, std::uint64_t next) {
  return period_of(cycle) * static_cast<double>(next == 0 ? 0 : next - 1);
}

/// The nearest moment. Errors: it is before the run's beginning, or beyond what can be counted.
Result<std::uint64_t> moment_of(const runtime::RobotCycle& cycle, double seconds, const char* key) {
  const double cycles = std::round(seconds / period_of(cycle));
  if (cycles >= 0.0 && cycles < 9e15) return static_cast<std::uint64_t>(cycles) + 1;
  return fail_at(key, fmt::format("{:g} s is no time of the run", seconds),
                 "0 is its beginning; tandem clock show says where it is");
}

/// What the clock commands of one run share.
struct Clock {
  runtime::RobotCycle& cycle;
  RunPast past;

  [[nodiscard]] rt::ClockControl& control() const { return cycle.inbox().clock(); }
  [[nodiscard]] std::uint64_t next() const { return control().state().next_cycle; }

  /// Whoever is at the clock may want to go back.
  void keep() const {
    if (past.machine != nullptr) past.machine->keep();
  }

  [[nodiscard]] Json look() const {
    Json found = apps::look(cycle);
    if (past.machine == nullptr) {
      if (!past.why_not.empty()) found["no_past"] = past.why_not;
      return found;
    }
    if (std::string awaited = past.machine->awaited(); !awaited.empty())
      found["until"] = std::move(awaited);
    if (const auto met = past.machine->met()) {
      found["until_met_s"] = seconds_of(cycle, *met);
      found["until_met"] = past.machine->met_words();
    }
    const runtime::KeptPast kept = past.machine->past();
    found["past"] = {
        {"keeps", kept.keeps},
        {"no_more", kept.no_more.empty() ? Json(nullptr) : Json(kept.no_more)},
        {"checkpoints", kept.count},
        {"bytes", kept.bytes},
        {"budget_bytes", kept.budget_bytes},
        {"from_s", kept.count == 0 ? Json(nullptr) : Json(seconds_of(cycle, kept.oldest))}};
    return found;
  }

  [[nodiscard]] Result<Json> answer(const Status& done) const {
    if (!done) return std::unexpected(done.error());
    keep();
    return look();
  }

  [[nodiscard]] Result<Json> pause() const {
    if (past.machine != nullptr) past.machine->abandon();
    const Result<std::uint64_t> dropped = control().pause();
    if (!dropped) return std::unexpected(dropped.error());
    keep();
    Json found = look();
    found["dropped_steps"] = *dropped;
    return found;
  }

  [[nodiscard]] Result<Json> step(const Json& request) const {
    if (!request.contains("to_s")) {
      return answer(control().step(request.value("cycles", std::uint64_t{1})));
    }
    if (request.contains("cycles")) {
      return fail_at("to_s", "says where to, as 'cycles' does", "give one of them");
    }
    const double to_s = request["to_s"].get<double>();
    const auto to = moment_of(cycle, to_s, "to_s");
    if (!to) return std::unexpected(to.error());
    if (control().state().standing && *to <= next()) {
      return fail_at(
          "to_s", fmt::format("{:g} s has been: it is {:g} s now", to_s, seconds_of(cycle, next())),
          "tandem clock goto goes back");
    }
    return answer(control().step(*to - next()));
  }

  [[nodiscard]] Status may_go_back() const {
    if (past.machine != nullptr) return {};
    return fail("this run cannot go back in time: " + past.why_not,
                "a simulation can: tandem run … --hal sim, or in lockstep with tandem emulate");
  }

  [[nodiscard]] Result<Json> arrived(const Result<runtime::Travel>& travel) const {
    if (!travel) return std::unexpected(travel.error());
    Json found = look();
    found["from_s"] = seconds_of(cycle, travel->from);
    found["replayed_cycles"] = travel->replayed;
    found["took_ms"] = 1e-6 * static_cast<double>(travel->took_ns);
    if (travel->to == travel->asked) return found;
    found["asked_s"] = seconds_of(cycle, travel->asked);
    found["note"] = fmt::format(
        "{:g} s follows from what came from outside just before, which cannot be played again: "
        "time stands before that",
        seconds_of(cycle, travel->asked));
    return found;
  }

  [[nodiscard]] Result<Json> rewind(const Json& request) const {
    if (const Status may = may_go_back(); !may) return std::unexpected(may.error());
    const double by_s = request["by_s"].get<double>();
    if (!(by_s > 0.0 && by_s < 1e9)) {
      return fail_at("by_s", "goes back by more than 0 s, and less than 1e9 s", "write 2.5s");
    }
    const double cycles = std::max(1.0, std::round(by_s / period_of(cycle)));
    return arrived(past.machine->go_back(cycle, static_cast<std::uint64_t>(cycles)));
  }

  [[nodiscard]] Result<Json> go_to(const Json& request) const {
    if (const Status may = may_go_back(); !may) return std::unexpected(may.error());
    const auto next = moment_of(cycle, request["time_s"].get<double>(), "time_s");
    if (!next) return std::unexpected(next.error());
    return arrived(past.machine->go_to(cycle, *next));
  }

  [[nodiscard]] Result<runtime::CycleCondition> condition(const Json& request) const {
    if (!past.condition) return fail("no condition can be asked here", "use tandem clock goto");
    auto read = past.condition(request["condition"].get<std::string>());
    if (!read && read.error().key.empty()) read.error().key = "condition";
    return read;
  }

  [[nodiscard]] Result<Json> back_until(const Json& request) const {
    if (const Status may = may_go_back(); !may) return std::unexpected(may.error());
    auto holds = condition(request);
    if (!holds) return std::unexpected(holds.error());
    return arrived(past.machine->back_until(cycle, std::move(*holds)));
  }

  [[nodiscard]] Result<Json> give_up() const {
    const Result<std::string> before = past.machine->give_up(cycle);
    if (!before) return std::unexpected(before.error());
    keep();
    Json found = look();
    found["note"] = "it is given up: " + *before;
    return found;
  }

  [[nodiscard]] Result<Json> until(const Json& request) const {
    if (past.machine == nullptr) {
      return fail(
          "conditions are looked at where time can go back, and here it cannot: " + past.why_not,
          "go on to a time: tandem clock step --to TIME; or ask a simulation in one process");
    }
    const bool cancel = request.value("cancel", false);
    if (cancel == request.contains("condition")) {
      return fail_at("condition", cancel ? "none is given up and waited for at once" : "is missing",
                     "give a condition, or cancel the one that waits");
    }
    if (cancel) return give_up();
    auto holds = condition(request);
    if (!holds) return std::unexpected(holds.error());
    const auto begun = past.machine->until(cycle, std::move(*holds), request["condition"]);
    if (!begun) return std::unexpected(begun.error());
    keep();
    Json found = look();
    found["waits"] = found.contains("until");  // else it has become true meanwhile
    std::string note = begun->holds_now ? "it holds now, so it has to end first" : "";
    if (!begun->replaced.empty()) {
      note += (note.empty() ? "" : "; ") + ("it replaces one that waited: " + begun->replaced);
    }
    if (!note.empty()) found["note"] = std::move(note);
    return found;
  }
};

}  // namespace

bool time_stands(const runtime::RobotCycle& cycle) {
  return cycle.inbox().clock().state().standing;
}

void add_clock_commands(ControlRegistry& registry, runtime::RobotCycle& cycle, RunPast past) {
  const auto clock = std::make_shared<const Clock>(cycle, std::move(past));
  const auto add = [&](const char* name, auto asked) {
    registry.add(name, [clock, asked](const Json& request) { return asked(*clock, request); });
  };
  add("clock.show", [](const Clock& on, const Json&) -> Result<Json> { return on.look(); });
  add("clock.pause", [](const Clock& on, const Json&) { return on.pause(); });
  add("clock.resume",
      [](const Clock& on, const Json&) { return on.answer(on.control().resume()); });
  add("clock.step", [](const Clock& on, const Json& request) { return on.step(request); });
  add("clock.rate", [](const Clock& on, const Json& request) {
    return on.answer(on.control().set_rate(request["rate"].get<double>()));
  });
  add("clock.rewind", [](const Clock& on, const Json& request) { return on.rewind(request); });
  add("clock.goto", [](const Clock& on, const Json& request) { return on.go_to(request); });
  add("clock.back-until",
      [](const Clock& on, const Json& request) { return on.back_until(request); });
  add("clock.until", [](const Clock& on, const Json& request) { return on.until(request); });
}

}  // namespace tandem::apps
