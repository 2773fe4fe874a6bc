// From the base to the tips for motion, back for forces.
#include "hal/sim/tree_motion.hpp"

#include <cmath>

#include "hal/sim/apparent_inertia.hpp"

namespace tandem::sim {

Mat3 product(const Mat3& A, const Mat3& B) noexcept TANDEM_RT {
  Mat3 C{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      C[3 * r + c] = A[3 * r] * B[c] + A[3 * r + 1] * B[3 + c] + A[3 * r + 2] * B[6 + c];
  return C;
}
namespace {

/// By `angle` about the unit vector `k` (Rodrigues).
Mat3 turn(const Vec3& k, double angle) noexcept {
  const double c = std::cos(angle), s = std::sin(angle), t = 1.0 - c;
  return {t * k[0] * k[0] + c,        t * k[0] * k[1] - s * k[2], t * k[0] * k[2] + s * k[1],
          t * k[0] * k[1] + s * k[2], t * k[1] * k[1] + c,        t * k[1] * k[2] - s * k[0],
          t * k[0] * k[2] - s * k[1], t * k[1] * k[2] + s * k[0], t * k[2] * k[2] + c};
}
}  // namespace

TreeMotion::TreeMotion(const model::Tree& tree, const tandem_kernels& kernels)
    : floating_(tree.floating_base) {
  for (const model::Joint& joint : tree.joints) {
    const model::Joint& own =
        joint.follows() ? tree.joints[static_cast<std::size_t>(joint.leader)] : joint;
    joints_.push_back({.parent = static_cast<std::size_t>(joint.parent),
                       .coordinate = joint_of(kernels, own.name),
                       .multiplier = joint.multiplier,
                       .offset = joint.offset,
                       .prismatic = joint.type == model::JointType::kPrismatic,
                       .axis = vec3(joint.axis),
                       .p = vec3(joint.in_parent.p),
                       .R = mat3(joint.in_parent.R)});
  }
  bodies_.assign(joints_.size() + 1, {});
  bodies_[0].R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
}

void TreeMotion::place(const double* q, const double* v) noexcept TANDEM_RT {
  const double* at = q;
  const double* rate = v;
  if (floating_) {
    BodyMotion& base = bodies_[0];
    base.R = rotation_of(q + 3);
    base.p = {q[0], q[1], q[2]};
    base.v = rotate(base.R.data(), v);
    base.w = rotate(base.R.data(), v + 3);
    at += 7;
    rate += 6;
  }
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const JointFrame& joint = joints_[j];
    const BodyMotion& parent = bodies_[joint.parent];
    BodyMotion& body = bodies_[j + 1];
    const double position = joint.multiplier * at[joint.coordinate] + joint.offset;
    const double speed = joint.multiplier * rate[joint.coordinate];
    const Mat3 before_joint = product(parent.R, joint.R);
    body.axis = rotate(before_joint.data(), joint.axis.data());
    body.R = joint.prismatic ? before_joint : product(before_joint, turn(joint.axis, position));
    Vec3 offset = rotate(parent.R.data(), joint.p.data());
    body.w = parent.w;
    Vec3 slide{};
    for (std::size_t i = 0; i < 3; ++i) {
      if (joint.prismatic) {
        offset[i] += position * body.axis[i];
        slide[i] = speed * body.axis[i];
      } else {
        body.w[i] += speed * body.axis[i];
      }
    }
    body.p = sum(parent.p, offset);
    body.v = sum(sum(parent.v, cross(parent.w, offset)), slide);
  }
}

void TreeMotion::add_generalized(double* body_force, double* forces) const noexcept TANDEM_RT {
  const auto about = [](const double* force, const Vec3& p) -> Vec3 {
    const Vec3 moved = cross(p, {force[0], force[1], force[2]});
    return {force[3] - moved[0], force[4] - moved[1], force[5] - moved[2]};
  };
  double* joint_forces = forces + (floating_ ? 6 : 0);
  for (std::size_t j = joints_.size(); j-- > 0;) {
    const JointFrame& joint = joints_[j];
    const BodyMotion& body = bodies_[j + 1];
    const double* force = body_force + 6 * (j + 1);
    const Vec3 moment = about(force, body.p);
    joint_forces[joint.coordinate] +=
        joint.multiplier * dot(body.axis, joint.prismatic ? force : moment.data());
    for (std::size_t i = 0; i < 6; ++i) body_force[6 * joint.parent + i] += force[i];
  }
  if (!floating_) return;
  const Vec3 force = rotate_back(bodies_[0].R.data(), body_force);
  const Vec3 moment = rotate_back(bodies_[0].R.data(), about(body_force, bodies_[0].p).data());
  for (std::size_t i = 0; i < 3; ++i) {
    forces[i] += force[i];
    forces[3 + i] += moment[i];
  }
}

}  // namespace tandem::sim
