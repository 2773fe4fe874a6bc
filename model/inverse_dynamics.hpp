// Inverse dynamics and bias by the recursive Newton-Euler algorithm (RNEA), and the wrenches
// through sensors, over any scalar.
// Layer: model.  Thread: any.
#pragma once

#include "model/kinematics.hpp"

namespace tandem::model {

/// tau = M vdot + h - sum J^T f; with an empty `vdot` of zeros.
template <class S>
class Rnea {
 public:
  Rnea(const Mechanism& m, std::span<const S> q, std::span<const S> v, std::span<const S> vdot,
       std::span<const S> wrench, std::span<S> tau)
      : m_(m), q_(q), v_(v), vdot_(vdot), wrench_(wrench), tau_(tau) {}

  void run() {
    const Force<S> base = visit(0, base_motion(m_, q_, v_, vdot_, true));
    if (!m_.floating_base) return;
    for (int i = 0; i < 3; ++i) {
      tau_[i] = base.f[i];
      tau_[i + 3] = base.n[i];
    }
  }

 private:
  // The force that the subtree needs, about the body's origin; fills tau on the way.
  Force<S> visit(int body, const BodyMotion<S>& motion) {
    Force<S> force = inertial_force(m_.moments[body], motion);
    if (!wrench_.empty()) force = force - external_force(m_, body, wrench_);
    for (const int j : m_.children[body]) {
      const int i = m_.v_index(j);
      const S vdot = vdot_.empty() ? S(0.0) : vdot_[i];
      const JointTransform<S> t = joint_transform(m_.joints[j], q_[m_.q_index(j)]);
      const Force<S> child = visit(j + 1, next_motion(t, motion, v_[i], vdot));
      tau_[i] = (m_.joints[j].prismatic ? child.f[2] : child.n[2]) + m_.joints[j].armature * vdot;
      force = force + to_parent(t, child);
    }
    return force;
  }

  const Mechanism& m_;
  std::span<const S> q_, v_, vdot_, wrench_;
  std::span<S> tau_;
};

/// The wrench through each sensor's joint. Regrouped inertias give a joint's own component of
/// the force only, so that these are summed with the masses as described.
template <class S>
class SensorWrenches {
 public:
  SensorWrenches(const Mechanism& m, std::span<const S> q, std::span<const S> v,
                 std::span<const S> vdot, std::span<const S> wrench, std::span<S> out)
      : m_(m), q_(q), v_(v), vdot_(vdot), wrench_(wrench), out_(out) {}

  void run() {
    motions_.push_back(base_motion(m_, q_, v_, vdot_, true));
    for (int j = 0; j < m_.joint_count(); ++j) {
      const int i = m_.v_index(j);
      transforms_.push_back(joint_transform(m_.joints[j], q_[m_.q_index(j)]));
      motions_.push_back(
          next_motion(transforms_[j], motions_[m_.joints[j].parent], v_[i], vdot_[i]));
    }
    for (std::size_t s = 0; s < m_.sensors.size(); ++s) write(m_.sensors[s], out_.subspan(6 * s));
  }

 private:
  void write(const MechanismSensor& sensor, std::span<S> out) const {
    Force<S> force = inertial_force(sensor.beyond, motions_[sensor.body]) -
                     external_force(m_, sensor.body, wrench_, &sensor.sites);
    for (const int j : sensor.joints) force = force + to_parent(transforms_[j], subtree(j + 1));
    if (sensor.through >= 0) force = to_parent(transforms_[sensor.through], force);
    const auto& [R, p] = sensor.in_body;
    const Vec3<S> f = rotate_back(R, force.f);
    const Vec3<S> n = rotate_back(R, force.n - cross(p, force.f));
    for (int i = 0; i < 3; ++i) {  // the child's side pushes back
      out[i] = -f[i];
      out[i + 3] = -n[i];
    }
  }

  Force<S> subtree(int body) const {
    Force<S> force =
        inertial_force(m_.true_moments[body], motions_[body]) - external_force(m_, body, wrench_);
    for (const int j : m_.children[body]) force = force + to_parent(transforms_[j], subtree(j + 1));
    return force;
  }

  const Mechanism& m_;
  std::span<const S> q_, v_, vdot_, wrench_;
  std::span<S> out_;
  std::vector<BodyMotion<S>> motions_;
  std::vector<JointTransform<S>> transforms_;
};

}  // namespace tandem::model
