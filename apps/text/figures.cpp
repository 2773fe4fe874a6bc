#include "apps/text/figures.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "base/counted.hpp"

namespace tandem::apps {
namespace {

/// Units that people read instead of a key's own.
struct ShownUnit {
  std::string_view suffix, unit;
  double factor;
};
constexpr ShownUnit kShownUnits[] = {{"_rad", "deg", 180.0 / std::numbers::pi},
                                     {"_m", "mm", 1e3},
                                     {"_s", "ms", 1e3},
                                     {"_bytes", "kB", 1e-3},
                                     {"_ns", "us", 1e-3},
                                     {"_ns", "ms", 1e-6},
                                     {"_ns", "s", 1e-9},
                                     {"", "%", 100.0}};

double factor_of(std::string_view path, std::string_view unit) {
  for (const ShownUnit& one : kShownUnits)
    if (one.unit == unit && path.ends_with(one.suffix)) return one.factor;
  return 1.0;
}

const Json* figure_at(const Json& figures, std::string_view path) {
  const Json* at = &figures;
  while (!path.empty()) {
    const std::string key(path.substr(0, path.find('.')));
    path.remove_prefix(std::min(path.size(), key.size() + 1));
    if (!at->is_object() || !at->contains(key)) return nullptr;
    at = &(*at)[key];
  }
  return at;
}

std::string number_text(const Json& value, std::string_view format, double factor) {
  if (format.empty()) return value.is_string() ? value.get<std::string>() : value.dump();
  const double shown = value.get<double>() * factor;
  return fmt::vformat(fmt::format("{{:{}}}", format), fmt::make_format_args(shown));
}

/// @param place  "path:format unit", "path|one|many"
/// @param unit   of what follows; the place's own when it has one
std::optional<std::string> place_text(std::string_view place, const Json& figures,
                                      std::string& unit) {
  const std::string_view path = place.substr(0, place.find_first_of(":|"));
  const Json* value = figure_at(figures, path);
  if (value == nullptr || value->is_null() || (value->is_array() && value->empty()))
    return std::nullopt;
  if (value->is_number_float() && !std::isfinite(value->get<double>())) return std::nullopt;
  std::string_view how = place.substr(std::min(place.size(), path.size() + 1));
  if (place.substr(path.size()).starts_with('|')) {
    const std::string_view one = how.substr(0, how.find('|'));
    how.remove_prefix(std::min(how.size(), one.size() + 1));
    return counted(value->get<std::uint64_t>(), one, how);
  }
  const std::string_view format = how.substr(0, how.find(' '));
  const std::string_view own = how.substr(std::min(how.size(), format.size() + 1));
  if (!own.empty()) unit = own;
  const double factor = factor_of(path, unit);
  std::string text;
  if (value->is_structured()) {  // percentiles, a list
    for (const Json& one : *value)
      text += (text.empty()        ? ""
               : value->is_array() ? ", "
                                   : " / ") +
              number_text(one, format, factor);
  } else {
    text = number_text(*value, format, factor);
  }
  return own.empty() ? text : text + " " + unit;
}

}  // namespace

std::optional<std::string> figures_text(std::string_view text, const Json& figures,
                                        std::string_view unit_after) {
  std::string out, unit(unit_after);
  for (;;) {  // from its end, as a unit counts for what is before it
    const std::size_t end = text.rfind('}');
    if (end == std::string_view::npos) return std::string(text) + out;
    const std::size_t begin = text.rfind('{', end);
    const auto figure = place_text(text.substr(begin + 1, end - begin - 1), figures, unit);
    if (!figure) return std::nullopt;
    out = *figure + std::string(text.substr(end + 1)) + out;
    text = text.substr(0, begin);
  }
}

void add_figures(Facts& facts, const Json& figures, const std::string& name,
                 std::string_view text) {
  if (const auto shown = figures_text(text, figures)) facts.add(name, *shown);
}

void add_figures(Facts& facts, const Json& figures,
                 std::initializer_list<std::pair<const char*, std::string>> rows) {
  for (const auto& [name, text] : rows) add_figures(facts, figures, name, text);
}

Table figures_table(const std::vector<Column>& columns, const Json& results) {
  std::vector<std::string> header;
  for (const Column& column : columns) header.push_back(column.header);
  Table table(std::move(header));
  for (const auto& [name, result] : results.items()) {
    std::vector<std::string> row;
    for (const auto& [title, text] : columns) {
      std::string_view unit = std::string_view(title).substr(title.find_last_of('[') + 1);
      unit = unit.substr(0, unit.find(']'));
      row.push_back(text.empty() ? name : figures_text(text, result, unit).value_or("-"));
    }
    table.add(std::move(row));
  }
  return table;
}

}  // namespace tandem::apps
