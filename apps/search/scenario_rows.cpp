#include "apps/search/scenario_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>

#include "apps/text/relative_path.hpp"
#include "base/quoting.hpp"
#include "base/toml_reader.hpp"
#include "base/toml_setting.hpp"

namespace tandem::apps {
namespace {

constexpr std::array kRowKinds{"push",      "fault",      "event",    "sim.payload",
                               "sim.patch", "sim.ground", "sim.shake"};

/// How a value becomes simpler.
enum class Simpler : std::uint8_t {
  kRounder,  // 0, fewer digits
  kSmaller,  // nearer to 0: what it says is less
  kWords,    // not at all
};
struct SimplerKey {
  const char* key;
  Simpler how;
  bool left_out;  // its default is simpler
};
/// All others become rounder, if they are numbers.
constexpr SimplerKey kSimplerKeys[] = {
    {"force_N", Simpler::kSmaller, false},
    {"torque_Nm", Simpler::kSmaller, false},
    {"impulse_Ns", Simpler::kSmaller, false},
    {"impulse_Nms", Simpler::kSmaller, false},
    {"mass_kg", Simpler::kSmaller, false},
    {"rad", Simpler::kSmaller, false},
    {"for_s", Simpler::kSmaller, false},
    {"for_cycles", Simpler::kSmaller, false},
    {"count", Simpler::kSmaller, false},
    {"bits", Simpler::kSmaller, true},
    {"probability", Simpler::kSmaller, false},
    {"after_s", Simpler::kRounder, true},
    {"point_m", Simpler::kRounder, true},
    {"com_m", Simpler::kRounder, true},
    {"inertia_kg_m2", Simpler::kRounder, true},
    {"ramp_s", Simpler::kRounder, true},
    {"sliding_friction", Simpler::kRounder, true},
    {"static_friction", Simpler::kRounder, true},
    {"stiffness_share", Simpler::kRounder, true},
    {"seed", Simpler::kRounder, true},
    {"shape", Simpler::kWords, true},
    {"frame", Simpler::kWords, true},
};

std::string trimmed_line(std::string_view line) {
  const std::size_t from = line.find_first_not_of(" \t\r");
  if (from == std::string_view::npos) return {};
  return std::string(line.substr(from, line.find_last_not_of(" \t\r") + 1 - from));
}

/// Whether what follows a line's end is still the value that began in it or before: brackets that
/// are open, or a text of several lines.
class OpenValue {
 public:
  [[nodiscard]] bool is_open() const { return depth_ > 0 || !quotes_.empty(); }
  void take(std::string_view line) {
    for (std::size_t at = 0; at < line.size();) {
      if (!quotes_.empty()) {
        if (quotes_[0] == '"' && line[at] == '\\') {
          at += 2;
        } else if (line.substr(at).starts_with(quotes_)) {
          at += quotes_.size();
          quotes_.clear();
        } else {
          ++at;
        }
        continue;
      }
      const char letter = line[at];
      if (letter == '#') return;
      if (letter == '"' || letter == '\'') {
        const std::string three(3, letter);
        quotes_ = line.substr(at).starts_with(three) ? three : std::string(1, letter);
        at += quotes_.size();
        continue;
      }
      if (letter == '[' || letter == '{') ++depth_;
      if (letter == ']' || letter == '}') --depth_;
      ++at;
    }
  }

 private:
  int depth_ = 0;
  std::string quotes_;
};

/// The name of a header; empty: the line is none. @param twice  of [[name]]
std::string header_name(const std::string& line, bool& twice) {
  if (!line.starts_with('[')) return {};
  twice = line.starts_with("[[");
  const std::size_t from = twice ? 2 : 1;
  const std::size_t to = line.find(']');
  return to == std::string::npos ? std::string() : trimmed_line(line.substr(from, to - from));
}

bool is_row_kind(const std::string& name) {
  return std::ranges::find(kRowKinds, name) != kRowKinds.end();
}

/// Whether the table `name` is of a row of the kind `kind`: [event.ask] of [[event]].
bool is_of_row(const std::string& name, const std::string& kind) {
  return !kind.empty() && name.starts_with(kind + ".");
}

std::size_t tables_in(const TomlTable& root, const std::string& kind) {
  const auto values = root.values();
  std::size_t count = 0;
  while (std::ranges::any_of(values, [&](const auto& one) {
    return one.first.starts_with(fmt::format("{}[{}].", kind, count));
  }))
    ++count;
  return count;
}

/// A value's numbers; empty: it has something else.
std::vector<double> numbers_of(std::string_view value) {
  std::vector<double> numbers;
  const bool list = value.starts_with('[');
  std::string_view rest = list ? value.substr(1, value.size() - 2) : value;
  while (!rest.empty()) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (error != std::errc() || !std::isfinite(number)) return {};
    numbers.push_back(number);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    if (!rest.empty() && !rest.starts_with(", ")) return {};
    if (!rest.empty()) rest.remove_prefix(2);
  }
  return numbers;
}

/// A number with so many significant digits. @param down  towards 0
double with_digits(double number, int digits, bool down) {
  if (number == 0.0) return 0.0;
  const double place = std::floor(std::log10(std::abs(number))) - (digits - 1);
  const double scaled = number * std::pow(10.0, -place);
  const double whole = down ? std::trunc(scaled + std::copysign(1e-9, scaled)) : std::round(scaled);
  // By its text: 3 * 10^-1 is not 0.3.
  return std::stod(fmt::format("{:.{}e}", whole * std::pow(10.0, place), digits - 1));
}

std::string value_of(const std::vector<double>& numbers, bool list) {
  return list ? fmt::format("[{}]", fmt::join(numbers, ", ")) : fmt::format("{}", numbers.front());
}

int digits_of(double number) {
  for (int digits = 0; digits < 17; ++digits) {
    if (digits == 0 ? number == 0.0 : with_digits(number, digits, false) == number) return digits;
  }
  return 17;
}

/// How much there is to simplify: digits, or what the numbers amount to.
double size_of(const std::vector<double>& numbers, Simpler how) {
  double size = 0.0;
  for (const double one : numbers)
    size += how == Simpler::kSmaller ? std::abs(one) : digits_of(one);
  return size;
}

std::vector<std::vector<double>> simpler_numbers(const std::vector<double>& numbers, Simpler how) {
  std::vector<std::vector<double>> all;
  const auto add = [&](const auto& change) {
    std::vector<double> next = numbers;
    for (std::size_t i = 0; i < next.size(); ++i) next[i] = change(next[i], i);
    if (size_of(next, how) < size_of(numbers, how) && std::ranges::find(all, next) == all.end())
      all.push_back(std::move(next));
  };
  if (how == Simpler::kRounder) add([](double, std::size_t) { return 0.0; });
  for (std::size_t zero = 0; numbers.size() > 1 && zero < numbers.size(); ++zero)
    add([zero](double one, std::size_t i) { return i == zero ? 0.0 : one; });
  if (how == Simpler::kSmaller) {
    for (const double share : {0.5, 0.75, 0.875, 0.9375})
      add([share](double one, std::size_t) { return with_digits(one * share, 2, true); });
    add([](double one, std::size_t) { return with_digits(one, 2, true); });
  } else {
    for (const int digits : {1, 2, 3})
      add([digits](double one, std::size_t) { return with_digits(one, digits, false); });
  }
  return all;
}

/// "push[0].ask.kp": the key without the row that it is of.
std::string short_key(const std::string& key) { return key.substr(key.find("].") + 2); }

SimplerKey simpler_key(const std::string& key) {
  const auto it = std::ranges::find_if(
      kSimplerKeys, [name = short_key(key)](const SimplerKey& one) { return name == one.key; });
  return it == std::end(kSimplerKeys) ? SimplerKey{"", Simpler::kRounder, false} : *it;
}

std::map<std::string, std::string> values_of(const std::string& row) {
  const auto document = TomlDocument::parse(row, "row");
  return document ? document->root().values() : std::map<std::string, std::string>{};
}

/// The row without the line of a key; empty: the key is not alone in one line.
std::string without_key(const std::string& row, const std::string& key) {
  const std::string name = short_key(key);
  std::size_t from = 0;
  while (from < row.size()) {
    const std::size_t end = std::min(row.find('\n', from), row.size() - 1) + 1;
    const std::string line = trimmed_line(std::string_view(row).substr(from, end - from));
    if (line.starts_with(name) && trimmed_line(line.substr(name.size())).starts_with('=')) {
      std::string without = row.substr(0, from) + row.substr(end);
      return values_of(without).contains(key) ? std::string() : without;
    }
    from = end;
  }
  return {};
}

}  // namespace

std::string row_kinds_text() {
  std::string text;
  for (const char* const kind : kRowKinds)
    text += fmt::format("{}[[{}]]", text.empty() ? "" : ", ", kind);
  return text;
}

Result<ScenarioText> ScenarioText::read(const std::string& text, const std::string& file) {
  const auto document = TomlDocument::parse(text, file);
  if (!document) return std::unexpected(document.error());
  ScenarioText out;
  out.between_.emplace_back();
  std::string comment;  // lines that belong to what follows
  std::string kind;     // of the row that is open; empty: none is
  std::map<std::string, std::size_t> found;
  OpenValue value;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size() - 1) + 1;
    const std::string raw = text.substr(from, end - from);
    const std::string line = trimmed_line(std::string_view(raw).substr(0, raw.find('\n')));
    from = end;
    std::string* const open = kind.empty() ? &out.between_.back() : &out.rows_.back().text;
    bool twice = false;
    const std::string header = value.is_open() ? std::string() : header_name(line, twice);
    if (!value.is_open() && header.empty() && line.starts_with('#')) {
      comment += raw;
      continue;
    }
    if (header.empty()) {
      value.take(std::string_view(raw).substr(0, raw.find('\n')));
      *open += comment + raw;
    } else if (twice && is_row_kind(header)) {
      kind = header;
      ++found[kind];
      out.rows_.push_back({.place = out.rows_.size(), .text = comment + raw, .kind = kind});
      out.between_.emplace_back();
    } else {
      if (!is_of_row(header, kind)) kind.clear();
      (kind.empty() ? out.between_.back() : out.rows_.back().text) += comment + raw;
    }
    comment.clear();
  }
  (kind.empty() ? out.between_.back() : out.rows_.back().text) += comment;
  for (const char* one : kRowKinds) {
    if (tables_in(document->root(), one) == found[one]) continue;
    return std::unexpected(
        Error{.message = fmt::format("not all of its '{}' are rows [[{}]]", one, one),
              .hint = fmt::format("write each as [[{}]] with its keys below", one),
              .file = file,
              .key = one});
  }
  return out;
}

std::vector<std::string> ScenarioText::later_kinds() { return {"push", "fault", "event"}; }

std::string ScenarioText::without_later() const {
  const std::vector<std::string> later = later_kinds();
  ScenarioRows rows;
  std::ranges::copy_if(rows_, std::back_inserter(rows), [&](const ScenarioRow& row) {
    return std::ranges::find(later, row.kind) == later.end();
  });
  return with(rows);
}

std::string ScenarioText::with(const ScenarioRows& rows) const {
  std::string text;
  for (std::size_t i = 0; i < between_.size(); ++i) {
    text += between_[i];
    const auto row = std::ranges::find(rows, i, &ScenarioRow::place);
    if (row == rows.end()) continue;
    if (!text.empty() && !text.ends_with('\n')) text += '\n';
    text += row->text;
  }
  return text;
}

std::vector<std::string> keys_of_row(const std::string& row) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : values_of(row)) {
    const SimplerKey rule = simpler_key(key);
    if (rule.left_out || (rule.how != Simpler::kWords && !numbers_of(value).empty()))
      keys.push_back(key);
  }
  std::ranges::stable_partition(
      keys, [](const std::string& key) { return simpler_key(key).how != Simpler::kSmaller; });
  return keys;
}

std::vector<std::string> simpler_rows(const std::string& row, const std::string& key) {
  const auto values = values_of(row);
  const auto value = values.find(key);
  if (value == values.end()) return {};
  SimplerKey rule = simpler_key(key);
  // A shorter blow with the same impulse is a harder one.
  const std::string place = key.substr(0, key.find("].") + 2);
  if (short_key(key) == "for_s" &&
      (values.contains(place + "impulse_Ns") || values.contains(place + "impulse_Nms")))
    rule.how = Simpler::kRounder;
  std::vector<std::string> simpler;
  if (rule.left_out) {
    if (std::string without = without_key(row, key); !without.empty())
      simpler.push_back(std::move(without));
  }
  const std::vector<double> numbers = numbers_of(value->second);
  if (rule.how == Simpler::kWords || numbers.empty()) return simpler;
  for (const std::vector<double>& next : simpler_numbers(numbers, rule.how)) {
    const TomlSetting setting{
        .key = key, .value = value_of(next, value->second.starts_with('[')), .said = key};
    if (auto text = with_settings(row, {setting})) simpler.push_back(std::move(text->text));
  }
  return simpler;
}

std::optional<std::string> scaled_value(const std::string& value, double factor) {
  const auto document = TomlDocument::parse("x = " + value, "value");
  if (!document) return std::nullopt;
  const std::string text = document->root().values()["x"];
  std::vector<double> numbers = numbers_of(text);
  if (numbers.empty()) return std::nullopt;
  for (double& one : numbers) one = std::stod(fmt::format("{:.9g}", one * factor));
  return value_of(numbers, text.starts_with('['));
}

Result<std::string> relocated(const std::string& text, const std::string& file,
                              const std::string& new_file) {
  namespace fs = std::filesystem;
  const auto document = TomlDocument::parse(text, file);
  if (!document) return std::unexpected(document.error());
  const fs::path from = fs::absolute(file).parent_path();
  if (from.lexically_normal() == fs::absolute(new_file).parent_path().lexically_normal())
    return text;
  std::vector<TomlSetting> settings;
  for (const auto& [key, value] : document->root().values()) {
    if (value.size() < 3 || !value.starts_with('"') || value.find('\\') != std::string::npos)
      continue;
    const std::string name = value.substr(1, value.size() - 2);
    const bool path = name.find_first_of("./") != std::string::npos && !name.starts_with('/');
    std::error_code ignored;
    if (!path || !fs::exists(from / name, ignored)) continue;
    settings.push_back({.key = key,
                        .value = quoted_text(relative_path(new_file, (from / name).string())),
                        .said = key});
  }
  auto moved = with_settings(text, settings);
  if (!moved) return std::unexpected(moved.error());
  return std::move(moved->text);
}

}  // namespace tandem::apps
