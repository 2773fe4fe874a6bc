#include "scaffold/posed.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace tandem::scaffold {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using model::Placement;

namespace {

Placement motion(const model::Joint& joint, double q) {
  if (joint.type == model::JointType::kPrismatic) {
    return {Eigen::Matrix3d::Identity(), joint.axis * q};
  }
  return {Eigen::AngleAxisd(q, joint.axis).toRotationMatrix(), Vector3d::Zero()};
}

}  // namespace

Posed::Posed(const model::Tree& tree, const Eigen::VectorXd& q) : tree_(tree) {
  bodies_.resize(tree.bodies.size());
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    const model::Joint& joint = tree.joints[j];
    bodies_[j + 1] =
        bodies_[joint.parent] * joint.in_parent * motion(joint, q[static_cast<Eigen::Index>(j)]);
  }
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

double Posed::inertia(int joint) const {
  const model::Inertia& load = beyond(joint);
  if (slides(joint)) return load.mass_kg;
  const Vector3d n = axis(joint);
  const double lever = n.cross(load.com_m - origin(joint)).norm();
  return n.dot(load.about_com_kg_m2 * n) + load.mass_kg * lever * lever;
}

double Posed::gravity_load(int joint) const {
  const model::Inertia& load = beyond(joint);
  const Vector3d weight(0.0, 0.0, -load.mass_kg * kGravity_m_s2);
  if (slides(joint)) return -axis(joint).dot(weight);
  return -axis(joint).dot((load.com_m - origin(joint)).cross(weight));
}

MatrixXd Posed::point_jacobian(int body, const Vector3d& point) const {
  MatrixXd J = MatrixXd::Zero(3, static_cast<Eigen::Index>(tree_.joints.size()));
  for (; body > 0; body = tree_.joints[body - 1].parent) {
    const Vector3d n = axis(body - 1);
    J.col(body - 1) = slides(body - 1) ? n : n.cross(point - origin(body - 1));
  }
  return J;
}

MatrixXd Posed::turn_jacobian(int body) const {
  MatrixXd J = MatrixXd::Zero(3, static_cast<Eigen::Index>(tree_.joints.size()));
  for (; body > 0; body = tree_.joints[body - 1].parent) {
    if (!slides(body - 1)) J.col(body - 1) = axis(body - 1);
  }
  return J;
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
  return J;
}

std::vector<int> path_to(const model::Tree& tree, int body) {
  std::vector<int> path;
  for (; body > 0; body = tree.joints[body - 1].parent) path.push_back(body - 1);
  std::ranges::reverse(path);
  return path;
}

}  // namespace tandem::scaffold
