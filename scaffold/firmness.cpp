// Energy of springs, gains, ground and gravity to second order about rest; bisection finds the
// factor on all stiffnesses from which the robot is stable and no contact point lifts off.
#include "scaffold/steps.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace tandem::scaffold {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kBase = 6;
constexpr double kStep = 1e-3;  // [m or rad] of differences
constexpr double kLeast = 0.01, kMost = 100.0;
constexpr int kHalvings = 40;

/// Gravity and ground about a robot at rest: x is how the base moves (x, y, z, and a rotation
/// vector about the centre of mass), then the joints that follow nobody.
class AtRest {
 public:
  AtRest(const NewRobot& robot, const VectorXd& q) : robot_(robot), q_(q) {
    for (std::size_t j = 0; j < robot.tree.joints.size(); ++j) {
      if (!robot.tree.joints[j].follows()) joints_.push_back(static_cast<int>(j));
    }
    const Posed posed(robot.tree, q);
    middle_ = posed.whole().com_m;
    weight_N_ = posed.whole().mass_kg * kGravity_m_s2;
    touching_ = points(posed);
  }

  [[nodiscard]] const std::vector<int>& joints() const { return joints_; }
  [[nodiscard]] Eigen::Index size() const {
    return kBase + static_cast<Eigen::Index>(joints_.size());
  }
  /// [J]
  [[nodiscard]] double energy(const VectorXd& x) const {
    const hal::ContactConfig& ground = robot_.config.contact;
    const double share_N = weight_N_ / static_cast<double>(touching_.size());
    const Posed posed = posed_at(x);
    double energy = weight_N_ * (moved(posed.whole().com_m, x).z() - middle_.z());
    const std::vector<Vector3d> now = points(posed);
    for (std::size_t i = 0; i < now.size(); ++i) {
      const Vector3d way = moved(now[i], x) - touching_[i];
      energy += 0.5 * ground.stiffness_N_m * way.z() * way.z() - share_N * way.z();
      energy += 0.5 * ground.tangential_stiffness_N_m * way.head<2>().squaredNorm();
    }
    return energy;
  }
  [[nodiscard]] VectorXd slope() const {
    VectorXd g(size());
    for (Eigen::Index i = 0; i < size(); ++i) {
      VectorXd x = VectorXd::Zero(size());
      x[i] = kStep;
      g[i] = (energy(x) - energy(-x)) / (2.0 * kStep);
    }
    return g;
  }
  /// Whether the ground presses on every point where the robot has moved to.
  [[nodiscard]] bool touches(const VectorXd& x) const {
    const double depth_m =
        weight_N_ / static_cast<double>(touching_.size()) / robot_.config.contact.stiffness_N_m;
    const std::vector<Vector3d> now = moved_points(x);
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (now[i].z() - touching_[i].z() > depth_m) return false;
    }
    return true;
  }
  [[nodiscard]] MatrixXd curvature() const {
    const Eigen::Index n = size();
    MatrixXd H(n, n);
    const auto at = [&](Eigen::Index i, double di, Eigen::Index j, double dj) {
      VectorXd x = VectorXd::Zero(n);
      x[i] += di;
      x[j] += dj;
      return energy(x);
    };
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = i; j < n; ++j) {
        H(i, j) = H(j, i) = (at(i, kStep, j, kStep) - at(i, kStep, j, -kStep) -
                             at(i, -kStep, j, kStep) + at(i, -kStep, j, -kStep)) /
                            (4.0 * kStep * kStep);
      }
    }
    return H;
  }

 private:
  [[nodiscard]] Posed posed_at(const VectorXd& x) const {
    VectorXd q = q_;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      q[joints_[i]] += x[kBase + static_cast<Eigen::Index>(i)];
    }
    return {robot_.tree, q};
  }
  /// With the base.
  [[nodiscard]] Vector3d moved(const Vector3d& p, const VectorXd& x) const {
    const Vector3d turn = x.segment<3>(3);
    const double angle = turn.norm();
    const Vector3d about = angle > 0.0 ? Vector3d(turn / angle) : Vector3d::UnitZ();
    return Eigen::AngleAxisd(angle, about) * (p - middle_) + middle_ + x.head<3>();
  }
  [[nodiscard]] std::vector<Vector3d> moved_points(const VectorXd& x) const {
    std::vector<Vector3d> all = points(posed_at(x));
    for (Vector3d& p : all) p = moved(p, x);
    return all;
  }
  [[nodiscard]] std::vector<Vector3d> points(const Posed& posed) const {
    std::vector<Vector3d> all;
    for (const FoundFoot& foot : robot_.feet) {
      const model::Placement sole = posed.link(foot.link) * foot.sole_in_link;
      for (const Vector3d& p : foot.points) all.push_back(sole.R * p + sole.p);
    }
    return all;
  }

  const NewRobot& robot_;
  VectorXd q_;
  std::vector<int> joints_;
  std::vector<Vector3d> touching_;
  Vector3d middle_ = Vector3d::Zero();
  double weight_N_ = 0.0;
};

double stiffness_of(const NewRobot& robot, int joint) {
  const int index = robot.config.joint_index(robot.tree.joints[joint].name);
  const hal::JointConfig& config = robot.config.joints[static_cast<std::size_t>(index)];
  return held_stiffness(robot.config.actuator_of(config), robot.config.gains_of(config));
}

}  // namespace

double held_stiffness(const hal::ActuatorConfig& drive, const hal::GainsConfig& gains) {
  const double loop = gains.position.gains.kp;
  const bool in_series =
      drive.order >= 2 && gains.position_feedback == hal::PositionFeedback::kMotor;
  return in_series ? 1.0 / (1.0 / loop + 1.0 / drive.spring_Nm_rad) : loop;
}

std::optional<double> needed_firmness(const NewRobot& robot, const VectorXd& q) {
  const AtRest rest(robot, q);
  const MatrixXd H = rest.curvature();
  VectorXd k = VectorXd::Zero(rest.size());
  for (std::size_t i = 0; i < rest.joints().size(); ++i) {
    k[kBase + static_cast<Eigen::Index>(i)] = stiffness_of(robot, rest.joints()[i]);
  }
  const VectorXd g = rest.slope();
  const auto stands = [&](double times) {
    const Eigen::LLT<MatrixXd> firm(H + MatrixXd((times * k).asDiagonal()));
    return firm.info() == Eigen::Success && rest.touches(-firm.solve(g));
  };
  double falls = kLeast, firm = kMost;
  if (!stands(firm)) return std::nullopt;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(falls * firm);
    (stands(middle) ? firm : falls) = middle;
  }
  return firm;
}

std::optional<Error> falls_over(const NewRobot& robot, const VectorXd& q) {
  const std::optional<double> times = needed_firmness(robot, q);
  if (!times || *times < 1.0) return std::nullopt;
  std::vector<int> legs;
  for (const FoundFoot& foot : robot.feet) {
    for (const int j : robot.tree.path_to(foot.body)) {
      if (robot.tree.joints[j].type != model::JointType::kPrismatic) legs.push_back(j);
    }
  }
  if (legs.empty()) return std::nullopt;
  const int softest =
      *std::ranges::min_element(legs, {}, [&](int joint) { return stiffness_of(robot, joint); });
  const hal::JointConfig& joint = robot.config.joints[static_cast<std::size_t>(
      robot.config.joint_index(robot.tree.joints[softest].name))];
  const double has = stiffness_of(robot, softest);
  const bool sprung = robot.config.actuator_of(joint).order >= 2;
  return Error{.message = fmt::format(
                   "it holds with {:.3g} Nm/rad, and the robot needs {:.3g} to stand: with "
                   "joints as soft as these it falls over",
                   has, has * *times),
               .hint = fmt::format(
                   "make {}[gains.{}] position in robot.toml at least {:.2g} times as "
                   "stiff, better twice that",
                   sprung ? fmt::format("[actuator.{}] spring_Nm_rad and ", joint.actuator) : "",
                   joint.gains, *times),
               .file = robot.tree.file,
               .line = robot.tree.joints[softest].line,
               .key = "joint " + joint.name};
}

}  // namespace tandem::scaffold
