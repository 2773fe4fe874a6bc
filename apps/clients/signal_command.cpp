// tandem signal list, watch: what they ask a running run, and its answers.
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "apps/clients/asked.hpp"
#include "apps/text/console.hpp"
#include "base/nearest.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

std::string number_text(const Json& value) {
  return value.is_number() ? fmt::format("{:.6g}", value.get<double>()) : "nan";
}

/// "0.12", "0.1 0.2 -0.3", "0.1 0.2 0.3 … (29)"
std::string values_of(const Json& signal) {
  constexpr std::size_t kMost = 4;
  const Json& values = signal["values"];
  if (signal["cycle"].is_null()) return "-";
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, values.size()); ++i)
    text += (i == 0 ? "" : " ") + number_text(values[i]);
  return values.size() > kMost ? fmt::format("{} … ({})", text, values.size()) : text;
}

/// The signals that are named, as "squat.depth" or, all of one, "squat".
Result<Json> chosen(const Json& all, const std::vector<std::string>& wanted) {
  if (wanted.empty()) return all;
  std::vector<std::string> known;
  for (const Json& one : all) {
    const std::string controller = one.value("controller", "");
    if (std::ranges::find(known, controller) == known.end()) known.push_back(controller);
    known.push_back(one.value("signal", ""));
  }
  Json some = Json::array();
  for (const std::string& name : wanted) {
    const std::size_t before = some.size();
    for (const Json& one : all) {
      if (one["signal"] == name || one["controller"] == name) some.push_back(one);
    }
    if (some.size() > before) continue;
    return fail(fmt::format("no loaded controller has a signal '{}'", name),
                known.empty() ? "no loaded controller declares one" : suggest(name, known));
  }
  return some;
}

void print_head(const Json& signals) {
  std::string line = "time_s";
  for (const Json& one : signals) {
    const std::string unit = one.value("unit", "");
    const std::string controller = one.value("controller", "");
    for (const Json& name : one["names"]) {
      line += fmt::format("  {}.{}{}", shown(controller), shown(name.get<std::string>()),
                          unit.empty() ? "" : " [" + shown(unit) + "]");
    }
  }
  fmt::print("{}\n", line);
}

void print_line(const Json& signals) {
  const Json& time_s = signals.front()["time_s"];
  std::string line = time_s.is_null() ? "-" : fmt::format("{:.3f}", time_s.get<double>());
  for (const Json& one : signals) {
    for (const Json& value : one["values"]) line += "  " + number_text(value);
  }
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

}  // namespace

Result<Exit> tell_signals(Asked& asked) {
  const Result<Json> some = chosen(asked.answer["signals"], asked.texts("signals"));
  if (!some) return std::unexpected(some.error());
  asked.answer["signals"] = *some;
  if (!asked.prints()) return Exit::kDone;
  if (some->empty()) {
    fmt::print("no loaded controller declares a signal\n");
    return Exit::kDone;
  }
  Table table({"signal", "unit", "value", "meaning"});
  table.align_left();
  for (const Json& one : *some) {
    table.add(
        {one.value("signal", ""), one.value("unit", ""), values_of(one), one.value("doc", "")});
  }
  table.print(stdout);
  return Exit::kDone;
}

/// The end of the run ends it, too.
Result<Exit> tell_signal_watch(Asked& asked) {
  rt::install_stop_signals();
  const auto every = std::chrono::duration<double>(asked.options.given.value("every", 0.1));
  std::uint64_t left = asked.options.given.value("count", std::uint64_t{0});
  const bool endless = left == 0;
  Result<Json> signals = chosen(asked.answer["signals"], asked.texts("signals"));
  if (!signals) return std::unexpected(signals.error());
  if (signals->empty()) return fail("no loaded controller declares a signal");
  if (asked.prints()) print_head(*signals);
  auto due = std::chrono::steady_clock::now();
  while (signals && !signals->empty()) {
    if (asked.prints()) print_line(*signals);
    if (!endless && --left == 0) break;
    due += std::chrono::duration_cast<std::chrono::steady_clock::duration>(every);
    std::this_thread::sleep_until(due);
    if (rt::stop_requested()) break;
    Result<Json> answer = asked.run.ask(asked.question);
    if (!answer) break;  // the run has ended
    asked.answer = std::move(*answer);
    signals = chosen(asked.answer["signals"], asked.texts("signals"));
  }
  if (signals) asked.answer["signals"] = *signals;
  return Exit::kDone;
}

}  // namespace tandem::apps
