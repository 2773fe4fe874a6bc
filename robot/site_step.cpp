#include "robot/site_step.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

#include "base/nearest.hpp"
#include "robot/posture.hpp"

namespace tandem::robot {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr double kArm_m = 0.3;       // a radian counts as much as so many metres
constexpr double kDamping = 0.01;    // [m] of the pseudo-inverse
constexpr double kMiss = 0.05;       // of the step, by which a step that is made may miss
constexpr double kMostLever = 10.0;  // a joint's way over the step's: more is near singular
constexpr int kIterations = 8;
constexpr Eigen::Index kTwist = 6;

struct Pose {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
};

/// A site of a robot whose base stands upright at the origin.
class LedSite {
 public:
  LedSite(const hal::RobotConfig& robot, const tandem_kernels& kernels, std::size_t site,
          std::span<const double> from_rad)
      : robot_(&robot), kernels_(&kernels), site_(site) {
    posture_.position_rad.assign(from_rad.begin(), from_rad.end());
    const Rows all = all_rows();
    for (std::size_t i = 0; i < kernels.joints; ++i) {
      const int joint = robot.joint_index(kernels.joint_names[i]);
      const auto column = static_cast<Eigen::Index>(kernels.nv - kernels.joints + i);
      if (joint < 0 || all.col(column).norm() < kNothing) continue;
      joints.push_back(static_cast<std::size_t>(joint));
      columns_.push_back(column);
    }
  }

  std::vector<std::size_t> joints;  ///< that lead it

  [[nodiscard]] double& position_rad(std::size_t k) { return posture_.position_rad[joints[k]]; }

  [[nodiscard]] Pose pose() const {
    const std::vector<double> q = coordinates_at(*robot_, *kernels_, &posture_);
    const std::vector<double> zero(kernels_->nv, 0.0);
    std::vector<double> poses(12 * kernels_->sites), twists(6 * kernels_->sites);
    kernels_->site_twists(q.data(), zero.data(), poses.data(), twists.data());
    const double* own = &poses[12 * site_];
    return {Eigen::Map<const Eigen::Vector3d>(own + 9), Eigen::Map<const Matrix3>(own)};
  }

  /// Six rows: of its place, and of its direction times kArm_m.
  [[nodiscard]] Rows jacobian() const {
    const Rows all = all_rows();
    Rows J(kTwist, static_cast<Eigen::Index>(columns_.size()));
    for (std::size_t k = 0; k < columns_.size(); ++k)
      J.col(static_cast<Eigen::Index>(k)) = all.col(columns_[k]);
    J.bottomRows(3) *= kArm_m;
    return J;
  }

 private:
  static constexpr double kNothing = 1e-9;

  [[nodiscard]] Rows all_rows() const {
    const std::vector<double> q = coordinates_at(*robot_, *kernels_, &posture_);
    std::vector<double> J(6 * kernels_->nv * kernels_->sites);
    kernels_->site_jacobians(q.data(), J.data());
    using Stored = Eigen::Matrix<double, kTwist, Eigen::Dynamic, Eigen::RowMajor>;
    const auto columns = static_cast<Eigen::Index>(kernels_->nv);
    return Eigen::Map<const Stored>(&J[6 * kernels_->nv * site_], kTwist, columns);
  }

  const hal::RobotConfig* robot_;
  const tandem_kernels* kernels_;
  std::size_t site_;
  hal::PostureConfig posture_;
  std::vector<Eigen::Index> columns_;
};

Pose stepped(const Pose& from, const SiteStep& step) {
  const Eigen::Vector3d unit = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(step.axis % 3));
  const Eigen::Vector3d along = step.own ? Eigen::Vector3d(from.R * unit) : unit;
  if (step.axis < 3) return {from.p_m + step.by * along, from.R};
  return {from.p_m, Eigen::AngleAxisd(step.by, along) * from.R};
}

/// What leads from one to the other, as jacobian() has it.
Eigen::VectorXd between(const Pose& from, const Pose& to) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(to.R * from.R.transpose()));
  Eigen::VectorXd way(kTwist);
  way << to.p_m - from.p_m, kArm_m * turn.angle() * turn.axis();
  return way;
}

Status check_limits(const hal::RobotConfig& robot, LedSite& site, const std::string& name) {
  for (std::size_t k = 0; k < site.joints.size(); ++k) {
    const hal::JointConfig& joint = robot.joints[site.joints[k]];
    const double to = site.position_rad(k);
    if (to >= joint.min_position_rad && to <= joint.max_position_rad) continue;
    char text[160];
    std::snprintf(text, sizeof text, "the step leads %.60s to %.3f %s, beyond its limit %.3f",
                  joint.name.c_str(), to, joint.slides ? "m" : "rad",
                  to < joint.min_position_rad ? joint.min_position_rad : joint.max_position_rad);
    return fail_at(name, text, "lead the site another way, or this joint back by joint move");
  }
  return {};
}

}  // namespace

Result<SteppedJoints> site_step(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                                const SiteStep& step, std::span<const double> from_rad) {
  if (kernels == nullptr) {
    return fail_at(step.site, "there is no model of the robot here", "lead its joints one by one");
  }
  if (!robot.loops.empty()) {
    return fail_at(step.site, "a site of a robot with closed loops cannot be led",
                   "lead its joints one by one");
  }
  std::vector<std::string> names(kernels->site_names, kernels->site_names + kernels->sites);
  const auto found = std::ranges::find(names, step.site);
  if (found == names.end()) {
    return fail_at(step.site, "the robot has no site of that name",
                   names.empty() ? "give it a [[site]] in robot.toml" : suggest(step.site, names));
  }
  LedSite site(robot, *kernels, static_cast<std::size_t>(found - names.begin()), from_rad);
  const Pose to = stepped(site.pose(), step);
  const bool whole = site.joints.size() >= static_cast<std::size_t>(kTwist);
  const Eigen::Index first = whole || step.axis < 3 ? 0 : 3, rows = whole ? kTwist : 3;
  const auto left = [&] { return Eigen::VectorXd(between(site.pose(), to).segment(first, rows)); };
  const double far = std::abs(step.by) * (step.axis < 3 ? 1.0 : kArm_m);
  for (int i = 0; i < kIterations; ++i) {
    const Rows J = site.jacobian().middleRows(first, rows);
    const Rows A = J * J.transpose() + kDamping * kDamping * Rows::Identity(rows, rows);
    const Eigen::VectorXd move = J.transpose() * A.llt().solve(left());
    for (std::size_t k = 0; k < site.joints.size(); ++k)
      site.position_rad(k) += move[static_cast<Eigen::Index>(k)];
  }
  double way = 0.0;
  for (std::size_t k = 0; k < site.joints.size(); ++k)
    way = std::max(way, std::abs(site.position_rad(k) - from_rad[site.joints[k]]));
  if (!(left().norm() <= kMiss * far && kArm_m * way <= kMostLever * far)) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "its %zu joints do not lead the site this way: the posture is near a singular one",
        site.joints.size());
    return fail_at(step.site, text, "lead it another way, or single joints by joint move");
  }
  if (Status fits = check_limits(robot, site, step.site); !fits) {
    return std::unexpected(fits.error());
  }
  SteppedJoints out{.joints = site.joints, .target_rad = {}};
  for (std::size_t k = 0; k < site.joints.size(); ++k)
    out.target_rad.push_back(site.position_rad(k));
  return out;
}

}  // namespace tandem::robot
