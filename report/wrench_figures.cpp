#include "report/wrench_figures.hpp"

#include <algorithm>
#include <utility>

#include "base/file_name.hpp"

namespace tandem::report {
namespace {

Figure force_figure(const std::string& site, log::Table& table, std::size_t first) {
  constexpr std::pair<const char*, CurveStyle> kAxes[] = {
      {"x", CurveStyle::kMeasured}, {"y", CurveStyle::kSecond}, {"z", CurveStyle::kFourth}};
  Figure figure;
  figure.name = "external_force_" + topic_token(site);
  figure.title = site + ": force on the robot by the joints' external torques, world axes";
  figure.x_label = "time since the first SYNC [s]";
  figure.y_label = "force [N]";
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
  for (std::size_t i = 0; i < 3 * run.wrenches.size(); ++i)
    columns.push_back({"external_force_n", i});
  auto table = file->read("/tandem/estimate", columns);
  if (!table) return std::unexpected(table.error());
  const auto& times = table->time_s;
  const auto first = std::ranges::lower_bound(times, run.time_s.front()) - times.begin();
  const auto last = std::ranges::upper_bound(times, run.time_s.back()) - times.begin();
  const auto cut = [&](std::vector<double>& values) {
    values.assign(values.begin() + first, values.begin() + last);
  };
  for (std::vector<double>& column : table->columns) cut(column);
  cut(table->time_s);
  if (table->time_s.size() < 2) return figures;
  for (std::size_t i = 0; i < run.wrenches.size(); ++i)
    figures.push_back(force_figure(run.wrenches[i], *table, 3 * i));
  return figures;
}

}  // namespace tandem::report
