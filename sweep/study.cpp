#include "sweep/study.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "base/counted.hpp"
#include "base/quoting.hpp"
#include "base/sha256.hpp"
#include "base/toml_reader.hpp"

namespace tandem::sweep {
namespace {

constexpr std::int64_t kMostSeed = std::numeric_limits<std::int64_t>::max();

std::string number_in_toml(double value) { return fmt::format("{:.9g}", value); }

std::vector<TomlSetting> read_settings(TomlTable& table) {
  std::vector<TomlSetting> settings;
  for (const std::string& text : table.texts_or("set", {})) {
    auto setting = read_setting(text);
    if (setting) {
      settings.push_back(std::move(*setting));
    } else {
      table.error("set", setting.error().file + " " + setting.error().message,
                  setting.error().hint);
    }
  }
  return settings;
}

/// `seeds = 8` are 1 to 8, `seeds = [3, 5]` these.
std::vector<std::optional<std::uint64_t>> read_seeds(TomlTable& root) {
  if (!root.has("seeds")) return {std::nullopt};
  std::vector<std::optional<std::uint64_t>> seeds;
  const std::string text = root.values()["seeds"];
  if (!text.starts_with('[')) {
    const std::int64_t count = root.integer("seeds", 1, static_cast<std::int64_t>(kMostPoints));
    for (std::int64_t seed = 1; seed <= count; ++seed) seeds.emplace_back(seed);
    return seeds;
  }
  std::set<double> known;
  for (const double one : root.numbers("seeds", 0, {.min = 0.0, .max = 9e15})) {
    if (one != std::floor(one)) root.error("seeds", "must be whole numbers");
    if (!known.insert(one).second) root.error("seeds", "has one twice", "leave one of them out");
    seeds.emplace_back(static_cast<std::uint64_t>(one));
  }
  if (seeds.empty()) root.error("seeds", "is empty", "leave it out for the experiment's own");
  return seeds;
}

/// The values of `from`, `to` and `steps`.
std::vector<std::string> even_values(TomlTable& row) {
  const double from = row.number("from"), to = row.number("to");
  const std::int64_t steps = row.integer("steps", 2, 1'000'000);
  std::vector<std::string> values;
  for (std::int64_t i = 0; i < steps; ++i) {
    const double share =
        static_cast<double>(i) / static_cast<double>(std::max<std::int64_t>(1, steps - 1));
    values.push_back(number_in_toml(from + (to - from) * share));
  }
  return values;
}

Vary read_vary(TomlTable& row, const Method& method) {
  Vary vary;
  vary.key = row.text("key");
  if (!vary.key.empty()) {
    if (const auto right = read_setting(vary.key + "=0"); !right)
      row.error("key", right.error().message, right.error().hint);
  }
  std::size_t given = 0;
  if (row.has("values")) {
    ++given;
    vary.values = row.value_texts("values");
  }
  if (row.has("from") || row.has("to") || row.has("steps")) {
    ++given;
    vary.values = even_values(row);
  }
  for (const Distribution& one : distributions()) {
    if (!row.has(one.name)) continue;
    ++given;
    const std::vector<double> numbers = row.numbers(one.name, 2);
    vary.distribution = &one;
    vary.a = numbers[0];
    vary.b = numbers[1];
    if (row.has_errors(one.name)) continue;
    if (const auto problem = one.problem(vary.a, vary.b); !problem.empty())
      row.error(one.name, std::string(problem), "give " + std::string(one.words));
    if (method.is_grid) {
      row.error(one.name, "a grid has no distributions",
                "give `values`, or `from`, `to` and `steps`; or another [sample] method");
    }
  }
  if (given != 1) {
    row.error("", given == 0 ? "says no values" : "says its values twice",
              "give one of: values; from, to and steps; uniform; log_uniform; normal");
  }
  std::set<std::string> known;
  for (const std::string& value : vary.values) {
    if (!known.insert(value).second)
      row.error("", "has the value " + value + " twice", "leave one of them out");
  }
  row.finish();
  return vary;
}

const Method& read_method(TomlTable sample, Study& study) {
  std::vector<std::string> names;
  for (const Method& one : methods()) names.emplace_back(one.name);
  const std::string name = sample.choice_or("method", names.front(), names);
  const Method& method = *std::ranges::find(methods(), name, &Method::name);
  if (method.is_grid) {
    if (sample.has("points"))
      sample.error("points", "a grid has as many as its values make", "leave it out");
  } else {
    study.points = static_cast<std::uint64_t>(
        sample.integer("points", 1, static_cast<std::int64_t>(kMostPoints)));
  }
  study.seed = static_cast<std::uint64_t>(sample.integer_or("seed", 1, 0, kMostSeed));
  sample.finish();
  return method;
}

void read_variants(TomlTable& root, Study& study) {
  std::set<std::string> names;
  for (TomlTable& row : root.tables("variant")) {
    Variant variant{.name = row.text("name"), .settings = read_settings(row)};
    if (!names.insert(variant.name).second)
      row.error("name", "another variant has this name", "give each its own");
    row.finish();
    study.variants.push_back(std::move(variant));
  }
}

/// Where settings lead: the same place may be called by several keys.
class Places {
 public:
  explicit Places(const std::string& experiment) {
    auto document = TomlDocument::load(experiment);
    if (!document) return;
    experiment_ = document->text();
    TomlTable root = document->root();
    const auto robot = TomlDocument::load(
        (std::filesystem::path(root.folder()) / root.text_or("robot", "")).string());
    if (robot) robot_ = robot->text();
  }
  /// As the reader calls it: "push.knock.at_s" is "push[0].at_s". A key that leads nowhere stays.
  [[nodiscard]] std::string of(const std::string& key) const {
    constexpr std::string_view kRobot = "robot.";
    if (key.starts_with(kRobot)) return "robot." + in(robot_, key.substr(kRobot.size()));
    return in(experiment_, key);
  }

 private:
  static std::string in(const std::string& text, const std::string& key) {
    const auto set = with_settings(text, {{.key = key, .value = "0", .said = key}});
    return set && !set->who.empty() ? set->who.front().first : key;
  }
  std::string experiment_, robot_;
};

bool is_part_of(const std::string& place, const std::string& whole) {
  return place.starts_with(whole) &&
         (place.size() == whole.size() || place[whole.size()] == '.' || place[whole.size()] == '[');
}

/// What varies is set last: nobody else may set it, or the points would differ by less than they
/// say. A list that `set` gives may have an entry that varies.
void check_places(TomlTable& root, std::vector<TomlTable>& rows, const Study& study) {
  const Places places(study.experiment);
  std::vector<std::pair<std::string, std::string>> set;  // place, who sets it
  const auto add = [&](const std::vector<TomlSetting>& settings, const std::string& whose) {
    for (const TomlSetting& one : settings)
      set.emplace_back(places.of(one.key), "'" + one.key + "' in `set` of " + whose);
  };
  add(study.settings, "the study");
  for (const Variant& one : study.variants) add(one.settings, "[[variant]] '" + one.name + "'");
  for (const auto& [place, who] : set) {
    if (place == "seed" && study.seeds.front())
      root.error("seeds", "give the seed, which " + who + " sets too", "leave one of the two out");
  }
  std::vector<std::string> varied;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::string place = varied.emplace_back(places.of(study.vary[k].key));
    const auto twice = [&](const std::string& who) {
      rows[k].error("key", "varies " + place + ", which " + who + " sets too",
                    "leave one of the two out");
    };
    if (place == "seed") rows[k].error("key", "seeds are no [[vary]]", "give `seeds = [1, 2]`");
    for (std::size_t j = 0; j < k; ++j) {
      if (is_part_of(place, varied[j]) || is_part_of(varied[j], place))
        twice(fmt::format("[[vary]] '{}' of line {}", study.vary[j].key, rows[j].line("key")));
    }
    for (const auto& [other, who] : set)
      if (is_part_of(other, place)) twice(who);
  }
}

/// How many points; more than there can be: saturated.
std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  constexpr std::uint64_t kMany = std::uint64_t{1} << 62;
  return b != 0 && a > kMany / b ? kMany : a * b;
}

std::uint64_t count_of(const Study& study) {
  return times(times(study.points, study.seeds.size()),
               std::max<std::size_t>(1, study.variants.size()));
}

void check_count(TomlTable& root, const Study& study) {
  const std::uint64_t count = count_of(study);
  if (count <= kMostPoints) return;
  root.error("",
             fmt::format("the study has {}{} points, {} at most",
                         count >= std::uint64_t{1} << 62 ? "more than " : "", count, kMostPoints),
             "give fewer values or seeds, or [sample] method = \"sobol\" with `points`");
}

}  // namespace

std::string Vary::at(double u) const {
  if (distribution != nullptr) return number_in_toml(distribution->at(u, a, b));
  const auto last = static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(
      std::min(last, std::floor(u * static_cast<double>(values.size()))))];
}

std::expected<Study, Diagnostics> read_study(const std::string& file) {
  const auto document = TomlDocument::load(file);
  if (!document) return std::unexpected(Diagnostics{document.error()});
  TomlTable root = document->root();
  if (!root.has("experiment") && root.has("robot")) {
    return std::unexpected(Diagnostics{
        {.message = "is an experiment, and no study",
         .hint = "write a study: experiment = \"FILE\", and a [[vary]] for each value that changes",
         .file = file,
         .key = {}}});
  }
  Study study;
  study.file = file;
  study.text = document->text();
  const std::string experiment = root.text("experiment");
  study.experiment =
      (std::filesystem::path(root.folder()) / experiment).lexically_normal().string();
  std::error_code ignored;
  if (!experiment.empty() && !std::filesystem::is_regular_file(study.experiment, ignored))
    root.error("experiment", "there is no file " + study.experiment,
               "give its path from the study's folder");
  study.seeds = read_seeds(root);
  study.settings = read_settings(root);
  study.time_limit_s = root.number_or("time_limit_s", study.time_limit_s, {0.0, 1e6, true});
  study.method = &read_method(root.table_or_empty("sample"), study);
  std::vector<TomlTable> rows = root.tables("vary", "key");
  for (TomlTable& row : rows) study.vary.push_back(read_vary(row, *study.method));
  read_variants(root, study);
  if (document->diagnostics().empty()) check_places(root, rows, study);
  TomlTable keep = root.table_or_empty("keep");
  study.keep.logs_MB = keep.number_or("logs_MB", 0.0, kNotNegative);
  study.keep.sample = static_cast<std::uint64_t>(keep.integer_or("sample", 0, 0, 1'000'000));
  keep.finish();
  root.finish();
  if (study.vary.size() > study.method->most_keys) {
    root.error("vary",
               fmt::format("{} spreads {} at most", study.method->name,
                           counted(study.method->most_keys, "key")),
               "leave some out, or take latin_hypercube");
  }
  if (study.method->is_grid) {
    study.points = 1;
    for (const Vary& one : study.vary) study.points = times(study.points, one.values.size());
  } else if (study.vary.empty()) {
    root.error("vary", "nothing varies", "add [[vary]], or leave [sample] out");
  }
  if (document->diagnostics().empty()) check_count(root, study);
  Diagnostics errors = document->diagnostics();
  sort_by_line(errors);
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return study;
}

std::string Study::meaning() const {
  std::string all = fmt::format("{} {} {}\n", method->name, points, seed);
  const auto add = [&all](const std::vector<TomlSetting>& settings_of) {
    for (const TomlSetting& one : settings_of) all += "set " + one.key + "=" + one.value + "\n";
  };
  add(settings);
  for (const auto& one : seeds) all += one ? fmt::format("seed {}\n", *one) : "no seed\n";
  for (const Vary& one : vary) {
    all += "vary " + one.key + "\n";
    for (const std::string& value : one.values) all += value + "\n";
    if (one.distribution != nullptr)
      all += fmt::format("{} {} {}\n", one.distribution->name, one.a, one.b);
  }
  for (const Variant& one : variants) {
    all += "variant " + one.name + "\n";
    add(one.settings);
  }
  return all;
}

std::string Point::command(const std::string& experiment) const {
  std::string words = "tandem run " + shell_word(experiment) + " --hal sim";
  for (const TomlSetting& one : settings)
    words += " --set " + shell_word(one.key + "=" + one.value);
  if (seed) words += fmt::format(" --seed {}", *seed);
  return words;
}

Points::Points(const Study& study) : study_(study), size_(count_of(study)) {
  if (study.method->spread != nullptr)
    unit_ = study.method->spread(study.points, study.vary.size(), study.seed);
}

Point Points::at(std::uint64_t index) const {
  const std::size_t variants = std::max<std::size_t>(1, study_.variants.size());
  Point point;
  point.index = index;
  point.variant = static_cast<std::size_t>(index % variants);
  index /= variants;
  point.seed = study_.seeds[static_cast<std::size_t>(index % study_.seeds.size())];
  point.sample = index / study_.seeds.size();
  point.values.resize(study_.vary.size());
  std::uint64_t rest = point.sample;
  for (std::size_t k = study_.vary.size(); k-- > 0;) {
    const Vary& vary = study_.vary[k];
    if (unit_.empty()) {
      point.values[k] = vary.values[static_cast<std::size_t>(rest % vary.values.size())];
      rest /= vary.values.size();
    } else {
      point.values[k] =
          vary.at(unit_[static_cast<std::size_t>(point.sample) * study_.vary.size() + k]);
    }
  }
  point.settings = study_.settings;
  if (!study_.variants.empty()) {
    const auto& more = study_.variants[point.variant].settings;
    point.settings.insert(point.settings.end(), more.begin(), more.end());
  }
  for (std::size_t k = 0; k < study_.vary.size(); ++k) {
    const std::string& key = study_.vary[k].key;
    point.settings.push_back(
        {.key = key, .value = point.values[k], .said = "--set " + key + "=" + point.values[k]});
  }
  std::string text;
  for (const TomlSetting& one : point.settings) text += one.key + "=" + one.value + "\n";
  text += point.seed ? fmt::format("seed={}\n", *point.seed) : "";
  point.name = sha256(text).substr(0, 16);
  return point;
}

}  // namespace tandem::sweep
