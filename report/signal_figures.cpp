// What the controllers of a run told of themselves: a figure for each signal.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "log/signal_name.hpp"
#include "report/run_figures.hpp"

namespace tandem::report {
namespace {

constexpr std::size_t kMostFigures = 12;
constexpr CurveStyle kSignalStyles[] = {CurveStyle::kMeasured, CurveStyle::kSecond,
                                        CurveStyle::kFourth,   CurveStyle::kSeventh,
                                        CurveStyle::kFifth,    CurveStyle::kSixth};
constexpr double kStillShare = 1e-3;  // of the largest change: a thousandth is none to be seen

/// "[m] of the crouch": unit and words. Empty: it is no signal.
std::pair<std::string, std::string> parts_of(const hal::Field& field) {
  const auto end = field.doc.find(']');
  if (field.type != hal::FieldType::kF64 || !field.doc.starts_with('[') || end == std::string::npos)
    return {};
  return {field.doc.substr(0, end + 1), field.doc.substr(end + 1)};
}

/// How far the numbers of a column are apart.
double range_of(const std::vector<double>& column) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : column) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  return high >= low ? high - low : -1.0;
}

/// Those of its numbers that change most come first; the ones that stand still are thin and grey.
Figure figure_of(const RunData& run, const std::string& controller, const hal::Field& field,
                 log::TimeSeries& table) {
  const auto [unit, words] = parts_of(field);
  Figure figure;
  figure.name = "signal_" + controller + "-" + field.name;
  figure.title = controller + "." + field.name + ":" + words;
  figure.x_label = time_label(run);
  figure.y_label = field.name + (unit == "[]" ? "" : " " + unit);
  std::vector<std::size_t> order(table.columns.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](std::size_t i) { return range_of(table.columns[i]); });
  order.resize(std::min(order.size(), std::size(kSignalStyles)));
  if (order.size() < table.columns.size()) figure.title += " (the largest changes)";
  const double largest = range_of(table.columns[order.front()]);
  for (std::size_t k = 0; k < order.size(); ++k) {
    std::vector<double>& column = table.columns[order[k]];
    const bool still = largest > 0.0 && range_of(column) <= kStillShare * largest;
    const std::string name = log::signal_name(field, order[k], run.info);
    figure.signals.push_back("controller/" + controller + "." + name);
    figure.curves.push_back({field.count == 1 ? std::string() : name,
                             still ? CurveStyle::kStill : kSignalStyles[k], table.time_s,
                             std::move(column)});
  }
  drop_empty_curves(figure);
  return figure;
}

}  // namespace

Result<std::vector<Figure>> signal_figures(const RunData& run, std::vector<std::string>& remarks) {
  constexpr std::string_view kTopics = "/tandem/controller/";
  std::vector<Figure> figures;
  const auto file = log::LogFile::open(run.path);
  if (!file) return std::unexpected(file.error());
  std::size_t more = 0;
  for (const log::LoggedTopic& topic : file->topics()) {
    if (!topic.name.starts_with(kTopics) || topic.messages < 2) continue;
    const std::string controller = topic.name.substr(kTopics.size());
    for (const hal::Field& field : topic.layout.fields()) {
      if (parts_of(field).first.empty()) continue;
      if (figures.size() == kMostFigures) {
        ++more;
        continue;
      }
      std::vector<log::Column> columns;
      for (std::size_t i = 0; i < field.count; ++i) columns.push_back({field.name, i});
      auto table = file->read(topic.name, columns);
      if (!table) return std::unexpected(table.error());
      Figure figure = figure_of(run, controller, field, *table);
      if (!figure.curves.empty()) figures.push_back(std::move(figure));
    }
  }
  if (more > 0) {
    remarks.push_back(std::to_string(more) +
                      " more signals of controllers are not drawn: "
                      "`tandem log csv --topic` has them");
  }
  return figures;
}

}  // namespace tandem::report
