// tandem clock show|pause|resume|step|rate: what it asks a running process, and its answer.
#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "apps/clients/asked.hpp"
#include "apps/text/figures.hpp"
#include "base/counted.hpp"

namespace tandem::apps {
namespace {

/// What the clock shows once it stands; before that, when somebody lets it go on or the run ends.
/// @param paused  false: it goes on until something comes
/// @param until   what that is; it is over when another condition is waited for instead, or none
Result<Json> wait_until_it_stands(ControlClient& run, std::FILE* out, bool paused = true,
                                  const std::string& until = {}) {
  StatusLine line(out);
  for (;;) {
    Result<Json> now = run.ask({{"do", "clock.show"}});
    if (!now || now->value("standing", true) || (paused && !now->value("paused", false)) ||
        now->value("phase", "") == "done" || now->value("until", "") != until) {
      return now;
    }
    if (line.due()) {
      const std::uint64_t steps = now->value("pending_steps", std::uint64_t{0});
      line.show(fmt::format("{:.3f} s{}", now->value("time_s", 0.0),
                            paused ? ", " + counted(steps, "cycle") + " to go" : ""));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

std::string rate_text(const Json& answer) {
  const double rate = answer.value("rate", 0.0);
  return rate > 0.0 ? fmt::format("{:g} x real time", rate) : "free running";
}

std::string state_text(const Json& answer) {
  if (answer.value("clock", "") != "simulated") return "real time, which cannot be paused";
  if (!answer.value("paused", false)) return "running";
  const std::uint64_t steps = answer.value("pending_steps", std::uint64_t{0});
  if (answer.value("standing", false)) return "paused";
  return steps > 0 ? "paused, " + counted(steps, "cycle") + " to go" : "paused after this cycle";
}

std::string past_text(const Json& past) {
  const auto count = past.value("checkpoints", std::uint64_t{0});
  if (count == 0) return past.value("keeps", false) ? "kept from now on" : "not kept";
  return fmt::format("from {:.6g} s on, by {} of {:.3g} MB in all", past.value("from_s", 0.0),
                     counted(count, "checkpoint"), 1e-6 * past.value("bytes", 0.0));
}

void print_figures(const Json& answer) {
  Facts facts;
  add_figures(facts, answer,
              {{"time", "{time_s:.6f s}"}, {"cycles", "{cycles}"}, {"phase", "{phase}"}});
  facts.add("clock", state_text(answer));
  facts.add("rate", rate_text(answer));
  if (answer.contains("until")) facts.add("goes on until", shown(answer.value("until", "")));
  if (answer.contains("past")) facts.add("past", past_text(answer["past"]));
  if (answer.contains("from_s")) {
    facts.add("came from",
              fmt::format("{:.6f} s, {} played again in {:.0f} ms", answer.value("from_s", 0.0),
                          counted(answer.value("replayed_cycles", std::uint64_t{0}), "cycle"),
                          answer.value("took_ms", 0.0)));
  }
  facts.add("measured", figures_text("{realtime_factor:.3g} x real time", answer).value_or("-"));
  facts.print(stdout);
}

void print_note(const Json& answer, std::FILE* out) {
  if (!answer.contains("note")) return;
  fmt::print(out, "note: {}\n", answer.value("note", ""));
  std::fflush(out);
}

/// What the commands' own answers have beside the clock.
constexpr const char* kOfTheCommand[]{"dropped_steps",   "from_s",  "asked_s",
                                      "replayed_cycles", "took_ms", "note"};

/// Another client may have paused it before, or taken it elsewhere.
Status is_where_asked(const Asked& asked, const Json& stands, bool paused) {
  const double now_s = stands.value("time_s", 0.0);
  const char* const others = "another client paused it, or took it elsewhere: ask again";
  const std::string condition = asked.question.value("condition", "");
  if (!paused && stands.value("until_met", "") != condition) {
    if (!stands.value("standing", false))
      return fail("another client gave this condition up, or waits for another one by now", others);
    return fail(
        fmt::format("time stands at {:.6g} s, and the condition has not become true", now_s),
        others);
  }
  const double to_s = asked.question.value("to_s", now_s);
  if (std::abs(to_s - now_s) < 0.5 * stands.value("period_s", 0.0)) return {};
  if (!asked.question.contains("to_s")) return {};
  return fail(fmt::format("time stands at {:.6g} s, not at {:.6g} s", now_s, to_s), others);
}

Result<Exit> tell_at_rest(Asked& asked, bool paused, const char* over) {
  Result<Json> stands =
      wait_until_it_stands(asked.run, human_output(asked.options.json), paused,
                           paused ? std::string() : asked.question.value("condition", ""));
  if (!stands) return fail(over, "its own output says why");
  if (!paused && stands->value("phase", "") == "done" && !stands->value("standing", false))
    return fail(over, "tandem report shows its log");
  if (const Status there = is_where_asked(asked, *stands, paused); !there)
    return std::unexpected(there.error());
  for (const char* key : kOfTheCommand) {
    if (asked.answer.contains(key)) (*stands)[key] = asked.answer[key];
  }
  asked.answer = std::move(*stands);
  if (!asked.prints()) return Exit::kDone;
  print_figures(asked.answer);
  if (paused) print_note(asked.answer, stdout);
  return Exit::kDone;
}

}  // namespace

void print_clock(const Json& answer) {
  print_figures(answer);
  print_note(answer, stdout);
}

Result<Exit> tell_clock_at_rest(Asked& asked) {
  return tell_at_rest(asked, true, "the run ended before its clock stood still");
}

Result<Exit> tell_until(Asked& asked) {
  if (asked.question.value("cancel", false)) {
    if (asked.prints()) print_clock(asked.answer);
    return Exit::kDone;
  }
  print_note(asked.answer, human_output(asked.options.json));  // now: it may wait for long
  return tell_at_rest(asked, false, "the run ended before the condition became true");
}

}  // namespace tandem::apps
