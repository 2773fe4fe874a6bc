// tandem input: a sample for an input of a controller, and what every input holds.
#include <fmt/core.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>

#include "apps/clients/asked.hpp"
#include "apps/clients/named.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"

namespace tandem::apps {
namespace {

/// Like a person's hand on a stick, and well within the usual time-out.
constexpr std::chrono::milliseconds kAgain{100};

Result<double> finite_number(const std::string& text) {
  double number = 0.0;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error == std::errc() && end == last && std::isfinite(number)) return number;
  return fail("'" + text + "' is no finite number", "write x=0.2");
}

/// "1.0,0.3,0.2" as a way-point.
Result<Json> point_of(const std::string& text) {
  Json numbers = Json::array();
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto number = finite_number(text.substr(begin, end - begin));
    if (!number) return std::unexpected(number.error());
    numbers.push_back(*number);
    begin = end + 1;
  }
  const double after_s = numbers.front().get<double>();
  numbers.erase(numbers.begin());
  return Json{{"after_s", after_s}, {"position_rad", std::move(numbers)}};
}

std::string shown_values(const Json& input) {
  if (input.contains("points")) return counted(input["points"].size(), "way-point");
  std::string text;
  for (const auto& [name, value] : input["values"].items()) {
    text += fmt::format("{}{}={:.4g}", text.empty() ? "" : " ", name, value.get<double>());
  }
  return text;
}

std::string freshness_of(const Json& input) {
  if (!input.value("active", false)) return "inactive";
  if (input.value("sequence", 0U) == 0) return "no sample yet";
  return input.value("fresh", false) ? "fresh" : "timed out";
}

}  // namespace

Status ask_for_input(const AskedOptions& options, Json& question) {
  const auto given = [&](const char* key) {
    return options.given.value(key, std::vector<std::string>());
  };
  if (!question.contains("name")) {
    return fail("name the input", "tandem input list shows every one");
  }
  if (given("components").empty() == given("point").empty()) {
    return fail("give values, or the way-points of a trajectory",
                "tandem input NAME x=0.2 yaw=0.1; tandem input NAME --point 1.0,0.3,0.2");
  }
  for (const std::string& word : given("components")) {
    const std::size_t sign = word.find('=');
    if (sign == std::string::npos || sign == 0) {
      return fail("'" + word + "' is not COMPONENT=NUMBER", "write x=0.2");
    }
    const std::string component = word.substr(0, sign), text = word.substr(sign + 1);
    if (question.contains("values") && question["values"].contains(component)) {
      return fail("'" + component + "' is given twice", "give each component once");
    }
    // What is no number goes as it is: the run knows the component's unit, and says it.
    if (const auto number = finite_number(text)) {
      question["values"][component] = *number;
    } else {
      question["values"][component] = text;
    }
  }
  for (const std::string& text : given("point")) {
    auto point = point_of(text);
    if (!point) return std::unexpected(point.error());
    question["trajectory"]["points"].push_back(std::move(*point));
  }
  return {};
}

Result<Exit> tell_input(Asked& asked) {
  using Clock = std::chrono::steady_clock;
  const std::chrono::duration<double> for_s(asked.options.given.value("for_s", 0.0));
  const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(for_s);
  while (Clock::now() + kAgain < until) {
    std::this_thread::sleep_for(kAgain);
    Result<Json> again = asked.run.ask(asked.question);
    if (!again) return std::unexpected(again.error());
    asked.answer = std::move(*again);
  }
  if (asked.prints()) tell_done(asked.answer);
  return Exit::kDone;
}

Result<Exit> tell_inputs(Asked& asked) {
  const Result<Json> some = named(asked.answer["inputs"], "input", asked.texts("inputs"));
  if (!some) return std::unexpected(some.error());
  asked.answer["inputs"] = *some;
  if (!asked.prints()) return Exit::kDone;
  if (some->empty()) {
    fmt::print("no loaded controller has an input\n");
    return Exit::kDone;
  }
  Table table({"input", "controller", "kind", "source", "state", "samples", "superseded", "refused",
               "holds", "last refused"});
  table.align_left();
  for (const Json& input : *some) {
    table.add(
        {input.value("input", ""), input.value("controller", ""), input.value("kind", ""),
         input.value("source", ""), freshness_of(input), std::to_string(input.value("arrived", 0U)),
         std::to_string(input.value("superseded", 0U)), std::to_string(input.value("refused", 0U)),
         shown_values(input), input.value("why", "")});
  }
  table.print(stdout);
  return Exit::kDone;
}

}  // namespace tandem::apps
