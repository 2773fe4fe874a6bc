#include "runtime/event_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "hal/sim/scenario.hpp"

namespace tandem::runtime {
namespace {

/// When a row comes, and what it is called.
struct EventKeys {
  std::string name, when;
  double at_s = 0.0, after_s = 0.0;
  bool optional = false;
};

using Event = EventKeys;
// A key a line.
// clang-format off
constexpr Key<Event> kWhen[] = {
  key<&Event::name>("name", "for results").by_default("its row: `event[0]`"),
  key<&Event::when>("when", "a [condition](expectations.md#conditions): the event comes after the first cycle in which it holds, once, and not before the controllers start").by_default("–"),
  key<&Event::after_s>("after_s", {0.0, 1e6}, "with `when`: so much later"),
  key<&Event::optional>("optional", "`false`: the run has failed if its condition never held, as if the row were an expectation"),
};
constexpr Key<Event> kAt[] = {
  key<&Event::at_s>("at_s", {0.0, 1e6}, "instead of `when`: the time of the run").by_default("–"),
  by_hand<Event>("ask", "required", "a table", "a request, `{ do = \"controller.set\", … }` ([scenarios.md](scenarios.md#requests))"),
};
// clang-format on

/// Times of a push or a fault, instead of `when`.
constexpr std::array kTimes{"at_s", "at_cycle", "after_enabled_s"};

std::int64_t event_ns(double seconds) { return std::llround(seconds * 1e9); }

/// Every row of a name: results and the log tell them apart by it.
void check_event_name(TomlTable& table, const std::string& name, std::vector<std::string>& names) {
  if (std::ranges::find(names, name) != names.end())
    table.error("name", "two events are called '" + name + "'", "rename one of them");
  names.push_back(name);
}

/// What a condition decides; the rest of the row is still to be read.
EventSpec read_when(TomlTable& table, std::vector<std::string>& names) {
  EventKeys keys;
  read_keys(table, kWhen, keys);
  EventSpec spec;
  spec.name = keys.name.empty() ? table.path() : keys.name;
  spec.row = table.path();
  check_event_name(table, spec.name, names);
  spec.when = keys.when;
  spec.after_ns = event_ns(keys.after_s);
  spec.optional = keys.optional;
  spec.line = table.line();
  spec.when_line = table.line("when");
  if (table.has("when") && keys.when.empty() && table.is_text("when"))
    table.error("when", "is empty", "write a condition, such as \"tilt() > 5deg\"");
  for (const char* const key : {"after_s", "optional"}) {
    if (table.has(key) && !table.has("when"))
      table.error(key, "is of no use without `when`", "leave it out");
  }
  return spec;
}

/// "a bump: push when phase() == running, 2 s later", "softer knee: {"do":…} at 4 s", for people.
std::string happens_text(const EventSpec& spec) {
  const auto seconds = [](std::int64_t ns) {
    return fmt::format("{:g} s", 1e-9 * static_cast<double>(ns));
  };
  const std::string what =
      spec.fault ? std::string(hal::to_string(spec.fault->kind)) : "asks for " + spec.ask;
  std::string when = spec.when.empty() ? "" : " when " + spec.when;
  if (spec.after_ns > 0) when += ", " + seconds(spec.after_ns) + " later";
  if (spec.at_ns >= 0) when = " at " + seconds(spec.at_ns);
  if (spec.when.empty() && spec.fault) {
    when = " at " + seconds(spec.fault->start_ns);
    if (spec.fault->from == sim::FaultFrom::kEnabled) when += " after the drives are enabled";
  }
  return spec.name + ": " + what + when + (spec.optional ? " (optional)" : "");
}

/// A row of [[push]] or [[fault]].
void read_struck(TomlTable& table, hal::FaultKind kind, std::vector<std::string>& names,
                 Experiment& e) {
  EventSpec spec = read_when(table, names);
  const bool waits = table.has("when");
  for (const char* const key : kTimes) {
    if (waits && table.has(key))
      table.error(key, "it comes once, and `when` says when", "keep one of both");
  }
  spec.fault = sim::read_fault(table, e.robot, e.loop.period_ns, e.tree().get(), kind);
  if (spec.fault->kind == hal::FaultKind::kPush) {
    e.pushes.push_back(spec.name);
    spec.fault->number = static_cast<std::uint32_t>(e.pushes.size());
  }
  const auto has = [&table](const char* key) { return table.has(key); };
  if (kind == hal::FaultKind::kPush && !waits && std::ranges::none_of(kTimes, has))
    table.error("", "nothing says when it comes", "add at_s, or when = \"…\"");
  e.happens.push_back(happens_text(spec));
  if (!waits) {
    e.due.push_back({.name = spec.name,
                     .key = table.path(),
                     .at_s = 1e-9 * static_cast<double>(spec.fault->start_ns),
                     .after_enabled = spec.fault->from == sim::FaultFrom::kEnabled,
                     .line = table.line()});
    e.faults.push_back(*spec.fault);
    return e.fault_rows.push_back(spec.row);
  }
  if (spec.fault->kind == hal::FaultKind::kBoardDuplicate) {
    table.error("when", "a board_duplicate has to be there when the robot is made",
                "give it a time, at_s");
  }
  e.events.push_back(std::move(spec));
}

void read_asked(TomlTable& table, std::vector<std::string>& names, Experiment& e) {
  EventSpec spec = read_when(table, names);
  EventKeys keys;
  read_keys(table, kAt, keys);
  if (table.has("at_s")) spec.at_ns = event_ns(keys.at_s);
  if (table.has("at_s") == table.has("when")) {
    table.error(
        table.has("when") ? "at_s" : "",
        table.has("when") ? "it comes once, and `when` says when" : "nothing says when it comes",
        table.has("when") ? "keep one of both" : "add at_s, or when = \"…\"");
  }
  spec.ask = table.json("ask");
  spec.ask_line = table.line("ask");
  table.finish();
  e.happens.push_back(happens_text(spec));
  if (spec.at_ns >= 0)
    e.due.push_back(
        {spec.name, table.path(), 1e-9 * static_cast<double>(spec.at_ns), false, spec.line});
  e.events.push_back(std::move(spec));
}

}  // namespace

void read_events(TomlTable& root, Experiment& e) {
  std::vector<std::string> names;
  for (TomlTable& table : root.tables("fault")) read_struck(table, hal::FaultKind::kNone, names, e);
  for (TomlTable& table : root.tables("push")) read_struck(table, hal::FaultKind::kPush, names, e);
  for (TomlTable& table : root.tables("event")) read_asked(table, names, e);
  const std::size_t most = sim::FaultInjection::kMostFaults;
  const std::size_t count = e.faults.size() + e.events.size();
  if (count > most) {
    root.error(root.has("event")  ? "event"
               : root.has("push") ? "push"
                                  : "fault",
               std::to_string(count) + " events, pushes and faults are too many",
               "at most " + std::to_string(most) + " together");
  }
}

void describe_events(KeyPage& page) {
  page.add("[[event]]", kWhen);
  page.add("[[event]]", kAt);
}

}  // namespace tandem::runtime
