// Newton steps for each leg by itself; the feet share the wrench with the least effort.
#include "identification/standing.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "model/placements.hpp"

namespace tandem::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
std::vector<Vector2d> hull_of(std::vector<Vector2d> points) {
  std::ranges::sort(points, [](const Vector2d& a, const Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Vector2d> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = hull.size();
    for (const Vector2d& point : points) {
      while (hull.size() >= begin + 2 && turn(hull[hull.size() - 2], hull.back(), point) <= 0.0)
        hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();
    std::ranges::reverse(points);
  }
  return hull;
}

Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turned(R);
  return turned.angle() * turned.axis();
}

/// From force and moment of each foot, about its sole, to those of all, about the ground below the
/// origin: (6, 6 feet). Moments count as forces at a tenth of a metre.
MatrixXd grasp_of(std::span<const Vector3d> soles_m, double ground_m) {
  MatrixXd grasp(6, 6 * static_cast<Index>(soles_m.size()));
  Index column = 0;
  for (const Vector3d& sole : soles_m) {
    const Vector3d r = sole - Vector3d(0, 0, ground_m);
    Eigen::Matrix3d skew;
    skew << 0.0, -r.z(), r.y(), r.z(), 0.0, -r.x(), -r.y(), r.x(), 0.0;
    grasp.block<3, 3>(0, column).setIdentity();
    grasp.block<3, 3>(3, column) = skew;
    grasp.block<3, 3>(0, column + 3).setZero();
    grasp.block<3, 3>(3, column + 3) = 0.1 * Eigen::Matrix3d::Identity();
    column += 6;
  }
  return grasp;
}

}  // namespace

model::Placement StandingMotion::placement(const BasePose& pose) {
  model::Placement base;
  base.p = pose.head<3>();
  const Vector3d r = pose.tail<3>();
  if (r.norm() > 0.0) base.R = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
  return base;
}

StandingMotion::StandingMotion(const model::Tree& tree, const hal::RobotConfig& robot,
                               const Regressor& regressor, const VectorXd& start)
    : tree_(&tree) {
  for (const model::Joint& joint : tree.joints) {
    const std::string& name =
        joint.follows() ? tree.joints[static_cast<std::size_t>(joint.leader)].name : joint.name;
    coordinate_.push_back(std::ranges::find(regressor.coordinates(), name) -
                          regressor.coordinates().begin());
  }
  const std::vector<model::Placement> bodies = model::place_bodies(tree, spread(start));
  std::vector<Vector2d> points;
  double ground = std::numeric_limits<double>::infinity();
  for (const hal::Foot& foot : robot.contact.feet) {
    const auto site = std::ranges::find(robot.model.sites, foot.site, &hal::SiteConfig::name);
    if (site == robot.model.sites.end()) continue;
    const model::Link& link = tree.links[static_cast<std::size_t>(tree.link_index(site->link))];
    Leg leg;
    leg.body = link.body;
    leg.in_body = link.in_body * model::placement_of(site->xyz_m, site->rpy_rad);
    leg.foot = bodies[static_cast<std::size_t>(link.body)] * leg.in_body;
    for (int b = leg.body; b > 0; b = tree.joints[static_cast<std::size_t>(b - 1)].parent)
      leg.joints.insert(leg.joints.begin(), b - 1);
    for (const int j : leg.joints) {
      const Index c = coordinate_[static_cast<std::size_t>(j)];
      if (std::ranges::find(legs_, c) == legs_.end()) legs_.push_back(c);
    }
    for (const auto& p : foot.points_m) {
      const Vector3d at = leg.foot.R * Vector3d(p.data()) + leg.foot.p;
      leg.points_m.emplace_back(p.data());
      points.emplace_back(at.x(), at.y());
      ground = std::min(ground, at.z());
    }
    standing_.push_back(std::move(leg));
  }
  ground_m_ = ground;
  hull_ = hull_of(std::move(points));
}

std::vector<double> StandingMotion::spread(const VectorXd& q) const {
  std::vector<double> position;
  for (const Index c : coordinate_) position.push_back(q[c]);
  return position;
}

bool StandingMotion::solve_leg(const Leg& leg, const model::Placement& base, VectorXd& q) const {
  const auto n = static_cast<Index>(leg.joints.size());
  const Index rows = n >= 6 ? 6 : 3;  // a leg of few joints keeps its foot's place only
  for (int step = 0; step < 30; ++step) {
    const std::vector<model::Placement> at = model::place_bodies(*tree_, spread(q), base);
    const model::Placement foot = at[static_cast<std::size_t>(leg.body)] * leg.in_body;
    VectorXd error(6);
    error << leg.foot.p - foot.p, rotation_vector(leg.foot.R * foot.R.transpose());
    if (error.head(rows).norm() < 1e-10) return true;
    MatrixXd J(6, n);
    for (Index i = 0; i < n; ++i) {
      const auto j = static_cast<std::size_t>(leg.joints[static_cast<std::size_t>(i)]);
      const model::Placement& body = at[j + 1];
      const Vector3d axis = body.R * tree_->joints[j].axis;
      if (tree_->joints[j].type == model::JointType::kPrismatic) {
        J.col(i) << axis, Vector3d::Zero();
      } else {
        J.col(i) << axis.cross(foot.p - body.p), axis;
      }
    }
    const MatrixXd few = J.topRows(rows);
    const MatrixXd damped = few * few.transpose() + 1e-10 * MatrixXd::Identity(rows, rows);
    VectorXd change = few.transpose() * damped.ldlt().solve(error.head(rows));
    if (!change.allFinite()) return false;
    const double largest = change.cwiseAbs().maxCoeff();
    if (largest > 0.2) change *= 0.2 / largest;
    for (Index i = 0; i < n; ++i)
      q[coordinate_[static_cast<std::size_t>(leg.joints[static_cast<std::size_t>(i)])]] +=
          change[i];
  }
  return false;
}

bool StandingMotion::solve_legs(const BasePose& pose, VectorXd& q) const {
  const model::Placement base = placement(pose);
  return std::ranges::all_of(standing_, [&](const Leg& leg) { return solve_leg(leg, base, q); });
}

double StandingMotion::lowest(const VectorXd& q) const {
  const std::vector<model::Placement> at = model::place_bodies(*tree_, spread(q));
  double lowest = std::numeric_limits<double>::infinity();
  for (const Leg& leg : standing_) {
    const model::Placement foot = at[static_cast<std::size_t>(leg.body)] * leg.in_body;
    for (const Vector3d& point : leg.points_m)
      lowest = std::min(lowest, (foot.R * point + foot.p).z());
  }
  return lowest - ground_m_;
}

StandingMotion::Load StandingMotion::load(const BasePose& pose, const VectorXd& q,
                                          const Eigen::Matrix<double, 6, 1>& wrench) const {
  const model::Placement base = placement(pose);
  const std::vector<model::Placement> at = model::place_bodies(*tree_, spread(q), base);
  const Vector3d f = base.R * wrench.head<3>();
  const Vector3d n = base.R * wrench.tail<3>() + (base.p - Vector3d(0, 0, ground_m_)).cross(f);
  Load out;
  const Vector2d point(-n.y() / f.z(), n.x() / f.z());
  out.slip = f.head<2>().norm() / f.z();
  out.margin_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull_.size(); ++i) {
    const Vector2d& a = hull_[i];
    const Vector2d& b = hull_[(i + 1) % hull_.size()];
    out.margin_m = std::min(out.margin_m, turn(a, b, point) / (b - a).norm());
  }
  if (!(f.z() > 0.0)) out.margin_m = -std::numeric_limits<double>::infinity();
  std::vector<Vector3d> soles;
  for (const Leg& leg : standing_)
    soles.push_back((at[static_cast<std::size_t>(leg.body)] * leg.in_body).p);
  VectorXd total(6);
  total << f, n;
  const VectorXd share = grasp_of(soles, ground_m_).completeOrthogonalDecomposition().solve(total);
  const auto feet = static_cast<Index>(standing_.size());
  out.foot_torque = VectorXd::Zero(q.size());
  out.least_share = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < feet; ++i) {
    const Leg& leg = standing_[static_cast<std::size_t>(i)];
    const Vector3d& sole = soles[static_cast<std::size_t>(i)];
    const Vector3d force = share.segment<3>(6 * i);
    const Vector3d moment = 0.1 * share.segment<3>(6 * i + 3);
    out.least_share =
        std::min(out.least_share, force.z() * static_cast<double>(feet) / std::max(f.z(), 1e-9));
    for (const int j : leg.joints) {
      const model::Joint& joint = tree_->joints[static_cast<std::size_t>(j)];
      const model::Placement& body = at[static_cast<std::size_t>(j) + 1];
      const Vector3d axis = body.R * joint.axis;
      const double torque = joint.type == model::JointType::kPrismatic
                                ? axis.dot(force)
                                : axis.dot(moment + (sole - body.p).cross(force));
      out.foot_torque[coordinate_[static_cast<std::size_t>(j)]] -= joint.multiplier * torque;
    }
  }
  return out;
}

}  // namespace tandem::identification
