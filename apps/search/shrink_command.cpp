// `tandem shrink`: a failing scenario with the fewest and smallest events that still fails.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <utility>

#include "apps/search/commands.hpp"
#include "apps/search/judged_scenarios.hpp"
#include "apps/search/point_runs.hpp"
#include "apps/search/shrink.hpp"
#include "apps/text/draft.hpp"
#include "apps/text/relative_path.hpp"
#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "base/toml_reader.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/condition/expectations.hpp"

namespace tandem::apps {
namespace {

constexpr char kShrunkBy[] = "# Shrunk by `tandem shrink` from ";

/// Without what a former shrinking wrote above it.
std::string without_its_words(const std::string& text) {
  if (!text.starts_with(kShrunkBy)) return text;
  const std::size_t end = text.find("\n\n");
  return end == std::string::npos ? text : text.substr(end + 2);
}

class Shrinking {
 public:
  Shrinking(const ShrinkOptions& options, std::string output, ScenarioText scenario)
      : options_(options),
        output_(std::move(output)),
        out_(human_output(options.json)),
        scenario_(std::move(scenario)),
        runs_(options.scenario, options.jobs, options.timeout_s, options.branches) {}

  Exit shrink() {
    const auto begin = std::chrono::steady_clock::now();
    if (const Status fails = find_failure(); !fails) return refuse(fails.error());
    if (rt::stop_requested()) return interrupted(rt::stop_signal());
    tell(scenario_.rows());
    const ScenarioRows rows =
        shrunk(scenario_.rows(), [this](const auto& all) { return first_of(all); });
    if (!asked_) return refuse(asked_.error());
    result_.events = rows.size();
    result_.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    result_.runs = runs_.runs();
    result_.branched = runs_.branched();
    result_.trunks = runs_.trunks();
    if (const Status written = write(rows); !written) return refuse(written.error());
    print(rows);
    const Status written = write_json(options_.json, figures_json(result_));
    if (!written) return refuse(written.error());
    return rt::stop_requested() ? interrupted(rt::stop_signal()) : Exit::kDone;
  }

 private:
  [[nodiscard]] Error wrong(std::string message, std::string hint) const {
    return {.message = std::move(message),
            .hint = std::move(hint),
            .file = options_.scenario,
            .key = {}};
  }

  /// Runs the scenario as it is, twice: what changes by itself cannot be shrunk.
  Status find_failure() {
    const std::string whole = scenario_.with(scenario_.rows());
    const auto both = runs_.run({whole, whole});
    if (!both) return std::unexpected(both.error());
    if (both->size() < 2) return {};  // a stop was asked for
    const ChildRun& run = both->front();
    if (run.expectations.empty()) {
      return std::unexpected(
          wrong("cannot be run: " + run.reason, "see: " + command_of_run(options_.scenario)));
    }
    if (run.expectations != both->back().expectations || run.ended != both->back().ended) {
      return std::unexpected(
          wrong("two runs of it differ: something in it does not follow its seed",
                "leave out what depends on the computer, such as overruns()"));
    }
    return choose(run);
  }

  /// Which expectation has to fail.
  Status choose(const ChildRun& run) {
    std::vector<std::string> names;
    const runtime::ExpectationResult* first = nullptr;
    for (const runtime::ExpectationResult& one : run.expectations) {
      names.push_back(one.name);
      if (!one.passed && (first == nullptr || one.name == options_.expect)) first = &one;
    }
    const runtime::ExpectationResult* named = result_named(run, options_.expect);
    if (!options_.expect.empty() && named == nullptr) {
      return std::unexpected(
          wrong("it expects no '" + options_.expect + "'", suggest(options_.expect, names)));
    }
    if (named != nullptr && named->passed) {
      const std::string fails = first == nullptr ? "" : "it fails '" + first->name + "'";
      return std::unexpected(wrong("'" + named->name + "' " + runtime::in_words(*named),
                                   fails.empty() ? "give a scenario that fails" : fails));
    }
    if (first == nullptr) {
      const bool otherwise = !run.passed;
      return std::unexpected(
          wrong(otherwise ? "no expectation of it fails: " + run.reason
                          : fmt::format("it passes all of its {}",
                                        counted(run.expectations.size(), "expectation")),
                otherwise ? "expect that, such as never = \"fault(any)\""
                          : "give a scenario that fails; `tandem search` looks for one"));
    }
    failure_ = {.expectation = *first, .ended = run.ended};
    result_.expectation = *first;
    result_.events_before = scenario_.rows().size();
    return {};
  }

  /// The first that still fails.
  std::optional<std::size_t> first_of(const std::vector<ScenarioRows>& candidates) {
    if (!asked_ || rt::stop_requested()) return std::nullopt;
    std::vector<std::string> texts;
    for (const ScenarioRows& one : candidates) texts.push_back(scenario_.with(one));
    const auto found = runs_.first_failing(texts, failure_);
    if (!found) asked_ = std::unexpected(found.error());
    if (!found || !*found) return std::nullopt;
    result_.expectation = *result_named((*found)->run, failure_.expectation.name);
    tell(candidates[(*found)->number]);
    return (*found)->number;
  }

  void tell(const ScenarioRows& rows) const {
    if (options_.quiet) return;
    if (rows.size() == scenario_.rows().size() && runs_.runs() <= 2)
      fmt::print(out_, "{}: {}\n", shown(options_.scenario, 4'096),
                 shown(failure_.expectation.name) + " " + runtime::in_words(failure_.expectation));
    fmt::print(out_, "{:>5} {}: {}, {}\n", runs_.runs(), runs_.runs() == 1 ? "run" : "runs",
               counted(rows.size(), "event"),
               runtime::margin_text(result_.expectation).empty()
                   ? "fails"
                   : "margin " + runtime::margin_text(result_.expectation));
    std::fflush(out_);
  }

  Status write(const ScenarioRows& rows) {
    result_.file = output_;
    result_.command = command_of_run(output_);
    auto moved = relocated(scenario_.with(rows), options_.scenario, output_);
    if (!moved) return std::unexpected(moved.error());
    const std::string text =
        fmt::format("{}{}: {} of {} {} left.\n# {}: {}.\n#   {}\n\n{}", kShrunkBy,
                    shown(relative_path(output_, options_.scenario), 4'096), rows.size(),
                    counted(result_.events_before, "event"), rows.size() == 1 ? "is" : "are",
                    shown(result_.expectation.name), shown(runtime::in_words(result_.expectation)),
                    shown(result_.command, 4'096), *moved);
    Draft draft = Draft::file(output_);
    if (const Status done = write_file(draft.path(), text); !done)
      return std::unexpected(draft.placed(done.error()));
    return draft.place();
  }

  void print(const ScenarioRows& rows) const {
    if (options_.quiet) return;
    fmt::print(out_, "\n");
    for (const ScenarioRow& row : rows) {
      const std::size_t end = row.text.find_last_not_of(" \n");
      fmt::print(out_, "{}\n\n", row.text.substr(0, end + 1));
    }
    if (rows.empty()) fmt::print(out_, "It fails without any event.\n\n");
    fmt::print(
        out_, "{}: {} of {}, {} in {:.1f} s{}\n{} {}\nrepeat it: {}\n", shown(output_, 4'096),
        rows.size(), counted(result_.events_before, "event"), counted(result_.runs, "run"),
        result_.seconds, rt::stop_requested() ? ", interrupted: there may be smaller ones" : "",
        shown(result_.expectation.name), runtime::in_words(result_.expectation), result_.command);
  }

  const ShrinkOptions& options_;
  std::string output_;
  std::FILE* out_;
  ScenarioText scenario_;
  JudgedScenarios runs_;
  Failure failure_;
  Status asked_;  // what became of the runs
  ShrinkResult result_;
};

}  // namespace

void figures(Figures& f, const ShrinkResult& result) {
  f("file", "the smaller scenario", result.file);
  f("expectation", "that fails in it, as of `tandem run`", result.expectation);
  f("events_before", "of the scenario that was given", result.events_before);
  f("events", "that are left", result.events);
  f("runs", "that were begun; with more at once there may be more", result.runs);
  f("branched", "of them, as of `tandem search`", result.branched);
  f("trunks", "as of `tandem search`", result.trunks);
  f("wall_seconds", "of all of them", result.seconds);
  f("command", "that repeats it", result.command);
}

Exit shrink_command(const ShrinkOptions& options) {
  namespace fs = std::filesystem;
  const std::string output = options.output.empty()
                                 ? fs::path(options.scenario).stem().string() + ".small.toml"
                                 : options.output;
  std::error_code ignored;
  if (fs::equivalent(output, options.scenario, ignored)) {
    return refuse(Error{.message = "would be overwritten by the smaller one",
                        .hint = "give another file with -o",
                        .file = options.scenario,
                        .key = {}});
  }
  for (const Status& writable :
       {check_writable(options.json),
        check_writable(output, kShrunkBy, "scenario that was shrunk before")}) {
    if (!writable) return refuse(writable.error());
  }
  const auto document = TomlDocument::load(options.scenario);
  if (!document) return refuse(document.error());
  if (document->root().has("experiment")) {
    return refuse(Error{.message = "is a study, and what is shrunk is a scenario",
                        .hint = "`tandem search` it: -o writes its worst point as a scenario",
                        .file = options.scenario,
                        .key = {}});
  }
  auto scenario = ScenarioText::read(without_its_words(document->text()), options.scenario);
  if (!scenario) return refuse(scenario.error());
  if (scenario->rows().empty()) {
    return refuse(Error{.message = "nothing happens in it: there is nothing to leave out",
                        .hint = "give a scenario that has one of " + row_kinds_text(),
                        .file = options.scenario,
                        .key = {}});
  }
  rt::install_stop_signals();
  return Shrinking(options, output, std::move(*scenario)).shrink();
}

}  // namespace tandem::apps
