// Asking the loop for parameters of controllers: what they are, and whether a value fits.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/nearest.hpp"
#include "runtime/run_services.hpp"

namespace tandem::runtime {
namespace {

using Is = ParameterValue::Is;

/// "give 0 to 500 Nm/rad".
std::string range_hint(const ParameterRow& row) {
  const ParameterFacts& facts = row.facts;
  const bool below = facts.min > kAnyNumber.min, above = facts.max < kAnyNumber.max;
  const std::string unit = facts.unit.empty() ? "" : " " + facts.unit;
  const std::string what = facts.whole ? "whole numbers, " : "";
  if (below && above) {
    return fmt::format("give {}{}{:g} to {:g}{}", what, facts.above_min ? "more than " : "",
                       facts.min, facts.max, unit);
  }
  if (below) {
    return fmt::format("give {}{:g}{}{}", facts.above_min ? "more than " : "", facts.min, unit,
                       facts.above_min ? "" : " or more");
  }
  if (above) return fmt::format("give {}at most {:g}{}", what, facts.max, unit);
  return facts.whole ? "give a whole number" : "give a number" + (unit.empty() ? "" : ":" + unit);
}

std::string text_of(const ParameterValue& value) {
  switch (value.is) {
    case Is::kNumber: return fmt::format("{:g}", value.number);
    case Is::kBoolean: return value.number == 1.0 ? "true" : "false";
    case Is::kText: return "'" + value.text.substr(0, kMostNamed) + "'";
    case Is::kNumbers: return "a list";
    case Is::kNothing: break;
  }
  return "nothing";
}

/// What the parameter holds for `given`.
/// @param key  of errors: "squat.kp"
Result<double> fit(const ParameterRow& row, const ParameterValue& given, const std::string& key) {
  const auto wrong = [&](const std::string& message, const std::string& hint) {
    return fail_at(key, message, hint);
  };
  if (row.type == ParameterType::kChoice) {
    const auto& choices = row.facts.choices;
    const auto found = std::ranges::find(choices, given.text);
    if (given.is == Is::kText && found != choices.end())
      return static_cast<double>(found - choices.begin());
    return wrong(text_of(given) + " is none of its words", suggest(given.text, choices));
  }
  if (row.type == ParameterType::kBoolean) {
    if (given.is == Is::kBoolean) return given.number;
    return wrong("is true or false, not " + text_of(given), "give true or false");
  }
  if (given.is != Is::kNumber) return wrong("is a number, not " + text_of(given), range_hint(row));
  const double value = given.number;
  if (!std::isfinite(value)) return wrong("has to be finite", range_hint(row));
  if (row.type == ParameterType::kInteger && value != std::floor(value))
    return wrong(text_of(given) + " is no whole number", range_hint(row));
  if (row.fits(value)) return value;
  return wrong(text_of(given) + " is out of range", range_hint(row));
}

/// What to do about a name that no parameter has: elements are suggested in the list's name only.
std::string nearest(const std::string& name, const std::deque<ParameterRow>& rows) {
  std::vector<std::string> names, elements;
  for (const ParameterRow& row : rows) {
    const std::string& one = row.list.empty() ? row.name : row.list;
    if (names.empty() || names.back() != one) names.push_back(one);
    if (!row.list.empty() && name.starts_with(row.list + ".")) elements.push_back(row.name);
  }
  if (names.empty()) return "it has none: setup.parameter() declares them";
  return suggest(name, elements.empty() ? names : elements);
}

std::string elements_of(const std::vector<ParameterRow*>& list) {
  std::vector<std::string> names;
  for (const ParameterRow* one : list) names.push_back(one->element());
  return fmt::format("{}", fmt::join(names, ", "));
}

std::unexpected<Error> too_many(std::size_t parameters) {
  return fail(fmt::format("sets {} parameters at once", parameters),
              fmt::format("set at most {}; each element of a list is one", kMostParameterChanges));
}

}  // namespace

Result<std::vector<ParameterStatus>> RunServices::parameters(const std::string& controller) {
  const Lock lock(mutex_);
  collect();
  const Result<std::size_t> slot = slot_of(controller);
  if (!slot) return std::unexpected(slot.error());
  std::vector<ParameterStatus> all;
  for (const ParameterRow& row : host_->owned()[*slot]->io->parameters.rows()) {
    all.push_back({.name = row.name,
                   .list = row.list,
                   .facts = row.facts,
                   .type = row.type,
                   .otherwise = row.otherwise,
                   .value = row.now()});
  }
  return all;
}

/// Adds what `wish` sets: a parameter, an element of a list, or every element of it.
Status RunServices::add_changes(const ParameterWish& wish,
                                std::vector<ParameterChange>& changes) const {
  const Result<std::size_t> slot = slot_of(wish.controller);
  if (!slot) return std::unexpected(slot.error());
  auto& rows = host_->owned()[*slot]->io->parameters.rows();
  const std::string key = (wish.controller + "." + wish.parameter).substr(0, 3 * kMostNamed);
  std::vector<ParameterRow*> named;
  for (ParameterRow& row : rows) {
    if (row.name == wish.parameter || row.list == wish.parameter) named.push_back(&row);
  }
  if (named.empty()) {
    return fail_at(key, "the controller has no such parameter", nearest(wish.parameter, rows));
  }
  const std::vector<double>& numbers = wish.value.numbers;
  const bool is_list = !named.front()->list.empty() && named.front()->name != wish.parameter;
  const bool each = is_list && wish.value.is == Is::kNumbers;
  if (each && numbers.size() != named.size()) {
    return fail_at(key, fmt::format("has {} elements, not {}", named.size(), numbers.size()),
                   "give one number for all, or one for each of " + elements_of(named));
  }
  for (std::size_t i = 0; i < named.size(); ++i) {
    const std::string full = wish.controller + "." + named[i]->name;
    const ParameterValue given = each ? ParameterValue(numbers[i]) : wish.value;
    const Result<double> value = fit(*named[i], given, full);
    if (!value) return std::unexpected(value.error());
    if (!named[i]->facts.live) {
      return fail_at(
          key, "is not live: it is read when the controller is loaded",
          "give it in the experiment's file, or unload the controller and load it with another "
          "value");
    }
    if (std::ranges::find(changes, named[i], &ParameterChange::parameter) != changes.end())
      return fail_at(full, "is named twice", "name it once");
    changes.push_back({.slot = *slot, .parameter = named[i], .value = *value, .name = full});
  }
  return {};
}

Result<RequestResult> RunServices::set_parameters(const std::vector<ParameterWish>& wishes,
                                                  Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  if (wishes.empty()) return fail("no parameter is named", "name those to set: kp=40");
  if (wishes.size() > kMostParameterChanges) return too_many(wishes.size());
  std::vector<ParameterChange> changes;
  for (const ParameterWish& wish : wishes) {
    if (Status fits = add_changes(wish, changes); !fits) return std::unexpected(fits.error());
  }
  if (changes.size() > kMostParameterChanges) return too_many(changes.size());
  changes_.push_back(std::make_unique<const std::vector<ParameterChange>>(std::move(changes)));
  return ask(lock, {.kind = CycleRequest::Kind::kSet, .changes = changes_.back().get()}, patience);
}

void RunServices::forget_changes(const CycleRequest& request) {
  if (request.changes == nullptr) return;
  std::erase_if(changes_, [&](const auto& one) { return one.get() == request.changes; });
}

}  // namespace tandem::runtime
