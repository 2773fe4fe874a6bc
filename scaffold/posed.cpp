// Placements, Jacobians, inertias and gravity torques of a tree at q, by sums over its bodies.
#include "scaffold/posed.hpp"

#include <algorithm>
#include <limits>

#include "model/placements.hpp"

namespace tandem::scaffold {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using model::Placement;

Posed::Posed(const model::Tree& tree, const Eigen::VectorXd& q) : tree_(tree) {
  bodies_ = model::place_bodies(tree, {q.data(), static_cast<std::size_t>(q.size())});
  for (std::size_t j = 0; j < tree.joints.size(); ++j)
    if (tree.joints[j].follows()) followers_.push_back(static_cast<int>(j));
  for (std::size_t b = 0; b < tree.bodies.size(); ++b) {
    beyond_.push_back(bodies_[b] * tree.bodies[b].inertia);
  }
  for (std::size_t j = tree.joints.size(); j-- > 0;) {
    model::Inertia& parent = beyond_[tree.joints[j].parent];
    parent = parent + beyond_[j + 1];
  }
}

Placement Posed::link(int index) const {
  const model::Link& link = tree_.links[index];
  return bodies_[link.body] * link.in_body;
}

Vector3d Posed::axis(int joint) const { return bodies_[joint + 1].R * tree_.joints[joint].axis; }

bool Posed::slides(int joint) const {
  return tree_.joints[joint].type == model::JointType::kPrismatic;
}

std::vector<int> Posed::followers_of(int joint) const {
  std::vector<int> found;
  for (const int f : followers_) {
    if (tree_.joints[f].leader == joint) found.push_back(f);
  }
  return found;
}

double Posed::inertia(int joint) const {
  if (!followers_of(joint).empty()) return inertia_with_followers(joint);
  const model::Inertia& load = beyond(joint);
  if (slides(joint)) return load.mass_kg;
  const Vector3d n = axis(joint);
  const double lever = n.cross(load.com_m - origin(joint)).norm();
  return n.dot(load.about_com_kg_m2 * n) + load.mass_kg * lever * lever;
}

/// Twice the kinetic energy at unit velocity, body by body.
double Posed::inertia_with_followers(int joint) const {
  double sum = 0.0;
  for (int b = 1; b < static_cast<int>(bodies_.size()); ++b) {
    const model::Inertia own = bodies_[b] * tree_.bodies[b].inertia;
    const Vector3d v = point_jacobian(b, own.com_m).col(joint);
    const Vector3d w = turn_jacobian(b).col(joint);
    sum += own.mass_kg * v.squaredNorm() + w.dot(own.about_com_kg_m2 * w);
  }
  return sum;
}

double Posed::gravity_load(int joint) const {
  double load = own_gravity_load(joint);
  for (const int f : followers_of(joint)) {
    load += tree_.joints[f].multiplier * own_gravity_load(f);
  }
  return load;
}

double Posed::own_gravity_load(int joint) const {
  const model::Inertia& load = beyond(joint);
  const Vector3d weight(0.0, 0.0, -load.mass_kg * kGravity_m_s2);
  if (slides(joint)) return -axis(joint).dot(weight);
  return -axis(joint).dot((load.com_m - origin(joint)).cross(weight));
}

Eigen::VectorXd Posed::inertial_load(const Eigen::VectorXd& qdd) const {
  Eigen::VectorXd load = Eigen::VectorXd::Zero(qdd.size());
  for (int b = 1; b < static_cast<int>(bodies_.size()); ++b) {
    const model::Inertia own = bodies_[b] * tree_.bodies[b].inertia;
    const MatrixXd v = point_jacobian(b, own.com_m);
    const MatrixXd w = turn_jacobian(b);
    load += own.mass_kg * (v.transpose() * (v * qdd)) +
            w.transpose() * (own.about_com_kg_m2 * (w * qdd));
  }
  return load;
}

double Posed::lowest_m() const {
  double lowest = std::numeric_limits<double>::infinity();
  for (std::size_t b = 1; b < bodies_.size(); ++b) {
    lowest = std::min(lowest, (bodies_[b] * tree_.bodies[b].inertia).com_m.z());
  }
  for (const model::Link& link : tree_.links) {
    if (link.body > 0) lowest = std::min(lowest, (bodies_[link.body] * link.in_body).p.z());
  }
  return lowest;
}

/// A follower's column is its leader's.
MatrixXd Posed::of_coordinates(MatrixXd J) const {
  for (const int f : followers_) {
    J.col(tree_.joints[f].leader) += tree_.joints[f].multiplier * J.col(f);
    J.col(f).setZero();
  }
  return J;
}

MatrixXd Posed::point_jacobian(int body, const Vector3d& point) const {
  MatrixXd J = MatrixXd::Zero(3, Index(tree_.joints.size()));
  for (; body > 0; body = tree_.joints[body - 1].parent) {
    const Vector3d n = axis(body - 1);
    J.col(body - 1) = slides(body - 1) ? n : n.cross(point - origin(body - 1));
  }
  return of_coordinates(std::move(J));
}

MatrixXd Posed::turn_jacobian(int body) const {
  MatrixXd J = MatrixXd::Zero(3, Index(tree_.joints.size()));
  for (; body > 0; body = tree_.joints[body - 1].parent) {
    if (!slides(body - 1)) J.col(body - 1) = axis(body - 1);
  }
  return of_coordinates(std::move(J));
}

MatrixXd Posed::com_jacobian() const {
  const int joints = static_cast<int>(tree_.joints.size());
  MatrixXd J(3, joints);
  for (int j = 0; j < joints; ++j) {
    const model::Inertia& load = beyond(j);
    const Vector3d n = axis(j);
    const Vector3d moved = slides(j) ? n : Vector3d(n.cross(load.com_m - origin(j)));
    J.col(j) = moved * (load.mass_kg / whole().mass_kg);
  }
  return of_coordinates(std::move(J));
}

}  // namespace tandem::scaffold
