// tandem clock show|pause|resume|step|rate: what it asks a running process, and its answer.
#include <fmt/core.h>

#include <chrono>
#include <thread>

#include "apps/clients/asked.hpp"
#include "apps/text/figures.hpp"
#include "base/counted.hpp"

namespace tandem::apps {
namespace {

/// What the clock shows once it stands; before that, when somebody lets it go on or the run ends.
Result<Json> wait_until_it_stands(ControlClient& run, std::FILE* out) {
  StatusLine line(out);
  for (;;) {
    Result<Json> now = run.ask({{"do", "clock.show"}});
    if (!now || now->value("standing", true) || !now->value("paused", false) ||
        now->value("phase", "") == "done") {
      return now;
    }
    if (line.due()) {
      line.show(fmt::format("{:.3f} s, {} to go", now->value("time_s", 0.0),
                            counted(now->value("pending_steps", std::uint64_t{0}), "cycle")));
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

}  // namespace

void print_clock(const Json& answer) {
  Facts facts;
  add_figures(facts, answer,
              {{"time", "{time_s:.6f s}"}, {"cycles", "{cycles}"}, {"phase", "{phase}"}});
  facts.add("clock", state_text(answer));
  facts.add("rate", rate_text(answer));
  facts.add("measured", figures_text("{realtime_factor:.3g} x real time", answer).value_or("-"));
  facts.print(stdout);
}

Result<Exit> tell_clock_at_rest(Asked& asked) {
  Result<Json> stands = wait_until_it_stands(asked.run, human_output(asked.options.json));
  if (!stands) return fail("the run ended before its clock stood still", "its own output says why");
  if (asked.answer.contains("dropped_steps")) {
    (*stands)["dropped_steps"] = asked.answer["dropped_steps"];
  }
  asked.answer = std::move(*stands);
  if (asked.prints()) print_clock(asked.answer);
  return Exit::kDone;
}

}  // namespace tandem::apps
