// `tandem search`: where, among the values of a study, an experiment's margin is least.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "apps/search/commands.hpp"
#include "apps/search/point_runs.hpp"
#include "apps/search/scenario_rows.hpp"
#include "apps/search/search_methods.hpp"
#include "apps/text/draft.hpp"
#include "apps/text/relative_path.hpp"
#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "base/toml_reader.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/condition/expectations.hpp"
#include "sweep/study.hpp"

namespace tandem::apps {
namespace {

constexpr char kFoundBy[] = "# Found by `tandem search` with ";
using Seconds = std::chrono::duration<double>;

class Search {
 public:
  Search(const SearchOptions& options, const sweep::Study& study, const SearchMethod& method)
      : options_(options),
        study_(study),
        method_(method),
        out_(human_output(options.json)),
        runs_(study, options.jobs, options.branches) {
    result_.method = method.name;
  }

  Exit search(Eigen::Index along) {
    const auto begin = std::chrono::steady_clock::now();
    method_.search({.keys = std::ssize(study_.vary),
                    .along = along,
                    .runs = runs_left() / study_.seeds.size(),
                    .seed = options_.seed},
                   [this](const std::vector<Eigen::VectorXd>& points) { return values(points); });
    if (!ran_) return refuse(ran_.error());
    const auto worst = least_of(worst_);
    if (!worst) return refuse(nothing_found());
    result_.seconds = Seconds(std::chrono::steady_clock::now() - begin).count();
    result_.trunks = runs_.trunks();
    result_.expectation = *worst;
    for (const TomlSetting& one : worst_.settings)
      result_.settings.push_back(one.key + "=" + one.value);
    if (const Status written = write(); !written) return refuse(written.error());
    print();
    const Status written = write_json(options_.json, figures_json(result_));
    if (!written) return refuse(written.error());
    if (rt::stop_requested()) return interrupted(rt::stop_signal());
    return result_.expectation.passed ? Exit::kDone : Exit::kFault;
  }

 private:
  [[nodiscard]] std::optional<runtime::ExpectationResult> least_of(const PointRun& point) const {
    return least_margin(point.run, options_.expect);
  }
  [[nodiscard]] std::size_t runs_left() const { return options_.runs - result_.runs; }

  [[nodiscard]] Error nothing_found() const {
    if (rt::stop_requested())
      return {.message = "interrupted before a run had ended", .hint = "", .file = {}, .key = {}};
    Error error{.message = "no point of the study can be run: " + refusal_,
                .hint = "",
                .file = study_.file,
                .key = {}};
    const bool named = !names_.empty();
    if (!named && !refusal_.empty()) return error;
    error.message = named ? "it expects no '" + options_.expect + "'" : "it expects nothing";
    error.hint = named ? suggest(options_.expect, names_)
                       : "add an [[expect]] of a number: docs/expectations.md";
    error.file = study_.experiment;
    return error;
  }

  [[nodiscard]] std::vector<TomlSetting> settings_of(const Eigen::VectorXd& point,
                                                     std::optional<std::uint64_t> seed) const {
    constexpr double kInside = 1e-9;  // of the cube
    std::vector<TomlSetting> settings = study_.settings;
    for (std::size_t i = 0; i < study_.vary.size(); ++i) {
      const double u = std::clamp(point[static_cast<Eigen::Index>(i)], kInside, 1.0 - kInside);
      settings.push_back(
          {.key = study_.vary[i].key, .value = study_.vary[i].at(u), .said = study_.file});
    }
    if (seed)
      settings.push_back({.key = "seed", .value = std::to_string(*seed), .said = study_.file});
    return settings;
  }

  /// The least margin of each point over the seeds. Fewer: the runs are used up.
  std::vector<double> values(const std::vector<Eigen::VectorXd>& points) {
    std::vector<PointRun> looked;
    for (const Eigen::VectorXd& point : points) {
      for (const auto& seed : study_.seeds)
        looked.push_back({.settings = settings_of(point, seed)});
    }
    looked.resize(std::min(looked.size(), runs_left()));
    ran_ = runs_.run(looked);
    if (!ran_ || rt::stop_requested()) return {};
    if (looked.empty()) return {};
    note(looked);
    std::vector<double> values;
    for (std::size_t i = 0; i + study_.seeds.size() <= looked.size(); i += study_.seeds.size()) {
      double least = std::numeric_limits<double>::quiet_NaN();
      for (std::size_t k = i; k < i + study_.seeds.size(); ++k)
        if (const auto one = least_of(looked[k])) least = std::fmin(least, margin_value(*one));
      values.push_back(least);
    }
    return values;
  }

  /// In the order of the points, whoever ended first.
  void note(const std::vector<PointRun>& looked) {
    SearchResult::Progress progress;
    for (const PointRun& one : looked) {
      ++result_.runs;
      if (one.run.ended == "refused" || one.run.killed) {
        ++result_.refused;
        if (refusal_.empty()) refusal_ = one.run.reason;
        continue;
      }
      if (!one.run.passed) ++result_.failed;
      if (one.run.begins_s > 0.0) ++result_.branched;
      if (names_.empty()) {
        for (const runtime::ExpectationResult& result : one.run.expectations)
          names_.push_back(result.name);
      }
      const auto least = least_of(one);
      if (!least) continue;
      const auto worst = least_of(worst_);
      progress.least =
          std::min(progress.least.value_or(margin_value(*least)), margin_value(*least));
      if (!worst || margin_value(*least) < margin_value(*worst)) worst_ = one;
    }
    const auto worst = least_of(worst_);
    progress.runs = result_.runs;
    if (worst) progress.least_so_far = margin_value(*worst);
    result_.progress.push_back(progress);
    if (options_.quiet || !worst) return;
    fmt::print(out_, "{:>5} {}: {} {}\n", result_.runs, result_.runs == 1 ? "run" : "runs",
               shown(worst->name), shown(runtime::in_words(*worst)));
    std::fflush(out_);
  }

  Status write() {
    result_.command = command_of_run(study_.experiment, flags_of(worst_.settings));
    if (options_.output.empty()) return {};
    result_.file = options_.output;
    result_.command = command_of_run(options_.output);
    const auto document = TomlDocument::load(study_.experiment);
    if (!document) return std::unexpected(document.error());
    auto text = with_settings(document->text(), worst_.settings);
    if (!text) return std::unexpected(text.error());
    auto moved = relocated(text->text, study_.experiment, options_.output);
    if (!moved) return std::unexpected(moved.error());
    const std::string words =
        fmt::format("{}{}: the worst of {}.\n# {}: {}.\n#   {}\n\n", kFoundBy,
                    shown(relative_path(options_.output, study_.file), 4'096),
                    counted(result_.runs, "run"), shown(result_.expectation.name),
                    shown(runtime::in_words(result_.expectation)), shown(result_.command, 4'096));
    Draft draft = Draft::file(options_.output);
    if (const Status done = write_file(draft.path(), words + *moved); !done)
      return std::unexpected(draft.placed(done.error()));
    return draft.place();
  }

  void print() const {
    if (options_.quiet) return;
    Facts facts;
    facts.add("worst", result_.expectation.name + " " + runtime::in_words(result_.expectation));
    if (std::isinf(margin_value(result_.expectation)))
      facts.add("", result_.expectation.passed ? "without a margin"
                                               : "without a margin: nothing counts as worse");
    for (const std::string& one : result_.settings) facts.add("", one);
    facts.add("runs", fmt::format("{} in {:.1f} s, {} failed", result_.runs, result_.seconds,
                                  result_.failed));
    if (result_.branched > 0) facts.add("", branches_text(result_.branched, result_.trunks));
    if (result_.refused > 0)
      facts.add("refused", fmt::format("{} of them; the first: {}", result_.refused, refusal_));
    if (!result_.file.empty()) facts.add("written", result_.file);
    facts.add("repeat it", result_.command);
    fmt::print(out_, "\n");
    facts.print(out_);
  }

  const SearchOptions& options_;
  const sweep::Study& study_;
  const SearchMethod& method_;
  std::FILE* out_;
  PointRuns runs_;
  Status ran_;
  PointRun worst_;
  std::vector<std::string> names_;  // of expectations
  std::string refusal_;             // of the first run that could not be
  SearchResult result_;
};

Error wrong_study(const sweep::Study& study, std::string message, std::string hint) {
  return {
      .message = std::move(message), .hint = std::move(hint), .file = study.file, .key = "vary"};
}

}  // namespace

void figures(Figures& f, const SearchResult::Progress& progress) {
  f("runs", "so far", progress.runs);
  f("least", "margin of this generation; null: one failed without a margin, or none has one",
    progress.least);
  f("least_so_far", progress.least_so_far);
}

void figures(Figures& f, const SearchResult& result) {
  f("method", "", result.method);
  f("expectation",
    "the one of least margin, at the worst point, as of `tandem run`; `margin` is null where it "
    "failed without one, which nothing is worse than, or where none has one",
    result.expectation);
  f("settings", "of the worst point, as of `--set`", result.settings);
  f("runs", "", result.runs);
  f("failed", "of them", result.failed);
  f("refused", "of them: they could not be run, and count for nothing", result.refused);
  f("branched", "of them: they went on from a state of a beginning that they have in common",
    result.branched);
  f("trunks", "such beginnings, which were simulated beside the runs", result.trunks);
  f("wall_seconds", "of all of them", result.seconds);
  f("file", "the worst point as a scenario; empty: none was asked for", result.file);
  f("command", "that repeats it", result.command);
  f("progress", "a generation each", result.progress);
}

Exit search_command(const SearchOptions& options) {
  const bool limits = !options.limit.empty();
  for (const Status& writable :
       {check_writable(options.json),
        limits ? Status()
               : check_writable(options.output, kFoundBy, "scenario that was found before")}) {
    if (!writable) return refuse(writable.error());
  }
  const auto study = sweep::read_study(options.study);
  if (!study) return refuse(study.error());
  if (study->vary.empty())
    return refuse(wrong_study(*study, "nothing varies in it", "add a [[vary]]"));
  if (!study->variants.empty()) {
    return refuse(wrong_study(*study, "a comparison has no worst point",
                              "take [[variant]] out, or `tandem sweep` it"));
  }
  if (limits) return find_limits(options, *study);
  std::vector<TomlSetting> settings = study->settings;
  for (const sweep::Vary& one : study->vary)
    settings.push_back({.key = one.key, .value = {}, .said = {}});
  if (const auto of_robot = take_below("robot", settings);
      !options.output.empty() && !of_robot.empty()) {
    return refuse(wrong_study(
        *study, "'robot." + of_robot.front().key + "' is of the robot's file: no scenario has it",
        "leave -o out: the command that it prints has the value"));
  }
  if (options.runs < study->seeds.size()) {
    return refuse(wrong_study(*study, "one point needs a run for each of its seeds",
                              fmt::format("give --runs {} at least", study->seeds.size())));
  }
  const auto method = std::ranges::find(
      search_methods(),
      options.method.empty() ? search_methods().front().name : std::string_view(options.method),
      &SearchMethod::name);
  std::vector<std::string> keys;
  for (const sweep::Vary& one : study->vary) keys.push_back(one.key);
  if (!options.along.empty() && method->name != "phase") {
    return refuse(
        Error{.message = "--along is of --method phase, and this is " + std::string(method->name),
              .hint = "add --method phase, or leave --along out",
              .file = study->file,
              .key = {}});
  }
  const auto along = options.along.empty() ? keys.begin() : std::ranges::find(keys, options.along);
  if (along == keys.end()) {
    return refuse(wrong_study(*study, "no [[vary]] has the key '" + options.along + "'",
                              suggest(options.along, keys)));
  }
  if (method->name == "phase" && options.along.empty() && keys.size() > 1)
    return refuse(wrong_study(*study, "several keys vary in it", "say --along KEY"));
  rt::install_stop_signals();
  return Search(options, *study, *method).search(along - keys.begin());
}

}  // namespace tandem::apps
