#include "apps/run/child_run.hpp"

#include <fmt/format.h>
#include <signal.h>

#include "apps/text/json_reader.hpp"
#include "base/counted.hpp"
#include "base/open_file.hpp"
#include "runtime/condition/expectations.hpp"

namespace tandem::apps {
namespace {

constexpr std::uint64_t kMostResult = std::uint64_t{64} << 20;

std::string last_lines(const std::string& text) {
  constexpr std::size_t kMost = 4'000;
  if (text.size() <= kMost) return text;
  const std::size_t line = text.find('\n', text.size() - kMost);
  return line == std::string::npos ? text.substr(text.size() - kMost) : text.substr(line + 1);
}

/// "run": {"expectations": […]} of a process' JSON.
std::vector<runtime::ExpectationResult> expectations_of(const Json& json) {
  std::vector<runtime::ExpectationResult> all;
  const auto list = json.find("expectations");
  if (list == json.end() || !list->is_array()) return all;
  for (const Json& one : *list) {
    runtime::ExpectationResult result;
    result.name = one.value("name", "");
    result.passed = one.value("passed", false);
    result.unit = one.value("unit", "");
    result.reason = one.value("reason", "");
    result.joint = one.value("joint", "");
    if (one["margin"].is_number()) result.margin = one["margin"].get<double>();
    if (one["at_s"].is_number()) result.at_s = one["at_s"].get<double>();
    all.push_back(std::move(result));
  }
  return all;
}

/// The first of its errors; empty: it says none.
std::string first_error(const Json& json) {
  const auto list = json.find("errors");
  if (list == json.end() || !list->is_array() || list->empty()) return {};
  const Json& first = list->front();
  return Error{.message = first.value("message", ""),
               .hint = first.value("hint", ""),
               .file = first.value("file", ""),
               .line = first.value("line", 0),
               .key = first.value("key", "")}
      .to_string();
}

}  // namespace

ChildRun child_run(const std::string& json_file, const std::string& output_file, int status,
                   double limit_s) {
  ChildRun run;
  const auto text = read_file(json_file, "", kMostResult);
  const auto json = text ? read_json_object(*text) : Result<Json>(Json::object());
  const Json result = json ? *json : Json::object();
  run.expectations = expectations_of(result);
  const std::size_t failures = runtime::failed(run.expectations);
  const auto lost = result.value("never_injected", std::size_t{0});
  if (const auto ended = result.find("ended"); ended != result.end() && ended->is_string())
    run.ended = ended->get<std::string>();
  if (const auto begins = result.find("begins_s"); begins != result.end() && begins->is_number())
    run.begins_s = begins->get<double>();
  // Faults at times are no rows of it: that they came is `lost`.
  const bool judged = !run.expectations.empty() || result.contains("never_injected");
  run.passed = status == 0 && limit_s == 0.0 && judged && failures == 0 && lost == 0;
  if (run.passed) return run;
  if (const auto said = read_file(output_file, "", kMostResult)) run.said = last_lines(*said);
  const std::string error = first_error(result);
  if (limit_s > 0.0) {
    run.ended = "too slow";
    run.limit_s = limit_s;
    run.reason = fmt::format("it was ended after {:g} s", limit_s);
  } else if (status >= 128) {
    const char* name = ::sigabbrev_np(status - 128);
    run.ended = "crashed";
    run.killed = status == 128 + SIGKILL || status == 128 + SIGTERM || status == 128 + SIGINT;
    run.reason =
        fmt::format("crashed: {}", name == nullptr ? "by a signal" : std::string("SIG") + name);
  } else if (!error.empty()) {
    run.ended = status == static_cast<int>(Exit::kUsage) ? "refused" : "crashed";
    run.reason = error;
  } else if (run.ended == "by a fault" && failures == 0) {
    run.reason = "it ended by a fault that no expectation awaits";
  } else if (failures == 0 && lost > 0) {
    run.reason = fmt::format("{} of its scenario never came: due after its end",
                             counted(lost, "fault or push", "faults or pushes"));
  } else if (failures == 0) {
    run.reason = fmt::format("its process ended with status {}", status);
  }
  if (run.ended.empty()) run.ended = "refused";
  return run;
}

RunOptions child_options(const std::string& experiment) {
  RunOptions options;
  options.experiment = experiment;
  options.hal = "sim";
  options.rate = 0.0;
  options.no_log = true;
  options.no_socket = true;
  options.quiet = true;
  return options;
}

std::vector<std::string> child_words(const std::string& experiment) {
  return {"run", experiment, "--hal", "sim", "--rate", "0", "--no-log", "--no-socket"};
}

}  // namespace tandem::apps
