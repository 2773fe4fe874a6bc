// A command to a running process: its question by its row, and who tells its answer.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <numbers>
#include <string_view>

#include "apps/clients/asked.hpp"
#include "apps/clients/commands.hpp"
#include "hal/sim/scenario.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

Status ask_for_fault(const AskedOptions& options, Json& question) {
  question["scenario"] =
      sim::scenario_of_words(options.given["fault"].get<std::vector<std::string>>());
  return {};
}

void print_injected(const Json& answer) {
  fmt::print("{} injected\n", answer.value("injected", 0) == 1 ? "the fault is" : "the faults are");
}

void print_pushed(const Json& /*answer*/) { fmt::print("it is pushed from the next cycle on\n"); }

/// Every single value and list of an answer: of a command that has no words of its own.
void print_values(const Json& answer) {
  tell_done(answer);
  Facts facts;
  for (const auto& [key, value] : answer.items()) {
    if (key == "ok" || key == "done" || key == "cycle" || key == "note") continue;
    if (value.is_array()) {
      std::vector<std::string> all;
      for (const Json& one : value)
        all.push_back(one.is_string() ? one.get<std::string>() : one.dump());
      facts.add(key, all.empty() ? "-" : fmt::format("{}", fmt::join(all, ", ")));
    } else if (!value.is_object()) {
      facts.add(key, value.is_string() ? value.get<std::string>() : value.dump());
    }
  }
  facts.print(stdout);
}

/// A command that does more than send its row's keys, and print_values().
struct Form {
  std::string_view name;
  void (*print)(const Json& answer) = nullptr;
  Result<Exit> (*tell)(Asked&) = nullptr;
  Status (*ask)(const AskedOptions&, Json& question) = nullptr;
};
constexpr Form kForms[]{
    {"clock.back-until", nullptr, &tell_clock_at_rest},
    {"clock.goto", nullptr, &tell_clock_at_rest},
    {"clock.pause", nullptr, &tell_clock_at_rest},
    {"clock.rate", &print_clock},
    {"clock.resume", &print_clock},
    {"clock.rewind", nullptr, &tell_clock_at_rest},
    {"clock.show", &print_clock},
    {"clock.step", nullptr, &tell_clock_at_rest},
    {"clock.until", nullptr, &tell_until},
    {"controller.difference", &print_differences},
    {"controller.list", &print_controllers},
    {"controller.load", nullptr, &tell_loaded, &ask_for_load},
    {"controller.reload", &print_reloaded},
    {"controller.set", &print_set, nullptr, &ask_for_set},
    {"controller.show", &print_controller, nullptr, &ask_for_show},
    {"controller.shadow", &print_shadow},
    {"controller.start", &print_switched, nullptr, &ask_for_start},
    {"controller.stop", &print_switched, nullptr, &ask_for_stop},
    {"controller.switch", nullptr, &tell_switch},
    {"controller.unload", &print_switched},
    {"fault.reset", nullptr, &tell_fault_reset},
    {"fault.show", &print_latched},
    {"inject", &print_injected, nullptr, &ask_for_fault},
    {"input.list", nullptr, &tell_inputs},
    {"input.set", nullptr, &tell_input, &ask_for_input},
    {"joint.gains", &print_joint_gains},
    {"joint.home", nullptr, &tell_homing, &ask_for_motion},
    {"joint.list", nullptr, &tell_joints, &ask_for_list},
    {"joint.move", nullptr, &tell_motion, &ask_for_motion},
    {"joint.recover", &print_recovery},
    {"joint.reset", nullptr, &tell_joint_reset},
    {"joint.set", &print_joint_set},
    {"joint.show", nullptr, &tell_joints},
    {"joint.stop", &print_joint_stop},
    {"joint.tuning", &print_tuning},
    {"predict", nullptr, &tell_prediction},
    {"push", &print_pushed},
    {"sensor.list", nullptr, &tell_sensors},
    {"signal.list", nullptr, &tell_signals},
    {"signal.watch", nullptr, &tell_signal_watch},
    {"top", nullptr, &tell_top},
};

/// The form of a command; of one that has none a plain one.
const Form& form_of(const CommandRow& row) {
  static constexpr Form kPlain{"", &print_values};
  const auto* form = std::ranges::find(kForms, row.name, &Form::name);
  return form == std::end(kForms) ? kPlain : *form;
}

struct Unit {
  const char* name;
  double si;         ///< one of it, in SI units
  const char* kind;  ///< for the run, which knows whether the joint turns or slides; null: a time
};
constexpr Unit kUnits[]{{"deg", std::numbers::pi / 180.0, "angle"},
                        {"mrad", 1e-3, "angle"},
                        {"rad", 1.0, "angle"},
                        {"mm", 1e-3, "length"},
                        {"cm", 1e-2, "length"},
                        {"m", 1.0, "length"}};
constexpr Unit kTimes[]{
    {"s", 1.0, nullptr}, {"ms", 1e-3, nullptr}, {"us", 1e-6, nullptr}, {"min", 60.0, nullptr}};

/// What follows a unit of length or angle.
const char* per(ControlKey::Unit unit) {
  return unit == ControlKey::Unit::kSpeed          ? "/s"
         : unit == ControlKey::Unit::kAcceleration ? "/s2"
                                                   : "";
}

std::string_view without_blanks_around(std::string_view text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// Adds `text`, such as "30deg" or "30 deg", to the question.
Status add_quantity(Json& question, const ControlKey& key, const std::string& text) {
  double number = 0.0;
  std::string_view trimmed = without_blanks_around(text);
  // std::from_chars() knows no plus sign.
  if (trimmed.starts_with('+') && !trimmed.starts_with("+-")) trimmed.remove_prefix(1);
  const char* last = trimmed.data() + trimmed.size();
  const auto [end, error] = std::from_chars(trimmed.data(), last, number);
  const std::string_view unit = without_blanks_around({end, last});
  const bool read = error == std::errc();
  if (error == std::errc::result_out_of_range || (read && !std::isfinite(number))) {
    return fail_at(key.line, fmt::format("'{}' is not finite", text), "give a finite number");
  }
  question[key.name] = number;
  if (read && unit.empty()) return {};
  const bool is_time = key.unit == ControlKey::Unit::kTime;
  for (const Unit& known : is_time ? std::span<const Unit>(kTimes) : std::span(kUnits)) {
    if (!read || unit != std::string(known.name) + per(key.unit)) continue;
    question[key.name] = number * known.si;
    if (known.kind == nullptr) return {};
    if (question.value("unit", known.kind) != known.kind) {
      return fail_at(key.line, fmt::format("'{}' is of another kind than the other values", text),
                     "give angles or lengths, not both");
    }
    question["unit"] = known.kind;
    return {};
  }
  if (is_time) {
    return fail_at(key.line, fmt::format("'{}' is no time", text),
                   "write 2.5s, 300ms, 1min, or a number of seconds");
  }
  return fail_at(
      key.line, fmt::format("'{}' is no number with a unit", text),
      fmt::format("write 30deg{0}, 0.5rad{0}, 20mm{0}, 2cm{0}, 0.02m{0}, or a bare number in SI "
                  "units",
                  per(key.unit)));
}

Result<Json> question_of(const AskedOptions& options, const Form& form) {
  const CommandRow& row = *options.row;
  Json question{{"do", row.more.asks.empty() ? row.name : row.more.asks}};
  for (const ControlKey& key : row.keys) {
    const auto given = options.given.find(key.name);
    if (!key.sent || given == options.given.end()) continue;
    if (key.unit == ControlKey::Unit::kNone) {
      question[key.name] = *given;
    } else if (Status added = add_quantity(question, key, given->get<std::string>()); !added) {
      return std::unexpected(added.error());
    }
  }
  if (form.ask != nullptr) {
    if (Status asked = form.ask(options, question); !asked) return std::unexpected(asked.error());
  }
  return question;
}

}  // namespace

void tell_done(const Json& answer) {
  if (answer.value("done", false) && answer.contains("cycle"))
    fmt::print("done in cycle {}\n", answer.value("cycle", 0));
  if (answer.contains("note")) fmt::print("{}\n", shown(answer.value("note", ""), 2'000));
}

Exit asked_command(const AskedOptions& options) {
  if (options.row->effect == ControlEffect::kStops) return estop_command(options);
  const Form& form = form_of(*options.row);
  Result<Json> question = question_of(options, form);
  if (!question) return refuse(question.error());
  const auto run = ControlClient::open(options.target, options.row->more.any_process ? "" : "run");
  if (!run) return refuse(run.error());
  const bool may_last = answer_time(*question) > std::chrono::minutes(1);
  if (may_last) rt::install_stop_signals();
  Result<Json> answer = (*run)->ask(*question);
  if (!answer && may_last && rt::stop_requested()) {  // nobody waits for it any more
    rt::clear_stop();
    (void)(*run)->ask({{"do", "clock.pause"}});
    return interrupted(SIGINT);
  }
  if (may_last) rt::remove_stop_signals();
  if (!answer) return refuse(answer.error());
  Asked asked{options, **run, std::move(*question), std::move(*answer)};
  Exit exit = Exit::kDone;
  if (asked.prints() && form.print != nullptr) form.print(asked.answer);
  if (form.tell != nullptr) {
    const Result<Exit> told = form.tell(asked);
    if (!told) return refuse(told.error());
    exit = *told;
  }
  return end_with_json(options.json, asked.answer, exit);
}

}  // namespace tandem::apps
