#include "runtime/events.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "hal/sim/emulated_robot.hpp"

namespace tandem::runtime {

std::expected<std::unique_ptr<Events>, Diagnostics> Events::read(std::span<const EventSpec> specs,
                                                                 const std::string& file,
                                                                 const QuantityNames& names) {
  auto events = std::make_unique<Events>();
  Diagnostics errors;
  for (const EventSpec& spec : specs) {
    Event one{.spec = spec, .when = {}, .now = {}, .followed = {}};
    if (spec.at_ns < 0) {
      auto when = Condition::read(spec.when, names);
      if (!when) {
        Error error = when.error();
        error.file = file;
        error.line = spec.when_line;
        error.key = spec.name + ".when";
        errors.push_back(std::move(error));
        continue;
      }
      one.when = std::move(*when);
    }
    events->all_.push_back(std::move(one));
  }
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return events;
}

std::unique_ptr<Events> Events::idle_copy() const {
  auto copy = std::make_unique<Events>();
  for (const Event& one : all_)
    copy->all_.push_back({.spec = one.spec, .when = {}, .now = {}, .followed = {}});
  copy->idle_ = true;
  return copy;
}

std::vector<Events::Row> Events::rows() const {
  std::vector<Row> rows;
  for (const Event& one : all_) rows.push_back({.name = one.spec.name, .when = one.spec.when});
  return rows;
}

bool Events::begin_as(std::span<const std::byte> happened, std::span<const Row> theirs,
                      std::span<const std::string> later, std::int64_t moment_ns) {
  Archive ar(happened);
  bool started = false, ended = false;
  std::vector<State> was(theirs.size());
  ar(started, ended);
  for (State& one : was) ar(one);
  if (!ar.ok() || !ar.at_end()) return false;
  std::vector<Event> begun = all_;
  for (Event& one : begun)
    if (!begins_as(one, was, theirs, is_among(one.spec.row, later), moment_ns)) return false;
  all_ = std::move(begun);
  started_ = started;
  ended_ = ended;
  return true;
}

/// One that comes later has the time at which its condition held, of any row that awaits the same.
bool Events::begins_as(Event& one, const std::vector<State>& was, std::span<const Row> theirs,
                       bool later, std::int64_t moment_ns) {
  const bool at_time = one.spec.at_ns >= 0;
  for (std::size_t i = 0; i < theirs.size() && !(later && at_time); ++i) {
    const bool is_it = later ? theirs[i].when == one.spec.when : theirs[i].name == one.spec.name;
    if (!is_it) continue;
    if (!later) one.now = was[i];
    one.now.held_ns = was[i].held_ns;
    const std::int64_t due_ns = one.now.held_ns + one.spec.after_ns;
    return !later || one.now.held_ns < 0 || due_ns > moment_ns;
  }
  return later && at_time && one.spec.at_ns > moment_ns;
}

bool Events::asks() const noexcept {
  return std::ranges::any_of(all_, [](const Event& one) { return !one.spec.fault; });
}

bool Events::due(const Event& one, std::int64_t time_ns) noexcept TANDEM_RT {
  if (one.now.outcome != Outcome::kNone) return false;
  if (one.spec.at_ns >= 0) return time_ns >= one.spec.at_ns;
  return one.now.held_ns >= 0 && time_ns >= one.now.held_ns + one.spec.after_ns;
}

void Events::note(Event& one, std::int64_t time_ns, std::string_view why) noexcept TANDEM_RT {
  one.now.came_ns = time_ns;
  one.now.outcome = why.empty() ? Outcome::kDone : Outcome::kRefused;
  one.now.why.fill('\0');
  std::copy_n(why.begin(), std::min(why.size(), one.now.why.size() - 1), one.now.why.begin());
}

void Events::take(const hal::CycleView& view) noexcept TANDEM_RT {
  if (idle_ || ended_) return;
  started_ = started_ || view.phase == hal::RunPhase::kRunning;
  ended_ = hal::ends(view.phase);
  if (!started_ || ended_) return;
  const std::int64_t time_ns = view.time.time_ns;
  for (Event& one : all_) {
    if (one.now.outcome != Outcome::kNone) continue;
    const bool waits = one.spec.at_ns < 0 && one.now.held_ns < 0;
    if (waits && one.when.holds(view)) one.now.held_ns = time_ns;
    if (!one.spec.fault || !due(one, time_ns)) continue;
    const Code code = robot_ == nullptr ? Code::kOutOfRange : robot_->inject(*one.spec.fault);
    note(one, time_ns,
         code == Code::kOk          ? ""
         : code == Code::kQueueFull ? "too many faults were injected before it"
                                    : "this robot cannot be struck by it");
  }
}

std::optional<std::size_t> Events::next_ask(std::int64_t time_ns) const noexcept {
  if (idle_ || ended_) return std::nullopt;
  for (std::size_t i = 0; i < all_.size(); ++i)
    if (!all_[i].spec.fault && due(all_[i], time_ns)) return i;
  return std::nullopt;
}

std::string Events::ask(std::size_t event, std::int64_t time_ns) noexcept {
  Event& one = all_[event];
  std::string why;
  try {
    const Status done =
        ask_ ? ask_(one.spec.ask)
             : fail("nobody carries out requests in this program", "run it by `tandem run`");
    if (!done) {
      why = done.error().message;
      if (!done.error().hint.empty()) why += " (" + done.error().hint + ")";
    }
  } catch (const std::exception& error) {
    why = error.what();
  }
  note(one, time_ns, why);
  return why;
}

void Events::follow() noexcept TANDEM_RT {
  for (Event& one : all_) one.followed = one.now;
}

void Events::add_results(bool followed, std::vector<ExpectationResult>& results) const {
  for (const Event& one : all_) {
    const State& state = followed ? one.followed : one.now;
    ExpectationResult result{.name = one.spec.name + " comes",
                             .passed = state.outcome == Outcome::kDone,
                             .unit = {},
                             .reason = {}};
    if (state.came_ns >= 0) result.at_s = static_cast<double>(state.came_ns) / 1e9;
    if (state.outcome == Outcome::kRefused) {
      result.reason = fmt::format("it was refused: {}", state.why.data());
    } else if (state.outcome == Outcome::kNone) {
      result.passed = one.spec.optional;
      const std::int64_t due_ns =
          one.spec.at_ns >= 0 ? one.spec.at_ns : state.held_ns + one.spec.after_ns;
      if (result.passed) {
        result.reason = "did not come (optional)";
      } else {
        result.reason = state.held_ns >= 0 || one.spec.at_ns >= 0
                            ? fmt::format("it has not come, it is due at {:.6g} s",
                                          static_cast<double>(due_ns) / 1e9)
                            : "its condition has not held: " + one.spec.when;
        result.awaits = result.reason;
      }
    }
    results.push_back(std::move(result));
  }
}

void Events::archive(Archive& ar) {
  ar(started_, ended_);
  for (Event& one : all_) ar(one.now);
}

}  // namespace tandem::runtime
