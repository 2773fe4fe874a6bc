// Forward dynamics by the articulated-body algorithm (ABA; Featherstone 2008, chapter 7), over
// any scalar. Accelerations are counted from those that the bodies would have with vdot = 0, so
// that velocities and gravity enter through the bodies' bias forces alone. Layer: model.  Thread:
// any.
#pragma once

#include "model/kinematics.hpp"

namespace tandem::model {

/// Solves A x = b for a symmetric positive definite 6x6 A by L D L^T; A is overwritten.
template <class S>
[[nodiscard]] std::array<S, 6> solve_symmetric(std::array<std::array<S, 6>, 6>& A,
                                               std::array<S, 6> b) {
  std::array<S, 6> reciprocal;
  for (int k = 0; k < 6; ++k) {
    reciprocal[k] = S(1.0) / A[k][k];
    for (int i = k + 1; i < 6; ++i) {
      const S l = A[i][k] * reciprocal[k];
      for (int j = k + 1; j <= i; ++j) A[i][j] -= l * A[j][k];
      b[i] -= l * b[k];
      A[k][i] = l;  // L^T in the upper triangle
    }
  }
  for (int k = 5; k >= 0; --k) {
    b[k] *= reciprocal[k];
    for (int i = k + 1; i < 6; ++i) b[k] -= A[k][i] * b[i];
  }
  return b;
}

template <class S>
class Aba {
 public:
  Aba(const Mechanism& m, std::span<const S> q, std::span<const S> v, std::span<const S> tau,
      std::span<const S> wrench, std::span<S> vdot)
      : m_(m),
        q_(q),
        v_(v),
        tau_(tau),
        wrench_(wrench),
        vdot_(vdot),
        bodies_(m.moments.size()),
        joints_(m.joints.size()) {}

  void run() {
    inward(0, base_motion(m_, q_, v_, {}, true));
    Vec3<S> angular{S(0.0), S(0.0), S(0.0)};
    Vec3<S> linear = angular;
    if (m_.floating_base) {
      const std::array<S, 6> a = base_acceleration();
      for (int i = 0; i < 6; ++i) vdot_[i] = a[i];
      linear = {a[0], a[1], a[2]};
      angular = {a[3], a[4], a[5]};
    }
    outward(0, angular, linear);
  }

 private:
  struct BodyState {
    ArticulatedInertia<S> inertia;
    Force<S> bias;
  };
  struct JointState {
    JointTransform<S> transform;
    Vec3<S> Uf, Un;  // the articulated inertia's column of the joint over D: force, moment
    S u_over_D = 0.0;
  };

  // Towards the base: a subtree's articulated inertia and bias force.
  void inward(int body, const BodyMotion<S>& motion) {
    BodyState& state = bodies_[body];
    state.inertia = rigid_inertia<S>(m_.moments[body]);
    state.bias = inertial_force(m_.moments[body], motion) - external_force(m_, body, wrench_);
    for (const int j : m_.children[body]) {
      JointState& joint = joints_[j];
      joint.transform = joint_transform(m_.joints[j], q_[m_.q_index(j)]);
      inward(j + 1, next_motion(joint.transform, motion, v_[m_.v_index(j)], S(0.0)));
      pass_on(j, state);
    }
  }

  // Takes the joint's freedom out of its body's inertia and adds the rest to the parent's.
  void pass_on(int j, BodyState& parent) {
    JointState& joint = joints_[j];
    ArticulatedInertia<S>& x = bodies_[j + 1].inertia;
    Force<S>& bias = bodies_[j + 1].bias;
    const bool slides = m_.joints[j].prismatic;
    Vec3<S> f;  // the inertia's column of the joint
    Vec3<S> n;
    for (int i = 0; i < 3; ++i) {
      f[i] = slides ? x.M(i, 2) : x.H[i][2];
      n[i] = slides ? x.H[2][i] : x.I(i, 2);
    }
    const double armature = m_.joints[j].armature;
    const S reciprocal = S(1.0) / ((slides ? f[2] : n[2]) + armature);
    for (int i = 0; i < 3; ++i) {
      joint.Uf[i] = f[i] * reciprocal;
      joint.Un[i] = n[i] * reciprocal;
    }
    if (armature == 0.0) (slides ? joint.Uf : joint.Un)[2] = S(1.0);
    const S u = tau_[m_.v_index(j)] - (slides ? bias.f[2] : bias.n[2]);
    joint.u_over_D = u * reciprocal;
    project(x, joint, f, n, slides, armature);
    for (int i = 0; i < 3; ++i) {
      bias.f[i] += joint.Uf[i] * u;
      bias.n[i] += joint.Un[i] * u;
    }
    if (armature == 0.0) (slides ? bias.f : bias.n)[2] = tau_[m_.v_index(j)];
    add_to(parent.inertia, to_parent(joint.transform, x));
    parent.bias = parent.bias + to_parent(joint.transform, bias);
  }

  // x - U U^T / D; without armature nothing is left in the joint's own row and column.
  static void project(ArticulatedInertia<S>& x, const JointState& joint, const Vec3<S>& f,
                      const Vec3<S>& n, bool slides, double armature) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j <= i; ++j) {
        x.M(i, j) -= joint.Uf[i] * f[j];
        x.I(i, j) -= joint.Un[i] * n[j];
      }
      for (int j = 0; j < 3; ++j) x.H[i][j] -= joint.Uf[i] * n[j];
    }
    if (armature != 0.0) return;
    for (int i = 0; i < 3; ++i) {
      (slides ? x.M(i, 2) : x.I(i, 2)) = S(0.0);
      (slides ? x.H[2][i] : x.H[i][2]) = S(0.0);
    }
  }

  std::array<S, 6> base_acceleration() {
    const ArticulatedInertia<S>& x = bodies_[0].inertia;
    std::array<std::array<S, 6>, 6> A;
    std::array<S, 6> b;
    for (int i = 0; i < 3; ++i) {
      b[i] = tau_[i] - bodies_[0].bias.f[i];
      b[i + 3] = tau_[i + 3] - bodies_[0].bias.n[i];
      for (int j = 0; j < 3; ++j) {
        A[i][j] = x.M(i, j);
        A[i + 3][j + 3] = x.I(i, j);
        A[i][j + 3] = A[j + 3][i] = x.H[i][j];
      }
    }
    return solve_symmetric(A, b);
  }

  // Away from the base: every joint's acceleration from its parent body's.
  void outward(int body, const Vec3<S>& angular, const Vec3<S>& linear) {
    for (const int j : m_.children[body]) {
      const JointState& joint = joints_[j];
      Vec3<S> al;
      Vec3<S> a;
      carry_down(joint.transform, angular, linear, al, a);
      const bool slides = m_.joints[j].prismatic;
      S& own = slides ? a[2] : al[2];
      if (m_.joints[j].armature == 0.0) {  // U / D is 1 there: own becomes the sum of both
        const S carried = own;
        own = S(0.0);
        own = joint.u_over_D - dot(joint.Uf, a) - dot(joint.Un, al);
        vdot_[m_.v_index(j)] = own - carried;
      } else {
        vdot_[m_.v_index(j)] = joint.u_over_D - dot(joint.Uf, a) - dot(joint.Un, al);
        own += vdot_[m_.v_index(j)];
      }
      outward(j + 1, al, a);
    }
  }

  const Mechanism& m_;
  std::span<const S> q_, v_, tau_, wrench_;
  std::span<S> vdot_;
  std::vector<BodyState> bodies_;
  std::vector<JointState> joints_;
};

}  // namespace tandem::model
