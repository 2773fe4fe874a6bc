// Figures of a run, from its columns.
#include "report/run_data.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "log/run_window.hpp"

namespace tandem::report {

const RunFault* RunData::stop() const {
  const auto first = std::ranges::find(faults, true, &RunFault::stops);
  return first == faults.end() ? nullptr : &*first;
}

double RunData::ran_s() const {
  return controllers_ran && !time_s.empty() ? time_s[rows_before_stop() - 1] - time_s.front() : 0.0;
}

std::size_t RunData::rows_before_stop() const {
  if (stop() == nullptr) return rows();
  const auto after = std::ranges::upper_bound(time_s, stop()->time_s + log::kHalfNanosecond);
  return std::max<std::size_t>(1, static_cast<std::size_t>(after - time_s.begin()));
}

std::size_t RunData::first_channel(std::size_t index) const {
  std::size_t first = 0;
  for (std::size_t i = 0; i < index; ++i) first += robot.sensors[i].channels();
  return first;
}

model::Placement RunData::base_placement(std::size_t row) const {
  if (!motion_known() || !robot.model.floating_base) return {};
  const Eigen::Quaterniond rotation(base[6][row], base[3][row], base[4][row], base[5][row]);
  return {rotation.normalized().toRotationMatrix(),
          Eigen::Vector3d(base[0][row], base[1][row], base[2][row])};
}

std::vector<double> RunData::positions(std::size_t row) const {
  std::vector<double> q;
  for (const std::vector<double>& joint : position_rad) q.push_back(joint[row]);
  for (const std::vector<double>& joint : passive_rad) q.push_back(joint[row]);
  return q;
}

std::vector<double> RunData::measured(const Columns& columns, std::size_t joint) const {
  constexpr double kNoNumber = 0x7300;  // CiA 402: a sensor
  std::vector<double> values = columns[joint];
  for (std::size_t row = 0; !drive_fault.empty() && row < values.size(); ++row) {
    if (drive_fault[joint][row] == kNoNumber)
      values[row] = std::numeric_limits<double>::quiet_NaN();
  }
  return values;
}

bool RunData::slides(std::size_t joint) const {
  const int index = tree.joint_index(robot.joints[joint].name);
  return index >= 0 &&
         tree.joints[static_cast<std::size_t>(index)].type == model::JointType::kPrismatic;
}

std::vector<Tracking> RunData::tracking() const {
  std::vector<Tracking> all;
  const std::size_t until = rows_before_stop();
  for (std::size_t j = 0; j < position_rad.size(); ++j) {
    Tracking one{robot.joints[j].name, slides(j), 0.0, 0.0, 0.0};
    std::size_t samples = 0;
    for (std::size_t row = 0; row < until; ++row) {
      one.max_torque_Nm = std::max(one.max_torque_Nm, std::abs(torque_Nm[j][row]));
      const double error = reference_rad[j][row] - position_rad[j][row];
      if (std::isnan(error)) continue;
      one.rms_rad += error * error;
      one.max_rad = std::max(one.max_rad, std::abs(error));
      ++samples;
    }
    if (samples == 0) continue;
    one.rms_rad = std::sqrt(one.rms_rad / static_cast<double>(samples));
    all.push_back(one);
  }
  std::ranges::stable_sort(all, std::ranges::greater{}, &Tracking::rms_rad);
  return all;
}

std::vector<FootFigures> RunData::feet() const {
  std::vector<FootFigures> all;
  const std::size_t until = rows_before_stop();
  for (std::size_t i = 0; truth() && i < robot.contact.feet.size(); ++i) {
    FootFigures one{.name = robot.contact.feet[i].site};
    const std::vector<double>& up_N = foot_force_N[3 * i + 2];
    const std::vector<double>& x = foot_position_m[3 * i];
    const std::vector<double>& y = foot_position_m[3 * i + 1];
    std::size_t touched = 0;
    for (std::size_t row = 0; row < until; ++row) {
      one.mean_force_N += up_N[row] / static_cast<double>(until);
      one.max_force_N = std::max(one.max_force_N, up_N[row]);
      if (!(up_N[row] > 0.0)) continue;
      if (row > 0 && !(up_N[row - 1] > 0.0)) touched = row;
      one.slip_m = std::max(one.slip_m, std::hypot(x[row] - x[touched], y[row] - y[touched]));
    }
    all.push_back(one);
  }
  return all;
}

}  // namespace tandem::report
