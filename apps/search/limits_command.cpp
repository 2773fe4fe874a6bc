// `tandem search --limit KEY`: how far the list of numbers at KEY can be scaled until it fails, at
// every point of a study: a push map.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>

#include "apps/search/commands.hpp"
#include "apps/search/limit_picture.hpp"
#include "apps/search/point_runs.hpp"
#include "apps/search/scenario_rows.hpp"
#include "apps/text/draft.hpp"
#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/condition/expectations.hpp"

namespace tandem::apps {
namespace {

/// A point of the study: between the largest factor that passed and the least that failed.
struct Bracket {
  sweep::Point point;
  std::optional<double> passed{}, failed{};
  std::string reason{};  // why none passed
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
        runs_(study, options.jobs, options.branches) {}

  /// The greatest factor first, then halves, then 0 where none passed: all points a round.
  Exit find() {
    const auto begin = std::chrono::steady_clock::now();
    const sweep::Points points(study_);
    for (std::uint64_t i = 0; i < points.size(); ++i) brackets_.push_back({.point = points.at(i)});
    const auto greatest = [this](const Bracket&) { return std::optional(options_.up_to); };
    const auto middle = [](const Bracket& one) {
      return known(one.failed.has_value(),
                   (one.passed.value_or(0.0) + one.failed.value_or(0.0)) / 2.0);
    };
    const auto nothing = [](const Bracket& one) { return known(!one.passed, 0.0); };
    for (std::size_t round = 0; round <= options_.halvings + 1 && !rt::stop_requested(); ++round) {
      const Status ran = round == 0                   ? look(greatest)
                         : round <= options_.halvings ? look(middle)
                                                      : look(nothing);
      if (!ran) return refuse(ran.error());
    }
    if (rt::stop_requested()) return interrupted(rt::stop_signal());
    gather(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    if (const Status written = write(); !written) return refuse(written.error());
    if (const Status written = draw(); !written) return refuse(written.error());
    print();
    return end_with_json(options_.json, figures_json(result_));
  }

 private:
  /// @param factor  to run of a point; empty: it is not run
  Status look(const std::function<std::optional<double>(const Bracket&)>& factor) {
    std::vector<PointRun> looked;
    std::vector<std::size_t> of;
    std::vector<double> factors;
    for (std::size_t i = 0; i < brackets_.size(); ++i) {
      const std::optional<double> next = factor(brackets_[i]);
      if (!next) continue;
      factors.push_back(*next);
      of.push_back(i);
      auto settings = scaled(brackets_[i].point.settings, *next);
      if (!settings) return std::unexpected(settings.error());
      looked.push_back({.settings = std::move(*settings)});
    }
    if (const Status ran = runs_.run(looked); !ran || rt::stop_requested()) return ran;
    for (std::size_t k = 0; k < looked.size(); ++k) {
      if (const Status noted = note(brackets_[of[k]], looked[k].run, factors[k]); !noted)
        return noted;
    }
    result_.runs += looked.size();
    result_.branched += static_cast<std::size_t>(
        std::ranges::count_if(looked, [](const PointRun& one) { return one.run.begins_s > 0.0; }));
    if (!options_.quiet && !looked.empty()) {
      fmt::print(
          out_, "{:>5} runs: {} of {} points fail somewhere\n", result_.runs,
          std::ranges::count_if(brackets_, [](const Bracket& b) { return b.failed.has_value(); }),
          brackets_.size());
      std::fflush(out_);
    }
    return {};
  }

  Status note(Bracket& one, const ChildRun& run, double factor) const {
    const auto wrong = [this](std::string message, std::string hint) {
      return std::unexpected(Error{
          .message = std::move(message), .hint = std::move(hint), .file = study_.file, .key = {}});
    };
    const bool refused = run.ended == "refused" || run.killed;
    if (refused && factor > 0.0)
      return wrong(run.reason, fmt::format("a point of the study cannot be run at {:g}", factor));
    const auto least = least_margin(run, options_.expect);
    if (!refused && !least) {
      std::vector<std::string> names;
      for (const runtime::ExpectationResult& result : run.expectations)
        names.push_back(result.name);
      return names.empty() ? wrong("its experiment expects nothing",
                                   "add an [[expect]]: docs/expectations.md")
                           : wrong("its experiment expects no '" + options_.expect + "'",
                                   suggest(options_.expect, names));
    }
    if (least && (options_.expect.empty() ? run.passed : least->passed)) {
      one.passed = factor;
    } else if (!refused) {
      one.failed = factor;
    }
    if (factor == 0.0 && !one.passed) {
      const std::string why =
          refused || least->passed ? run.reason : least->name + " " + runtime::in_words(*least);
      one.reason = (refused ? "0 cannot be run: " : "fails already at 0: ") + why;
    }
    return {};
  }

  [[nodiscard]] Result<std::vector<TomlSetting>> scaled(std::vector<TomlSetting> settings,
                                                        double factor) const {
    const auto it = std::ranges::find(settings, options_.limit, &TomlSetting::key);
    const auto value = scaled_value(it->value, factor);
    if (!value) {
      return std::unexpected(Error{.message = "'" + it->value + "' is not made of numbers",
                                   .hint = "give values such as directions: [[1, 0, 0], [0, 1, 0]]",
                                   .file = study_.file,
                                   .key = "vary " + options_.limit});
    }
    it->value = *value;
    return settings;
  }

  void gather(double seconds) {
    result_.key = options_.limit;
    result_.seconds = seconds;
    result_.trunks = runs_.trunks();
    for (const Bracket& one : brackets_) {
      LimitResult::Row row{.passed = one.passed, .failed = one.failed, .reason = one.reason};
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
      text += fmt::format("{},{}\n", row.passed ? fmt::format("{}", *row.passed) : "",
                          row.failed ? fmt::format("{}", *row.failed) : "");
    }
    return put(options_.output, text);
  }

  static Status put(const std::string& file, const std::string& text) {
    Draft draft = Draft::file(file);
    if (const Status done = write_file(draft.path(), text); !done)
      return std::unexpected(draft.placed(done.error()));
    return draft.place();
  }

  Status draw() {
    if (options_.svg.empty()) return {};
    std::vector<std::pair<std::optional<double>, std::optional<double>>> limits;
    for (const Bracket& one : brackets_) limits.emplace_back(one.passed, one.failed);
    LimitPicture picture{
        .title = {}, .below = {}, .unit = unit_of_key(options_.limit), .panels = {}};
    picture.panels = panels_of(study_, options_.limit, limits);
    const runtime::Composition* first = runs_.first();
    const double mass_kg =
        first == nullptr || first->kernels.get() == nullptr ? 0.0 : first->kernels.get()->mass_kg;
    const std::string robot = first == nullptr ? "" : first->experiment.robot.name + ": ";
    if (mass_kg > 0.0) {
      picture.scale = 1.0 / mass_kg;
      picture.unit += "/kg";
    }
    picture.title = fmt::format("{}{} by direction{}", robot, options_.limit,
                                mass_kg > 0.0 ? ", over the robot's mass" : "");
    picture.below = fmt::format(
        "Passes: {}.{} {} in simulation, up to a factor of {:g}.",
        options_.expect.empty() ? "all of its expectations" : "'" + options_.expect + "'",
        mass_kg > 0.0 ? fmt::format(" Mass {:.4g} kg.", mass_kg) : "", counted(result_.runs, "run"),
        options_.up_to);
    return put(options_.svg, drawn(picture));
  }

  void print() const {
    if (options_.quiet) return;
    std::vector<std::string> header;
    for (const sweep::Vary& one : study_.vary) header.push_back(one.key);
    header.insert(header.end(), {"passes at", "fails at", ""});
    Table table(header);
    for (const LimitResult::Row& row : result_.points) {
      std::vector<std::string> cells = row.values;
      for (const auto& factor : {row.passed, row.failed})
        cells.push_back(factor ? fmt::format("{:.4g}", *factor) : "-");
      cells.push_back(row.reason);
      table.add(std::move(cells));
    }
    fmt::print(out_, "\n");
    table.print(out_);
    fmt::print(out_, "\n{} of '{}': {} in {:.1f} s\n", counted(result_.points.size(), "point"),
               result_.key, counted(result_.runs, "run"), result_.seconds);
    if (result_.branched > 0)
      fmt::print(out_, "{}\n", branches_text(result_.branched, result_.trunks));
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
  f("passed", "the greatest factor that was run and passed; null: none did, not even 0",
    row.passed);
  f("failed", "the least that failed; null: none did", row.failed);
  f("reason", "why none passed; empty: one did", row.reason);
}

void figures(Figures& f, const LimitResult& result) {
  f("key", "whose values are scaled", result.key);
  f("runs", "", result.runs);
  f("branched", "of them, as of a search", result.branched);
  f("trunks", "as of a search", result.trunks);
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
  std::vector<std::string> keys;
  for (const sweep::Vary& one : study.vary) keys.push_back(one.key);
  if (std::ranges::find(keys, options.limit) == keys.end()) {
    return refuse(
        Error{.message = "no [[vary]] of it has the key '" + options.limit + "'",
              .hint = "--limit scales the values of a [[vary]], of which one is enough; " +
                      suggest(options.limit, keys),
              .file = study.file,
              .key = "vary"});
  }
  const Status writable =
      check_writable(options.output, csv_field(study.vary.front().key) + ",", "table of limits");
  if (!writable) return refuse(writable.error());
  if (!options.svg.empty()) {
    if (const Status drawn = can_be_drawn(study, options.limit); !drawn)
      return refuse(drawn.error());
    const Status picture = check_writable(options.svg, "<svg ", "picture of limits");
    if (!picture) return refuse(picture.error());
  }
  rt::install_stop_signals();
  return Limits(options, study).find();
}

}  // namespace tandem::apps
