// Figures and table of a robot and the one that was simulated beside it: first minus second.
#include "report/run_figures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace tandem::report {
namespace {

constexpr std::size_t kJointsDrawn = 3;
constexpr CurveStyle kDrawnAs[kJointsDrawn] = {CurveStyle::kMeasured, CurveStyle::kSecond,
                                               CurveStyle::kThird};

/// One signal of the first minus the same of the second, in the rows that both have.
struct Apart {
  std::vector<double> time_s, value;
  double square_sum = 0.0, max = 0.0;

  [[nodiscard]] double rms() const {
    return std::sqrt(square_sum / static_cast<double>(std::max<std::size_t>(1, value.size())));
  }
};

Apart apart(const RunData& run, const std::vector<double>& a, const RunData& second,
            const std::vector<double>& b) {
  Apart found;
  std::size_t other = 0;
  for (std::size_t row = 0; row < run.rows(); ++row) {
    while (other < second.rows() && second.time_s[other] < run.time_s[row]) ++other;
    if (other == second.rows()) break;
    if (second.time_s[other] != run.time_s[row]) continue;  // a command that the second missed
    const double value = a[row] - b[other];
    found.time_s.push_back(run.time_s[row]);
    found.value.push_back(value);
    found.square_sum += value * value;
    found.max = std::max(found.max, std::abs(value));
  }
  return found;
}

std::vector<Apart> each_joint(const RunData& run, const Columns& a, const RunData& second,
                              const Columns& b) {
  std::vector<Apart> all;
  for (std::size_t j = 0; j < a.size(); ++j) all.push_back(apart(run, a[j], second, b[j]));
  return all;
}

/// Joints by their difference, the largest first.
std::vector<std::size_t> largest(const std::vector<Apart>& joints) {
  std::vector<std::size_t> order(joints.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](std::size_t j) { return joints[j].square_sum; });
  return order;
}

Curve curve_between(std::string label, CurveStyle style, const Apart& one, double factor) {
  Curve curve{std::move(label), style, one.time_s, one.value};
  for (double& value : curve.y) value *= factor;
  return curve;
}

/// "deg", "mm", or both of what is drawn.
std::string unit_of(bool slide, bool turn, const char* turning, const char* sliding) {
  if (slide && turn) return fmt::format("{}, {}", turning, sliding);
  return slide ? sliding : turning;
}

/// @param angles  positions: in degrees, of a prismatic joint in mm
Figure joints_figure(const RunData& run, const std::vector<Apart>& joints, bool angles) {
  Figure figure;
  figure.name = angles ? "position_difference" : "torque_difference";
  figure.title = fmt::format("{} of A minus that of B: the joints that differ most",
                             angles ? "Position" : "Torque");
  figure.x_label = "time since the first SYNC [s]";
  bool slide = false, turn = false;
  const std::vector<std::size_t> order = largest(joints);
  for (std::size_t i = 0; i < std::min(kJointsDrawn, order.size()); ++i) {
    const std::size_t j = order[i];
    const double factor = !angles ? 1.0 : (run.slides(j) ? 1e3 : kDegrees);
    (run.slides(j) ? slide : turn) = true;
    figure.curves.push_back(
        curve_between(run.robot.joints[j].name, kDrawnAs[i], joints[j], factor));
  }
  figure.y_label = fmt::format("difference [{}]", angles ? unit_of(slide, turn, "deg", "mm")
                                                         : unit_of(slide, turn, "Nm", "N"));
  return figure;
}

}  // namespace

std::vector<Figure> difference_figures(const RunData& run, const RunData& second) {
  std::vector<Figure> figures;
  figures.push_back(
      joints_figure(run, each_joint(run, run.position_rad, second, second.position_rad), true));
  figures.push_back(
      joints_figure(run, each_joint(run, run.torque_Nm, second, second.torque_Nm), false));
  const Subjects subjects = subjects_of(run);
  if (subjects.foot_sensors.empty()) return figures;
  const int sensor = subjects.foot_sensors.front();
  Figure force;
  force.name = "force_difference";
  force.title = "Vertical force of A minus that of B";
  force.x_label = "time since the first SYNC [s]";
  force.y_label = "difference [N]";
  force.curves.push_back(curve_between(
      run.robot.sensors[static_cast<std::size_t>(sensor)].name, CurveStyle::kMeasured,
      apart(run, vertical_force(run, sensor), second, vertical_force(second, sensor)), 1.0));
  figures.push_back(std::move(force));
  return figures;
}

PageTable differences_table(const RunData& run, const RunData& second) {
  PageTable table{"Differences, A minus B",
                  "Of the measured link positions and torques. The largest difference of torque "
                  "first; of a prismatic joint mm and N.",
                  {"joint", "position rms [deg]", "max [deg]", "torque rms [Nm]", "max [Nm]"},
                  {}};
  const auto torque = each_joint(run, run.torque_Nm, second, second.torque_Nm);
  const auto position = each_joint(run, run.position_rad, second, second.position_rad);
  for (const std::size_t j : largest(torque)) {
    const double factor = run.slides(j) ? 1e3 : kDegrees;
    table.rows.push_back(
        {run.robot.joints[j].name, fmt::format("{:.5f}", position[j].rms() * factor),
         fmt::format("{:.5f}", position[j].max * factor), fmt::format("{:.4f}", torque[j].rms()),
         fmt::format("{:.4f}", torque[j].max)});
  }
  return table;
}

}  // namespace tandem::report
