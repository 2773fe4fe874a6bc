// Pose, twist, acceleration and Jacobian of the named sites, over any scalar.
// Layer: model.  Thread: any.
#pragma once

#include "model/kinematics.hpp"

namespace tandem::model {

/// A body's placement in the world.
template <class S>
struct BodyPose {
  Mat3<S> R;
  Vec3<S> p;
};

/// Every body's placement in the world.
template <class S>
[[nodiscard]] std::vector<BodyPose<S>> body_poses(const Mechanism& m, std::span<const S> q) {
  const BasePose<S> base = base_pose(m, q);
  std::vector<BodyPose<S>> poses{{base.R, base.p}};
  for (int j = 0; j < m.joint_count(); ++j) {
    const BodyPose<S>& parent = poses[m.joints[j].parent];
    const JointTransform<S> t = joint_transform(m.joints[j], q[m.q_index(j)]);
    BodyPose<S> body;
    for (int row = 0; row < 3; ++row) body.R[row] = to_child(t, parent.R[row]);
    body.p = parent.p + multiply(parent.R, m.joints[j].in_parent.p);
    if (m.joints[j].prismatic)
      for (int i = 0; i < 3; ++i) body.p[i] += body.R[i][2] * t.slide;
    poses.push_back(body);
  }
  return poses;
}

/// Poses (12 per site: R row-major, p), twists and classical accelerations (6 per site, of the
/// site's origin in world axes, linear first, without gravity).
template <class S>
void site_motion(const Mechanism& m, std::span<const S> q, std::span<const S> v,
                 std::span<const S> vdot, std::span<S> pose, std::span<S> twist,
                 std::span<S> acceleration) {
  const std::vector<BodyPose<S>> poses = body_poses(m, q);
  std::vector<BodyMotion<S>> motions{base_motion(m, q, v, vdot, false)};
  std::vector<Vec3<S>> velocities(1, Vec3<S>{S(0.0), S(0.0), S(0.0)});
  if (m.floating_base) velocities[0] = {v[0], v[1], v[2]};
  for (int j = 0; j < m.joint_count(); ++j) {
    const int parent = m.joints[j].parent;
    const int i = m.v_index(j);
    const JointTransform<S> t = joint_transform(m.joints[j], q[m.q_index(j)]);
    Vec3<S> angular;
    Vec3<S> linear;
    carry_down(t, motions[parent].w, velocities[parent], angular, linear);
    if (m.joints[j].prismatic) linear[2] += v[i];
    velocities.push_back(linear);
    motions.push_back(next_motion(t, motions[parent], v[i], vdot[i]));
  }
  for (std::size_t s = 0; s < m.sites.size(); ++s) {
    const int body = m.sites[s].body;
    const auto& [R_site, p_site] = m.sites[s].in_body;
    const BodyMotion<S>& motion = motions[body];
    const Mat3<S>& R = poses[body].R;
    const Vec3<S> offset = multiply(R, p_site);
    const Vec3<S> linear = multiply(R, velocities[body] - cross(p_site, motion.w));
    const Vec3<S> angular = multiply(R, motion.w);
    const Vec3<S> linear_acc = multiply(R, motion.a + multiply(motion.U, p_site));
    const Vec3<S> angular_acc = multiply(R, motion.al);
    for (int i = 0; i < 3; ++i) {
      const Vec3<S> row = rotate_back(R_site, R[i]);
      for (int k = 0; k < 3; ++k) pose[12 * s + 3 * i + k] = row[k];
      pose[12 * s + 9 + i] = poses[body].p[i] + offset[i];
      twist[6 * s + i] = linear[i];
      twist[6 * s + 3 + i] = angular[i];
      acceleration[6 * s + i] = linear_acc[i];
      acceleration[6 * s + 3 + i] = angular_acc[i];
    }
  }
}

/// Poses and twists as site_motion() has them.
template <class S>
void site_twists(const Mechanism& m, std::span<const S> q, std::span<const S> v, std::span<S> pose,
                 std::span<S> twist) {
  const std::vector<S> vdot(v.size(), S(0.0));
  std::vector<S> acceleration(twist.size(), S(0.0));
  site_motion<S>(m, q, v, vdot, pose, twist, acceleration);
}

/// J (6 x nv, row-major) per site: its twist is J v.
template <class S>
void site_jacobians(const Mechanism& m, std::span<const S> q, std::span<S> J) {
  const std::vector<BodyPose<S>> poses = body_poses(m, q);
  const int nv = m.nv();
  for (S& entry : J) entry = S(0.0);
  for (std::size_t s = 0; s < m.sites.size(); ++s) {
    const MechanismSite& site = m.sites[s];
    const auto block = J.subspan(static_cast<std::size_t>(6 * nv) * s);
    const auto set = [&](int column, const Vec3<S>& linear, const Vec3<S>& angular) {
      for (int i = 0; i < 3; ++i) {
        block[i * nv + column] = linear[i];
        block[(i + 3) * nv + column] = angular[i];
      }
    };
    const Vec3<S> p = poses[site.body].p + multiply(poses[site.body].R, site.in_body.p);
    for (int body = site.body; body > 0; body = m.joints[body - 1].parent) {
      const Mat3<S>& R = poses[body].R;
      const Vec3<S> z{R[0][2], R[1][2], R[2][2]};
      const Vec3<S> none{S(0.0), S(0.0), S(0.0)};
      if (m.joints[body - 1].prismatic) {
        set(m.v_index(body - 1), z, none);
      } else {
        set(m.v_index(body - 1), cross(z, p - poses[body].p), z);
      }
    }
    if (!m.floating_base) continue;
    for (int k = 0; k < 3; ++k) {
      const Mat3<S>& R = poses[0].R;
      const Vec3<S> axis{R[0][k], R[1][k], R[2][k]};
      set(k, axis, {S(0.0), S(0.0), S(0.0)});
      set(k + 3, cross(axis, p - poses[0].p), axis);
    }
  }
}

}  // namespace tandem::model
