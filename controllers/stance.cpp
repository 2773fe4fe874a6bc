#include "controllers/stance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/archive.hpp"

namespace tandem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr double kConverged = 1e-5;   // a step below it leaves an error of its square
constexpr double kLongestStep = 0.2;  // [rad or m] in one Newton step

Matrix3d rotation(const std::vector<double>& pose, std::size_t site) noexcept {
  return Eigen::Map<const RowMajor3>(&pose[12 * site]);
}
Vector3d origin(const std::vector<double>& pose, std::size_t site) noexcept {
  return Eigen::Map<const Vector3d>(&pose[12 * site + 9]);
}

/// The middle of the contact points of a site, or its origin when it has none.
std::array<double, 3> middle_of(const hal::RobotConfig& robot, const std::string& site) {
  std::array<double, 3> middle{};
  for (const hal::FootConfig& foot : robot.contact.feet) {
    if (foot.site != site || foot.points_m.empty()) continue;
    for (const auto& point : foot.points_m) {
      for (std::size_t k = 0; k < 3; ++k) {
        middle[k] += point[k] / static_cast<double>(foot.points_m.size());
      }
    }
  }
  return middle;
}

}  // namespace

Stance::Stance(const tandem_kernels& kernels)
    : kernels_(&kernels),
      q_(kernels.nq, 0.0),
      v_(kernels.nv, 0.0),
      tau_(kernels.nv, 0.0),
      zero_(kernels.nv, 0.0),
      pose_(12 * kernels.sites, 0.0),
      twist_(6 * kernels.sites, 0.0),
      acceleration_(6 * kernels.sites, 0.0),
      site_J_(6 * kernels.nv * kernels.sites, 0.0),
      com_J_(3 * kernels.nv, 0.0),
      wrench_(6 * kernels.wrenches, 0.0) {}

Result<Stance> Stance::make(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                            const std::string& left, const std::string& right) {
  Result<ModelMap> map = ModelMap::make(robot, kernels);
  if (!map) return std::unexpected(map.error());
  if (kernels->floating_base == 0) {
    return fail("only a robot with a floating base stands on feet", "choose another controller");
  }
  Stance stance(*kernels);
  stance.map_ = std::move(*map);
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string& name = i == 0 ? left : right;
    const Result<std::size_t> site = site_index(*kernels, name);
    if (!site) return std::unexpected(site.error());
    stance.feet_[i].site = *site;
    stance.feet_[i].middle_m = middle_of(robot, name);
  }
  if (const Status legs = stance.find_legs(robot); !legs) return std::unexpected(legs.error());
  return stance;
}

Status Stance::find_legs(const hal::RobotConfig& robot) {
  // At a configuration without symmetry, a joint moves a sole exactly when it lies on its way.
  for (std::size_t i = 0; i < kernels_->joints; ++i) {
    q_[7 + i] = 0.1 + 0.01 * static_cast<double>(i);
  }
  q_[6] = 1.0;
  evaluate();
  columns_[0] = 0;
  columns_[1] = 1;
  for (std::size_t foot = 0; foot < 2; ++foot) {
    std::size_t found = 0;
    for (std::size_t j = 0; j < robot.joints.size(); ++j) {
      const std::size_t column = map_.v_index(j);
      double moves = 0.0;
      for (int k = 0; k < 6; ++k) {
        moves = std::max(moves, std::abs(jacobian(static_cast<int>(6 * foot) + k, column)));
      }
      if (moves < 1e-9) continue;
      if (found < 6) columns_[2 + 6 * foot + found] = column;
      ++found;
    }
    if (found != 6) {
      return fail("the site '" + std::string(kernels_->site_names[feet_[foot].site]) +
                      "' is moved by " + std::to_string(found) + " joints",
                  "standing needs exactly six from the base to each sole");
    }
  }
  return {};
}

double Stance::place(std::span<const double> position_rad) noexcept TANDEM_RT {
  std::ranges::fill(q_, 0.0);
  std::ranges::fill(v_, 0.0);
  q_[6] = 1.0;
  map_.positions_to_q(position_rad, q_);
  evaluate();
  const Matrix3d R[2] = {rotation(pose_, feet_[0].site), rotation(pose_, feet_[1].site)};
  const Vector3d p[2] = {origin(pose_, feet_[0].site), origin(pose_, feet_[1].site)};
  const Vector3d between = 0.5 * (p[0] + p[1]);
  // G's axes in the base: z along both soles' normals, x along their mean direction.
  const Vector3d z = (R[0].col(2) + R[1].col(2)).normalized();
  const Vector3d ahead = R[0].col(0) + R[1].col(0);
  const Vector3d x = (ahead - ahead.dot(z) * z).normalized();
  Matrix3d base_G;
  base_G << x, z.cross(x), z;
  Vector3d middle = Vector3d::Zero();
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector3d at = base_G.transpose() * (p[i] - between);
    const Vector3d toes = base_G.transpose() * R[i].col(0);
    feet_[i].position_m = {at.x(), at.y(), 0.0};
    feet_[i].yaw_rad = std::atan2(toes.y(), toes.x());
    const Vector3d offset(feet_[i].middle_m[0], feet_[i].middle_m[1], 0.0);
    middle += 0.5 * (Vector3d(at.x(), at.y(), 0.0) +
                     Eigen::AngleAxisd(feet_[i].yaw_rad, Vector3d::UnitZ()) * offset);
  }
  com_m_ = {middle.x(), middle.y()};
  const Vector3d base = -(base_G.transpose() * between);
  q_[0] = base.x();
  q_[1] = base.y();
  q_[2] = base.z();
  return base.z();
}

void Stance::evaluate() noexcept TANDEM_RT {
  kernels_->site_motion(q_.data(), zero_.data(), zero_.data(), pose_.data(), twist_.data(),
                        acceleration_.data());
  kernels_->site_jacobians(q_.data(), site_J_.data());
  kernels_->center_of_mass(q_.data(), zero_.data(), com_.data(), com_velocity_.data(),
                           com_J_.data());
}

Stance::Vector Stance::error() const noexcept TANDEM_RT {
  Vector e;
  for (int i = 0; i < 2; ++i) {
    const Foot& foot = feet_[static_cast<std::size_t>(i)];
    const Matrix3d R = rotation(pose_, foot.site);
    const Matrix3d wanted = Eigen::AngleAxisd(foot.yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
    const Matrix3d turn = wanted * R.transpose();
    e.segment<3>(6 * i) =
        Eigen::Map<const Vector3d>(foot.position_m.data()) - origin(pose_, foot.site);
    e.segment<3>(6 * i + 3) =
        0.5 * Vector3d(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
  }
  e[12] = com_m_[0] - com_[0];
  e[13] = com_m_[1] - com_[1];
  return e;
}

double Stance::jacobian(int row, std::size_t v_column) const noexcept TANDEM_RT {
  const std::size_t nv = kernels_->nv;
  if (row >= 12) return com_J_[static_cast<std::size_t>(row - 12) * nv + v_column];
  const std::size_t site = feet_[static_cast<std::size_t>(row / 6)].site;
  return site_J_[(6 * site + static_cast<std::size_t>(row % 6)) * nv + v_column];
}

Stance::Solution Stance::solve(double height_m, int max_steps) noexcept TANDEM_RT {
  q_[2] = height_m;
  Solution solution;
  while (solution.steps < max_steps && !solution.converged) {
    evaluate();
    Matrix A;
    for (int row = 0; row < kUnknowns; ++row) {
      for (int column = 0; column < kUnknowns; ++column) {
        A(row, column) = jacobian(row, columns_[static_cast<std::size_t>(column)]);
      }
    }
    lu_.compute(A);
    const Vector e = error();
    Vector step = lu_.solve(e);
    const double length = step.cwiseAbs().maxCoeff();
    ++solution.steps;
    solution.residual = e.cwiseAbs().maxCoeff();
    if (!std::isfinite(length)) return solution;
    if (length > kLongestStep) step *= kLongestStep / length;
    // The base is level, so that its own axes are G's and x and y are the first two of v.
    q_[0] += step[0];
    q_[1] += step[1];
    for (int i = 2; i < kUnknowns; ++i) q_[columns_[static_cast<std::size_t>(i)] + 1] += step[i];
    solution.converged = length < kConverged;
  }
  return solution;
}

void Stance::predict(double dt_s) noexcept TANDEM_RT {
  q_[0] += v_[0] * dt_s;
  q_[1] += v_[1] * dt_s;
  for (int i = 2; i < kUnknowns; ++i) {
    const std::size_t column = columns_[static_cast<std::size_t>(i)];
    q_[column + 1] += v_[column] * dt_s;
  }
}

void Stance::move(double rate_m_s) noexcept TANDEM_RT {
  Vector drift;
  for (int row = 0; row < kUnknowns; ++row) drift[row] = -jacobian(row, 2) * rate_m_s;
  const Vector rate = lu_.solve(drift);
  v_[2] = rate_m_s;
  for (int i = 0; i < kUnknowns; ++i) v_[columns_[static_cast<std::size_t>(i)]] = rate[i];
}

void Stance::carry(std::span<const double> vdot) noexcept TANDEM_RT {
  kernels_->inverse_dynamics(q_.data(), v_.data(), vdot.data(), wrench_.data(), tau_.data());
  carry_on_both_feet(*kernels_, {feet_[0].site, feet_[1].site}, q_, pose_, site_J_, tau_);
}

bool Stance::in_leg(std::size_t j) const noexcept {
  return std::find(columns_.begin() + 2, columns_.end(), map_.v_index(j)) != columns_.end();
}

double Stance::residual() noexcept TANDEM_RT {
  evaluate();
  return error().cwiseAbs().maxCoeff();
}

void Stance::archive(Archive& ar) { ar(feet_, com_m_, q_, v_); }

}  // namespace tandem
