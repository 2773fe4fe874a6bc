// The forces and moments that a run estimated at the places of its [[estimation.wrench]].
#include "report/run_figures.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "base/file_name.hpp"

namespace tandem::report {
namespace {

/// Half of a wrench.
struct Quantity {
  const char* name;
  const char* field;
  const char* unit;
};
constexpr Quantity kQuantities[] = {{"force", "external_force_n", "N"},
                                    {"moment", "external_moment_nm", "Nm"}};

Figure figure_of(const std::string& site, const Quantity& what, log::TimeSeries& table,
                 std::size_t first) {
  constexpr std::pair<const char*, CurveStyle> kAxes[] = {
      {"x", CurveStyle::kMeasured}, {"y", CurveStyle::kSecond}, {"z", CurveStyle::kFourth}};
  Figure figure;
  const std::string name = what.name;
  figure.name = "external_" + name + "_" + topic_token(site);
  figure.title = site + ": " + name + " on the robot by the joints' external torques, world axes";
  figure.x_label = "time since the first SYNC [s]";
  figure.y_label = name + " [" + what.unit + "]";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    figure.curves.push_back({kAxes[axis].first, kAxes[axis].second, table.time_s,
                             std::move(table.columns[first + axis])});
  }
  return figure;
}

}  // namespace

Result<std::vector<Figure>> wrench_figures(const RunData& run) {
  std::vector<Figure> figures;
  if (run.wrenches.empty()) return figures;
  const auto file = log::LogFile::open(run.path);
  if (!file) return std::unexpected(file.error());
  if (file->find("/tandem/estimate") == nullptr) return figures;
  std::vector<log::Column> columns;
  const std::size_t values = 3 * run.wrenches.size();
  for (const Quantity& what : kQuantities)
    for (std::size_t i = 0; i < values; ++i) columns.push_back({what.field, i});
  auto table = file->read("/tandem/estimate", columns);
  if (!table) return std::unexpected(table.error());
  const auto& times = table->time_s;
  const auto first = std::ranges::lower_bound(times, run.time_s.front()) - times.begin();
  const auto last = std::ranges::upper_bound(times, run.time_s.back()) - times.begin();
  const auto cut = [&](std::vector<double>& column) {
    column.assign(column.begin() + first, column.begin() + last);
  };
  for (std::vector<double>& column : table->columns) cut(column);
  cut(table->time_s);
  if (table->time_s.size() < 2) return figures;
  for (std::size_t i = 0; i < run.wrenches.size(); ++i)
    for (std::size_t k = 0; k < std::size(kQuantities); ++k)
      figures.push_back(figure_of(run.wrenches[i], kQuantities[k], *table, k * values + 3 * i));
  return figures;
}

}  // namespace tandem::report
