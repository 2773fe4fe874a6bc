#include "apps/search/judged_scenarios.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include "apps/search/scenario_rows.hpp"
#include "apps/text/console.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

/// "it held in 12 of 600 cycles" as "it held in  of  cycles": why, whatever the figures.
std::string without_figures(std::string text) {
  std::erase_if(text, [](unsigned char letter) {
    return std::isdigit(letter) != 0 || letter == '.' || letter == '-' || letter == '+';
  });
  return text;
}

}  // namespace

const runtime::ExpectationResult* result_named(const ChildRun& run, const std::string& name) {
  const auto it = std::ranges::find(run.expectations, name, &runtime::ExpectationResult::name);
  return it == run.expectations.end() ? nullptr : &*it;
}

bool Failure::is_of(const ChildRun& run) const {
  const runtime::ExpectationResult* one = result_named(run, expectation.name);
  return one != nullptr && !one->passed && run.ended == ended &&
         without_figures(one->reason) == without_figures(expectation.reason);
}

JudgedScenarios::JudgedScenarios(std::string file, std::size_t jobs, double timeout_s)
    : file_(std::move(file)), runs_(jobs, timeout_s) {}

Result<std::vector<std::optional<ChildRun>>> JudgedScenarios::run_until(
    const std::vector<std::string>& texts, const Wanted& wanted) {
  std::vector<std::optional<ChildRun>> done(texts.size());
  std::size_t next = 0, end = texts.size();  // none from there on counts
  const auto all_known = [&] {
    return std::all_of(done.begin(), done.begin() + static_cast<std::ptrdiff_t>(end),
                       [](const auto& one) { return one.has_value(); });
  };
  while (!all_known() && !rt::stop_requested()) {
    while (next < end && !runs_.is_full()) {
      const std::string candidate = runs_.folder() + "/" + std::to_string(started_) + ".toml";
      auto text = relocated(texts[next], file_, candidate);
      if (!text) return std::unexpected(text.error());
      if (Status written = write_file(candidate, *text); !written)
        return std::unexpected(written.error());
      if (Status started = runs_.start(next, child_words(candidate)); !started)
        return std::unexpected(started.error());
      ++started_;
      ++next;
    }
    for (EndedRun& one : runs_.take_ended()) {
      if (one.number < end && wanted(one.run)) end = one.number + 1;
      done[one.number] = std::move(one.run);
    }
  }
  runs_.end_all();
  done.resize(rt::stop_requested() && !all_known() ? 0 : end);
  return done;
}

Result<std::vector<ChildRun>> JudgedScenarios::run(const std::vector<std::string>& texts) {
  auto done = run_until(texts, [](const ChildRun&) { return false; });
  if (!done) return std::unexpected(done.error());
  std::vector<ChildRun> all;
  for (auto& one : *done) all.push_back(std::move(*one));
  return all;
}

Result<std::optional<EndedRun>> JudgedScenarios::first_failing(
    const std::vector<std::string>& texts, const Failure& failure) {
  auto done = run_until(texts, [&](const ChildRun& run) { return failure.is_of(run); });
  if (!done) return std::unexpected(done.error());
  if (done->empty() || !failure.is_of(*done->back())) return std::optional<EndedRun>();
  return EndedRun{.number = done->size() - 1, .run = std::move(*done->back())};
}

}  // namespace tandem::apps
