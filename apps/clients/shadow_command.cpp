// tandem controller shadow, difference, and switch, which may wait until a shadow agrees.
#include <fmt/core.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <utility>

#include "apps/clients/asked.hpp"
#include "apps/text/console.hpp"
#include "base/quoting.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

constexpr std::chrono::milliseconds kLookForSwitch{50};

std::string figure(const Json& value) {
  return value.is_number() ? fmt::format("{:.6g}", value.get<double>()) : std::string("-");
}

/// "0.012 rad at LKneeSag", "another mode at LKneeSag".
std::string apart(const Json& waits) {
  const std::string joint =
      shown(waits["joint"].is_string() ? waits["joint"].get<std::string>() : "", 200);
  if (joint.empty() && waits["difference"] == 0.0) return "nothing";
  if (joint.empty()) return "they have not been compared";
  if (!waits["difference"].is_number()) return "another mode at " + joint;
  const std::string unit = waits["unit"].is_string() ? " " + waits["unit"].get<std::string>() : "";
  return figure(waits["difference"]) + unit + " at " + joint;
}

/// What became of the switch that was asked for in `cycle`; null once somebody ends the waiting.
Result<Json> wait_for_switch(ControlClient& run, const Json& cycle) {
  while (!rt::stop_requested()) {
    const Result<Json> answer = run.ask({{"do", "controller.difference"}});
    if (!answer) return answer;
    const Json& last = (*answer)["switch"];
    if (!last.is_object() || last["asked"] != cycle) {
      return fail("another switch was asked for meanwhile, or time went back to before this one",
                  "tandem controller list shows who leads");
    }
    if (last["state"] != "waits") return last;
    std::this_thread::sleep_for(kLookForSwitch);
  }
  return Json();
}

}  // namespace

void print_shadow(const Json& answer) {
  tell_done(answer);
  fmt::print("tandem controller difference {}\n", shown(answer.value("name", ""), 200));
}

/// A row for each reference that leads in its joint's mode, and for others that ever differed.
void print_differences(const Json& answer) {
  if (answer["shadows"].empty()) {
    fmt::print("no controller is a shadow: tandem controller shadow NAME\n");
  }
  if (const Json& last = answer["switch"]; last.is_object() && last["state"] == "waits")
    fmt::print("a switch waits since cycle {}: {}\n", last.value("asked", 0), apart(last));
  for (const Json& shadow : answer["shadows"]) {
    fmt::print("{}: {} calls{}{}\n", shown(shadow.value("name", ""), 200), shadow.value("calls", 0),
               shadow.value("missed", 0) > 0
                   ? fmt::format(", {} cycles had no time left for it", shadow.value("missed", 0))
                   : std::string(),
               shadow["ended"].is_string() ? "; " + shown(shadow.value("ended", ""), 500) : "");
    Table table({"joint", "led by", "reference", "difference", "largest", "largest step"});
    table.align_left();
    for (const Json& joint : shadow["joints"]) {
      bool leads = true;
      for (const Json& one : joint["references"]) {
        const bool differs = one["largest"] != 0.0;
        if (!std::exchange(leads, false) && !differs) continue;
        const std::string owner = joint.value("owner", "");
        table.add({joint.value("joint", ""), owner.empty() ? "nobody" : owner,
                   fmt::format("{} [{}]", one.value("name", ""), one.value("unit", "")),
                   figure(one["difference"]), figure(one["largest"]), figure(one["largest_step"])});
      }
      const bool other = joint["mode"] != joint["commanded_mode"] ||
                         joint["interaction"] != joint["commanded_interaction"];
      if (other) {
        table.add({joint.value("joint", ""), "",
                   fmt::format("mode: {} {} instead of {} {}", joint.value("interaction", ""),
                               joint.value("mode", ""), joint.value("commanded_interaction", ""),
                               joint.value("commanded_mode", "")),
                   "", "", ""});
      }
    }
    if (!shadow["joints"].empty()) table.print(stdout);
  }
}

Result<Exit> tell_switch(Asked& asked) {
  const bool waits = asked.answer.value("waits", false);
  if (!waits || !asked.answer.value("done", false)) {
    if (asked.prints()) print_switched(asked.answer);
    return Exit::kDone;
  }
  rt::install_stop_signals();  // Ctrl-C ends the waiting, not the switch
  if (asked.prints()) {
    fmt::print("waits since cycle {} until they agree\n", asked.answer.value("cycle", 0));
    std::fflush(stdout);  // before the waiting
  }
  const Result<Json> end = wait_for_switch(asked.run, asked.answer["cycle"]);
  if (!end) return std::unexpected(end.error());
  if (end->is_null()) {
    if (asked.prints()) fmt::print("it waits on; tandem controller switch --cancel gives it up\n");
    return Exit::kFault;
  }
  asked.answer["switch"] = *end;
  const bool done = (*end)["state"] == "done";
  asked.answer["done"] = done;  // it was asked for, at first
  if (!asked.prints()) return done ? Exit::kDone : Exit::kFault;
  if (done) {
    fmt::print("done in cycle {}; the largest difference was {}\n", end->value("cycle", 0),
               apart(*end));
  } else if ((*end)["state"] == "time out") {
    fmt::print("nothing has changed: they did not agree in time, at last by {}\n", apart(*end));
  } else if ((*end)["state"] == "refused") {
    fmt::print("nothing has changed: another controller has a joint by now\n");
  } else {
    fmt::print(
        "nothing has changed: it was given up, for one of them is no shadow or not active any "
        "more, "
        "or on request; the log says why\n");
  }
  return done ? Exit::kDone : Exit::kFault;
}

}  // namespace tandem::apps
