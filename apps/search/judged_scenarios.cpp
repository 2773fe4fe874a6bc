#include "apps/search/judged_scenarios.hpp"

#include <fmt/format.h>

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

JudgedScenarios::JudgedScenarios(std::string file, std::size_t jobs, double timeout_s,
                                 bool branches)
    : file_(std::move(file)),
      trunks_(branches ? ScenarioText::later_kinds() : std::vector<std::string>()),
      workers_(scratch_.below("work"), jobs, timeout_s) {}

Status JudgedScenarios::write_down(const std::vector<std::string>& texts,
                                   std::vector<RunOptions>& options,
                                   std::vector<std::string>& common) {
  for (const std::string& text : texts) {
    const std::string file = fmt::format("{}/{}.toml", scratch_.path(), written_++);
    const auto moved = relocated(text, file_, file);
    if (!moved) return std::unexpected(moved.error());
    if (Status written = write_file(file, *moved); !written) return written;
    const auto rows = ScenarioText::read(*moved, file);
    if (!rows) return std::unexpected(rows.error());
    options.push_back(child_options(file));
    common.push_back(rows->without_later());
    trunks_.want(common.back(), options.back());
  }
  if (std::exchange(is_loaded_, true)) return trunks_.grow(workers_);
  loaded_ = load_run(child_options(file_));
  if (loaded_.world != nullptr) workers_.read_instead(loaded_.texts);
  return {};  // it is run as it is, first
}

Result<std::vector<std::optional<ChildRun>>> JudgedScenarios::run_until(
    const std::vector<std::string>& texts, const Wanted& wanted) {
  if (Status made = scratch_.made(); !made) return std::unexpected(made.error());
  std::vector<RunOptions> options;
  std::vector<std::string> common;
  if (Status written = write_down(texts, options, common); !written)
    return std::unexpected(written.error());
  std::vector<std::optional<ChildRun>> done(texts.size());
  std::size_t next = 0, end = texts.size();  // none from there on counts
  const auto all_known = [&] {
    return std::all_of(done.begin(), done.begin() + static_cast<std::ptrdiff_t>(end),
                       [](const auto& one) { return one.has_value(); });
  };
  while (!all_known() && !rt::stop_requested()) {
    while (next < end && !workers_.is_full()) {
      trunks_.begin_in(common[next], options[next]);
      if (Status started = workers_.start(next, options[next]); !started)
        return std::unexpected(started.error());
      ++started_;
      ++next;
    }
    auto ended = workers_.take_ended();
    if (!ended) return std::unexpected(ended.error());
    for (EndedRun& one : *ended) {
      if (one.number < end && wanted(one.run)) end = one.number + 1;
      if (one.run.begins_s > 0.0) ++branched_;
      done[one.number] = std::move(one.run);
    }
  }
  workers_.end_all();
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
