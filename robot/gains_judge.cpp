#include "robot/gains_judge.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "robot/posture.hpp"

namespace tandem::robot {
namespace {

using hal::PidLoop;

constexpr int kPostures = 32;  // of which the range is made, beside the one that is given

bool any(const hal::PidGains& gains) { return gains.kp > 0.0 || gains.ki > 0.0 || gains.kd > 0.0; }

std::vector<PidLoop> loops_around(PidLoop loop) {
  if (loop == PidLoop::kTorque) return {PidLoop::kTorque, PidLoop::kPosition, PidLoop::kVelocity};
  return {loop};
}

/// Somewhere within the limits; of a joint that turns without end, in one turn.
std::vector<double> some_posture(const hal::RobotConfig& robot, std::mt19937_64& random) {
  std::vector<double> position_rad;
  for (const hal::JointConfig& joint : robot.joints) {
    const double low = std::max(joint.min_position_rad, -std::numbers::pi);
    const double high = std::max(low, std::min(joint.max_position_rad, std::numbers::pi));
    const double share = static_cast<double>(random() >> 11) * 0x1p-53;
    position_rad.push_back(low + share * (high - low));
  }
  return position_rad;
}

/// The largest factor below 1 for which `good` holds, to a percent; 0 may be it. Empty: none.
std::optional<double> largest_factor(const std::function<bool(double)>& good) {
  if (!good(0.0)) return {};
  double low = 0.0, high = 1.0;
  while (high - low > 0.01 * high && high > 1e-3) {
    const double middle = low > 0.0 ? std::sqrt(low * high) : 0.1 * high;
    (good(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace

GainsJudge::GainsJudge(const hal::RobotConfig& robot, const tandem_kernels* kernels)
    : robot_(robot), kernels_(kernels), rows_(robot.joints.size()), range_(robot.joints.size()) {
  if (kernels == nullptr || !robot.loops.empty()) return;
  for (std::size_t i = 0; i < kernels->joints; ++i) {
    const int joint = robot.joint_index(kernels->joint_names[i]);
    if (joint >= 0) rows_[static_cast<std::size_t>(joint)] = kernels->nv - kernels->joints + i;
  }
  std::mt19937_64 random(1);
  for (int k = 0; k < kPostures; ++k) {
    const std::vector<Inertias> here = inertias_at(some_posture(robot, random));
    for (std::size_t j = 0; j < here.size(); ++j) {
      Inertias& all = range_[j];
      all.free_kg_m2 = k == 0 ? here[j].free_kg_m2 : std::min(all.free_kg_m2, here[j].free_kg_m2);
      all.locked_kg_m2 = std::max(all.locked_kg_m2, here[j].locked_kg_m2);
    }
  }
}

std::vector<GainsJudge::Inertias> GainsJudge::inertias_at(
    std::span<const double> position_rad) const {
  hal::PostureConfig posture;
  posture.position_rad.assign(position_rad.begin(), position_rad.end());
  for (double& position : posture.position_rad) {
    if (!std::isfinite(position)) position = 0.0;  // not measured
  }
  const std::vector<double> q = coordinates_at(robot_, *kernels_, &posture);
  const auto n = static_cast<Eigen::Index>(kernels_->nv);
  Eigen::MatrixXd M(n, n);  // symmetric
  kernels_->mass_matrix(q.data(), M.data());
  const Eigen::VectorXd mobility = M.inverse().diagonal();
  std::vector<Inertias> out(rows_.size());
  for (std::size_t j = 0; j < rows_.size(); ++j) {
    if (!rows_[j]) continue;
    const auto row = static_cast<Eigen::Index>(*rows_[j]);
    out[j] = {1.0 / mobility(row), M(row, row)};
  }
  return out;
}

std::string GainsJudge::unknown(std::size_t joint) const {
  if (kernels_ == nullptr) return "there is no model of the robot";
  if (!robot_.loops.empty()) return "the robot has closed loops";
  if (!rows_[joint]) return "the model does not have this joint";
  const hal::BoardConfig* board = robot_.board(robot_.joints[joint].board);
  if (board == nullptr) return "the joint is on no board";
  if (!board->eds.empty()) return "nothing is known of the loops in its drive, which is not ours";
  return {};
}

std::optional<LoopVerdict> GainsJudge::judge(std::size_t joint, PidLoop loop, const Gains& gains,
                                             std::span<const double> position_rad,
                                             bool with_margin) const {
  const hal::JointConfig& config = robot_.joints[joint];
  const double period_s = static_cast<double>(robot_.board(config.board)->control_period_ns) * 1e-9;
  hal::GainsConfig wanted = robot_.gains_of(config);
  wanted.position.gains = gains[static_cast<std::size_t>(PidLoop::kPosition)];
  wanted.velocity.gains = gains[static_cast<std::size_t>(PidLoop::kVelocity)];
  wanted.torque.gains = gains[static_cast<std::size_t>(PidLoop::kTorque)];
  const Inertias here = inertias_at(position_rad)[joint];
  const std::array inertias{here.free_kg_m2, here.locked_kg_m2, range_[joint].free_kg_m2,
                            range_[joint].locked_kg_m2};
  std::optional<LoopVerdict> worst;
  for (const PidLoop one : loops_around(loop)) {
    if (!any(gains[static_cast<std::size_t>(one)])) continue;
    const LoopVerdict verdict =
        judge_loop({one, robot_.actuator_of(config), wanted, period_s}, inertias, with_margin);
    if (!worst || verdict.worse_than(*worst)) worst = verdict;
  }
  return worst;
}

std::string GainsJudge::remedy(std::size_t joint, PidLoop loop, const Gains& gains,
                               std::span<const double> position_rad) const {
  const hal::PidGains wanted = gains[static_cast<std::size_t>(loop)];
  const auto good = [&](const hal::PidGains& one) {
    Gains all = gains;
    all[static_cast<std::size_t>(loop)] = one;
    const auto verdict = judge(joint, loop, all, position_rad);
    return !verdict || (verdict->stable() && !(verdict->phase_margin_deg < kLowMargin_deg));
  };
  std::vector<std::string> ways;
  const auto lower = largest_factor([&](double factor) {
    return good({wanted.kp, factor * wanted.ki, wanted.kd});
  });
  if (lower && wanted.ki > 0.0) ways.push_back(fmt::format("ki = {:.2g}", *lower * wanted.ki));
  for (double kd = 1e-3 * wanted.kp; kd < 0.3 * wanted.kp && kd >= 0.0 && wanted.kp > 0.0;
       kd *= 1.5) {
    if (kd <= wanted.kd || !good({wanted.kp, wanted.ki, kd})) continue;
    ways.push_back(fmt::format("kd = {:.2g}", kd));
    break;
  }
  if (ways.empty()) {
    const auto share = largest_factor([&](double factor) {
      return good({factor * wanted.kp, factor * wanted.ki, factor * wanted.kd});
    });
    if (share && *share > 0.0) {
      ways.push_back(fmt::format("kp = {:.2g}, ki = {:.2g}, kd = {:.2g}", *share * wanted.kp,
                                 *share * wanted.ki, *share * wanted.kd));
    }
  }
  if (ways.empty()) return {};
  return fmt::format("{} gives it a phase margin of {:g} deg", fmt::join(ways, ", or "),
                     kLowMargin_deg);
}

}  // namespace tandem::robot
