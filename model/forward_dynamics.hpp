// Forward dynamics by the articulated-body algorithm (ABA; Featherstone 2008, chapter 7), over
// any scalar. Accelerations are counted from those of a reference motion, so that velocities and
// gravity enter through the bodies' bias forces alone. Of all motions with these velocities it is
// the one that leaves most numbers zero: a floating base falls freely without turning faster, and
// no body accelerates along its joint's own axis. Layer: model.  Thread: any.
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
    BodyMotion<S> base = base_motion(m_, q_, v_, {}, true);
    Vec3<S> fall{S(0.0), S(0.0), S(0.0)};
    if (m_.floating_base) std::swap(fall, base.a);
    inward(0, base);
    Vec3<S> angular{S(0.0), S(0.0), S(0.0)};
    Vec3<S> linear = angular;
    if (m_.floating_base) {
      const std::array<S, 6> a = base_acceleration();
      for (int i = 0; i < 6; ++i) vdot_[i] = i < 3 ? a[i] - fall[i] : a[i];
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
    Force<S> U_over_D;  // the articulated inertia's column of the joint, at its position zero
    S u_over_D = 0.0;
    S reference = 0.0;  // vdot of the reference motion
  };

  // Towards the base: a subtree's articulated inertia and bias force.
  void inward(int body, const BodyMotion<S>& motion) {
    BodyState& state = bodies_[body];
    state.inertia = rigid_inertia<S>(m_.moments[body]);
    state.bias = inertial_force(m_.moments[body], motion) - external_force(m_, body, wrench_);
    for (const int j : m_.children[body]) {
      JointState& joint = joints_[j];
      joint.transform = joint_transform(m_.joints[j], q_[m_.q_index(j)]);
      inward(j + 1, reference_motion(j, motion));
      pass_on(j, state);
    }
  }

  // The motion of the joint's body in the reference motion, with nothing along its own axis.
  BodyMotion<S> reference_motion(int j, const BodyMotion<S>& parent) {
    JointState& joint = joints_[j];
    BodyMotion<S> body = next_motion(joint.transform, parent, v_[m_.v_index(j)], S(0.0));
    S& own = m_.joints[j].prismatic ? body.a[2] : body.al[2];
    joint.reference = -own;
    own = S(0.0);
    body.U = acceleration_matrix(body.w, body.al);
    return body;
  }

  // Takes the joint's freedom out of its body's inertia and adds the rest to the parent's, seen
  // from the frame that the body has at position zero: what is turned need not wait for 1 / D.
  void pass_on(int j, BodyState& parent) {
    JointState& joint = joints_[j];
    const bool slides = m_.joints[j].prismatic;
    const double armature = m_.joints[j].armature;
    ArticulatedInertia<S> x = moved_back(joint.transform, bodies_[j + 1].inertia);
    Force<S> column;  // the inertia's, of the joint
    for (int i = 0; i < 3; ++i) {
      column.f[i] = slides ? x.M(i, 2) : x.H[i][2];
      column.n[i] = slides ? x.H[2][i] : x.I(i, 2);
    }
    const S reciprocal = S(1.0) / ((slides ? column.f[2] : column.n[2]) + armature);
    for (int i = 0; i < 3; ++i) {
      joint.U_over_D.f[i] = column.f[i] * reciprocal;
      joint.U_over_D.n[i] = column.n[i] * reciprocal;
    }
    if (armature == 0.0) (slides ? joint.U_over_D.f : joint.U_over_D.n)[2] = S(1.0);
    project(x, joint.U_over_D, column, slides, armature);
    Force<S> bias = moved_back(joint.transform, bodies_[j + 1].bias);
    const S u = tau_[m_.v_index(j)] - (slides ? bias.f[2] : bias.n[2]) - armature * joint.reference;
    joint.u_over_D = u * reciprocal;
    for (int i = 0; i < 3; ++i) {
      bias.f[i] += joint.U_over_D.f[i] * u;
      bias.n[i] += joint.U_over_D.n[i] * u;
    }
    if (armature == 0.0) (slides ? bias.f : bias.n)[2] = tau_[m_.v_index(j)];
    add_to(parent.inertia, fixed_to_parent(joint.transform, x));
    parent.bias = parent.bias + fixed_to_parent(joint.transform, bias);
  }

  // x - U U^T / D; without armature nothing is left in the joint's own row and column.
  static void project(ArticulatedInertia<S>& x, const Force<S>& U_over_D, const Force<S>& U,
                      bool slides, double armature) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j <= i; ++j) {
        x.M(i, j) -= U_over_D.f[i] * U.f[j];
        x.I(i, j) -= U_over_D.n[i] * U.n[j];
      }
      for (int j = 0; j < 3; ++j) x.H[i][j] -= U_over_D.f[i] * U.n[j];
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
      Vec3<S> al = angular;
      Vec3<S> a = linear;
      carry_to_zero(joint.transform, al, a);
      const bool slides = m_.joints[j].prismatic;
      S& own = slides ? a[2] : al[2];
      const S carried = own;
      if (m_.joints[j].armature == 0.0) {  // U / D is 1 there: own becomes the sum of both
        own = S(0.0);
        own = joint.u_over_D - dot(joint.U_over_D.f, a) - dot(joint.U_over_D.n, al);
        vdot_[m_.v_index(j)] = own - carried + joint.reference;
      } else {
        const S more = joint.u_over_D - dot(joint.U_over_D.f, a) - dot(joint.U_over_D.n, al);
        vdot_[m_.v_index(j)] = more + joint.reference;
        own = carried + more;
      }
      move(joint.transform, al, a);
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
