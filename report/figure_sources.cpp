#include "report/figure_sources.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

namespace tandem::report {
namespace {

/// "position [deg]" in two parts.
std::pair<std::string, std::string> name_and_unit(const std::string& label) {
  const std::size_t open = label.find(" ["), close = label.rfind(']');
  if (open == std::string::npos || close == std::string::npos || close < open) return {label, ""};
  return {label.substr(0, open), label.substr(open + 2, close - open - 2)};
}

/// Names of its curves, then of its levels: each once.
std::vector<std::string> names_in(const FigurePart& part) {
  std::vector<std::string> names;
  std::set<std::string> there;
  const auto add = [&](std::string name) {
    if (name.empty()) name = name_and_unit(part.figure->y_label).first;
    const std::string first = name;
    for (int k = 2; !there.insert(name).second; ++k) name = fmt::format("{} {}", first, k);
    names.push_back(name);
  };
  for (const Curve* curve : part.curves) add(curve->label);
  for (const Level& level : part.levels) add(level.label);
  return names;
}

}  // namespace

std::vector<FigurePart> parts_of(const Figure& figure) {
  std::vector<FigurePart> parts;
  for (const char log : {'A', 'B', 'C'}) {
    FigurePart part{.figure = &figure};
    if (log != 'A') part.prefix = {log, '/'};
    for (const Curve& curve : figure.curves)
      if (std::max(curve.log, 'A') == log) part.curves.push_back(&curve);
    if (log == 'A') part.levels = figure.levels;
    if (!part.curves.empty() || !part.levels.empty()) parts.push_back(std::move(part));
  }
  return parts;
}

Result<std::vector<std::string>> add_source(const FigurePart& part, studio::SignalTable& table) {
  const Figure& figure = *part.figure;
  hal::Layout layout;
  const std::string unit = name_and_unit(figure.y_label).second;
  const std::vector<std::string> names = names_in(part);
  for (const std::string& name : names) {
    layout.add(name, hal::FieldType::kF64, 1, fmt::format("[{}] {}", unit, figure.title));
  }
  const std::string source = part.prefix + "report/" + figure.name;
  if (const auto added = table.add(source, layout); !added) return std::unexpected(added.error());
  std::vector<std::string> full;
  for (const std::string& name : names) full.push_back(source + "." + name);
  return full;
}

void add_curves(const FigurePart& part, Spans& spans) {
  std::size_t signal = part.first;
  for (const Curve* curve : part.curves) {
    for (std::size_t i = 0; i < curve->x.size(); ++i) {
      const auto row = spans.grid().row_of(curve->x[i]);
      if (row) spans.add(signal, *row, static_cast<float>(curve->y[i]));
    }
    spans.hold(signal++, spans.grid().held_rows(usual_step(curve->x), true));
  }
  for (const Level& level : part.levels) {
    for (std::size_t row = 0; row < spans.grid().rows; ++row)
      spans.add(signal, row, static_cast<float>(level.y));
    ++signal;
  }
}

}  // namespace tandem::report
