// `tandem search --limit KEY`: how far the list of numbers at KEY can be scaled until it fails, at
// every point of a study: a push map.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "apps/search/commands.hpp"
#include "apps/search/point_runs.hpp"
#include "apps/search/scenario_rows.hpp"
#include "apps/text/draft.hpp"
#include "base/counted.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

/// A point of the study: between the largest factor that passed and the least that failed.
struct Bracket {
  sweep::Point point;
  double passed = 0.0;
  double failed = 0.0;  // 0: none did
  bool measured = true;
};

/// A field of CSV.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char letter : text) quoted += letter == '"' ? "\"\"" : std::string(1, letter);
  return quoted + "\"";
}

class Limits {
 public:
  Limits(const SearchOptions& options, const sweep::Study& study)
      : options_(options),
        study_(study),
        out_(human_output(options.json)),
        runs_(study.experiment, options.jobs, study.time_limit_s) {}

  /// The greatest factor first, then halves: all points a round.
  Exit find() {
    const auto begin = std::chrono::steady_clock::now();
    const sweep::Points points(study_);
    for (std::uint64_t i = 0; i < points.size(); ++i) brackets_.push_back({.point = points.at(i)});
    for (std::size_t round = 0; round <= options_.halvings && !rt::stop_requested(); ++round) {
      if (const Status ran = look(round == 0); !ran) return refuse(ran.error());
    }
    if (rt::stop_requested()) return interrupted(rt::stop_signal());
    gather(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    if (const Status written = write(); !written) return refuse(written.error());
    print();
    return end_with_json(options_.json, figures_json(result_));
  }

 private:
  [[nodiscard]] bool passes(const ChildRun& run) const {
    if (options_.expect.empty()) return run.passed;
    const auto it =
        std::ranges::find(run.expectations, options_.expect, &runtime::ExpectationResult::name);
    return it != run.expectations.end() && it->passed;
  }

  Status look(bool first) {
    std::vector<PointRun> looked;
    std::vector<std::size_t> of;
    std::vector<double> factors;
    for (std::size_t i = 0; i < brackets_.size(); ++i) {
      const Bracket& one = brackets_[i];
      if (!first && one.failed == 0.0) continue;
      factors.push_back(first ? options_.up_to : (one.passed + one.failed) / 2.0);
      of.push_back(i);
      auto settings = scaled(one.point.settings, factors.back());
      if (!settings) return std::unexpected(settings.error());
      looked.push_back({.settings = std::move(*settings)});
    }
    if (const Status ran = runs_.run(looked); !ran || rt::stop_requested()) return ran;
    for (std::size_t k = 0; k < looked.size(); ++k) {
      Bracket& one = brackets_[of[k]];
      if (looked[k].run.ended == "refused") {
        return std::unexpected(Error{.message = looked[k].run.reason,
                                     .hint = "a point of the study cannot be run",
                                     .file = study_.file,
                                     .key = {}});
      }
      (passes(looked[k].run) ? one.passed : one.failed) = factors[k];
    }
    result_.runs += looked.size();
    if (!options_.quiet) {
      fmt::print(out_, "{:>5} runs: {} of {} points fail somewhere\n", result_.runs,
                 std::ranges::count_if(brackets_, [](const Bracket& b) { return b.failed > 0.0; }),
                 brackets_.size());
      std::fflush(out_);
    }
    return {};
  }

  [[nodiscard]] Result<std::vector<TomlSetting>> scaled(std::vector<TomlSetting> settings,
                                                        double factor) const {
    const auto it = std::ranges::find(settings, options_.limit, &TomlSetting::key);
    const auto value =
        it == settings.end() ? std::optional<std::string>() : scaled_value(it->value, factor);
    if (!value) {
      return std::unexpected(
          Error{.message = "'" + options_.limit + "' has no numbers in it to scale",
                .hint = "give it a [[vary]] whose values are directions: [[1, 0, 0], [0, 1, 0]]",
                .file = study_.file,
                .key = "vary"});
    }
    it->value = *value;
    return settings;
  }

  void gather(double seconds) {
    result_.key = options_.limit;
    result_.seconds = seconds;
    for (const Bracket& one : brackets_) {
      LimitResult::Row row{.passed = one.passed, .failed = known(one.failed > 0.0, one.failed)};
      for (std::size_t k = 0; k < study_.vary.size(); ++k)
        row.values.push_back(one.point.values[k]);
      result_.points.push_back(std::move(row));
    }
  }

  Status write() {
    if (options_.output.empty()) return {};
    std::string text;
    for (const sweep::Vary& one : study_.vary) text += csv_field(one.key) + ",";
    text += "passes_at,fails_at\n";
    for (const LimitResult::Row& row : result_.points) {
      for (const std::string& value : row.values) text += csv_field(value) + ",";
      text += fmt::format("{},{}\n", row.passed, row.failed ? fmt::format("{}", *row.failed) : "");
    }
    Draft draft = Draft::file(options_.output);
    if (const Status done = write_file(draft.path(), text); !done)
      return std::unexpected(draft.placed(done.error()));
    return draft.place();
  }

  void print() const {
    if (options_.quiet) return;
    std::vector<std::string> header;
    for (const sweep::Vary& one : study_.vary) header.push_back(one.key);
    header.insert(header.end(), {"passes at", "fails at"});
    Table table(header);
    for (const LimitResult::Row& row : result_.points) {
      std::vector<std::string> cells = row.values;
      cells.push_back(fmt::format("{:.4g}", row.passed));
      cells.push_back(row.failed ? fmt::format("{:.4g}", *row.failed) : "-");
      table.add(std::move(cells));
    }
    fmt::print(out_, "\n");
    table.print(out_);
    fmt::print(out_, "\n{} of '{}': {} in {:.1f} s\n", counted(result_.points.size(), "point"),
               result_.key, counted(result_.runs, "run"), result_.seconds);
  }

  const SearchOptions& options_;
  const sweep::Study& study_;
  std::FILE* out_;
  PointRuns runs_;
  std::vector<Bracket> brackets_;
  LimitResult result_;
};

}  // namespace

void figures(Figures& f, const LimitResult::Row& row) {
  f("values", "of the study's [[vary]], in their order, in TOML", row.values);
  f("passed", "the greatest factor that was run and passed; 0: none", row.passed);
  f("failed", "the least that failed; null: none did", row.failed);
}

void figures(Figures& f, const LimitResult& result) {
  f("key", "whose values are scaled", result.key);
  f("runs", "", result.runs);
  f("wall_seconds", "of all of them", result.seconds);
  f("points", "of the study", result.points);
}

Exit find_limits(const SearchOptions& options, const sweep::Study& study) {
  if (study.method == nullptr || !study.method->is_grid) {
    return refuse(Error{.message = "limits are of a grid's points",
                        .hint = "leave [sample] out, and give `values` or steps",
                        .file = study.file,
                        .key = "sample"});
  }
  const Status writable =
      check_writable(options.output, csv_field(study.vary.front().key) + ",", "a table of limits");
  if (!writable) return refuse(writable.error());
  rt::install_stop_signals();
  return Limits(options, study).find();
}

}  // namespace tandem::apps
