// One joint's motion and one body's state of motion, over any scalar: what every algorithm uses.
// Layer: model.  Thread: any.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "model/mechanism.hpp"

namespace tandem::model {

/// A joint at its position. `down` goes from the parent's frame to the body's, `up` back.
template <class S>
struct JointTransform {
  const MechanismJoint* joint;
  AxisRotation<S> turn;  ///< revolute: by q + offset about z
  S slide = 0.0;         ///< prismatic: q along z
};

template <class S>
[[nodiscard]] JointTransform<S> joint_transform(const MechanismJoint& joint, const S& q) {
  using std::cos;
  using std::sin;
  JointTransform<S> result{&joint, {}, S(0.0)};
  if (joint.prismatic) {
    result.slide = q;
    return result;
  }
  if (joint.cos_offset != 0.0 && joint.sin_offset != 0.0) {
    const S angle = q + joint.offset;
    result.turn = {2, cos(angle), sin(angle), S(0.0)};
  } else {
    const S c = cos(q);
    const S s = sin(q);
    result.turn = {2, c * joint.cos_offset - s * joint.sin_offset,
                   s * joint.cos_offset + c * joint.sin_offset, S(0.0)};
  }
  result.turn.c2 = result.turn.c + result.turn.c;
  return result;
}

/// A direction's components in the body's frame.
template <class S>
[[nodiscard]] Vec3<S> to_child(const JointTransform<S>& t, const Vec3<S>& v) {
  const Vec3<S> fixed = rotate_back(t.joint->in_parent.R, v);
  return t.joint->prismatic ? fixed : rotate(t.turn.inverse(), fixed);
}
template <class S>
[[nodiscard]] Vec3<S> to_parent(const JointTransform<S>& t, const Vec3<S>& v) {
  return rotate(t.joint->in_parent.R, t.joint->prismatic ? v : rotate(t.turn, v));
}

/// The joint's motion alone: from the body's frame to the one that it has at position zero, whose
/// z axis is the same. Inertias (moments or articulated) and forces.
template <class S, template <class> class Inertial>
[[nodiscard]] Inertial<S> moved_back(const JointTransform<S>& t, Inertial<S> x) {
  if (!t.joint->prismatic) return turned(t.turn, x);
  shift(x, 2, t.slide);
  return x;
}
template <class S>
[[nodiscard]] Force<S> moved_back(const JointTransform<S>& t, const Force<S>& x) {
  if (!t.joint->prismatic) return {rotate(t.turn, x.f), rotate(t.turn, x.n)};
  return {x.f, {x.n[0] - t.slide * x.f[1], x.n[1] + t.slide * x.f[0], x.n[2]}};
}
/// The rest: from there to the parent's frame.
template <class S, template <class> class Inertial>
[[nodiscard]] Inertial<S> fixed_to_parent(const JointTransform<S>& t, Inertial<S> x) {
  x = turned(t.joint->in_parent.R, x);
  for (int axis = 0; axis < 3; ++axis)
    if (const double p = t.joint->in_parent.p[axis]; p != 0.0) shift(x, axis, p);
  return x;
}
template <class S>
[[nodiscard]] Force<S> fixed_to_parent(const JointTransform<S>& t, const Force<S>& x) {
  const auto& [R, p] = t.joint->in_parent;
  const Vec3<S> f = rotate(R, x.f);
  return {f, rotate(R, x.n) + cross(p, f)};
}
/// Both.
template <class S, template <class> class Quantity>
[[nodiscard]] Quantity<S> to_parent(const JointTransform<S>& t, const Quantity<S>& x) {
  return fixed_to_parent(t, moved_back(t, x));
}

/// The body's angular and linear quantity (of its origin) from its parent's, with the joint at
/// rest: velocities, or accelerations where no velocity matters. First with the joint at position
/// zero, then at its own.
template <class S>
void carry_to_zero(const JointTransform<S>& t, Vec3<S>& angular, Vec3<S>& linear) {
  const auto& [R, p] = t.joint->in_parent;
  linear = rotate_back(R, linear - cross(p, angular));
  angular = rotate_back(R, angular);
}
template <class S>
void move(const JointTransform<S>& t, Vec3<S>& angular, Vec3<S>& linear) {
  if (t.joint->prismatic) {
    linear[0] += t.slide * angular[1];
    linear[1] -= t.slide * angular[0];
    return;
  }
  linear = rotate(t.turn.inverse(), linear);
  angular = rotate(t.turn.inverse(), angular);
}

template <class S>
void carry_down(const JointTransform<S>& t, const Vec3<S>& angular, const Vec3<S>& linear,
                Vec3<S>& body_angular, Vec3<S>& body_linear) {
  body_angular = angular;
  body_linear = linear;
  carry_to_zero(t, body_angular, body_linear);
  move(t, body_angular, body_linear);
}

/// [alpha x] + [omega x]^2: the acceleration of a point r of the body is a + U r.
template <class S>
[[nodiscard]] Mat3<S> acceleration_matrix(const Vec3<S>& w, const Vec3<S>& al) {
  const S xx = w[0] * w[0];
  const S yy = w[1] * w[1];
  const S zz = w[2] * w[2];
  const S xy = w[0] * w[1];
  const S xz = w[0] * w[2];
  const S yz = w[1] * w[2];
  return {{{-(yy + zz), xy - al[2], xz + al[1]},
           {xy + al[2], -(xx + zz), yz - al[0]},
           {xz - al[1], yz + al[0], -(xx + yy)}}};
}

/// How a body moves, in its own frame.
template <class S>
struct BodyMotion {
  Vec3<S> w{0.0, 0.0, 0.0};   ///< angular velocity
  Vec3<S> al{0.0, 0.0, 0.0};  ///< angular acceleration
  Vec3<S> a{0.0, 0.0, 0.0};   ///< acceleration of the origin (classical), minus gravity if asked
  Mat3<S> U{};                ///< acceleration_matrix(w, al)
};

/// The motion of the body behind a joint.
template <class S>
[[nodiscard]] BodyMotion<S> next_motion(const JointTransform<S>& t, const BodyMotion<S>& parent,
                                        const S& v, const S& vdot) {
  BodyMotion<S> body;
  body.w = to_child(t, parent.w);
  body.al = to_child(t, parent.al);
  body.a = to_child(t, parent.a + multiply(parent.U, vec<S>(t.joint->in_parent.p)));
  if (t.joint->prismatic) {
    body.U = acceleration_matrix(body.w, body.al);
    for (int i = 0; i < 3; ++i) body.a[i] += body.U[i][2] * t.slide;
    const S v2 = v + v;
    body.a[0] += v2 * body.w[1];
    body.a[1] -= v2 * body.w[0];
    body.a[2] += vdot;
    return body;
  }
  body.al[0] += body.w[1] * v;
  body.al[1] -= body.w[0] * v;
  body.al[2] += vdot;
  body.w[2] += v;
  body.U = acceleration_matrix(body.w, body.al);
  return body;
}

/// The base's rotation, base to world, of a unit quaternion x y z w.
template <class S>
[[nodiscard]] Mat3<S> rotation_of_quaternion(std::span<const S> q) {
  const S x2 = q[0] + q[0];
  const S y2 = q[1] + q[1];
  const S z2 = q[2] + q[2];
  const S xx = q[0] * x2;
  const S yy = q[1] * y2;
  const S zz = q[2] * z2;
  const S xy = q[0] * y2;
  const S xz = q[0] * z2;
  const S yz = q[1] * z2;
  const S wx = q[3] * x2;
  const S wy = q[3] * y2;
  const S wz = q[3] * z2;
  return {{{S(1.0) - (yy + zz), xy - wz, xz + wy},
           {xy + wz, S(1.0) - (xx + zz), yz - wx},
           {xz - wy, yz + wx, S(1.0) - (xx + yy)}}};
}

/// Where the base stands: the identity for a fixed base.
template <class S>
struct BasePose {
  Mat3<S> R{{{S(1.0), S(0.0), S(0.0)}, {S(0.0), S(1.0), S(0.0)}, {S(0.0), S(0.0), S(1.0)}}};
  Vec3<S> p{0.0, 0.0, 0.0};
};
template <class S>
[[nodiscard]] BasePose<S> base_pose(const Mechanism& m, std::span<const S> q) {
  if (!m.floating_base) return {};
  return {rotation_of_quaternion(q.subspan(3, 4)), {q[0], q[1], q[2]}};
}

/// The base's motion. `vdot` may be empty: no acceleration of its velocity's components.
/// With `gravity`, accelerations are those felt: minus gravity.
template <class S>
[[nodiscard]] BodyMotion<S> base_motion(const Mechanism& m, std::span<const S> q,
                                        std::span<const S> v, std::span<const S> vdot,
                                        bool gravity) {
  BodyMotion<S> base;
  const Vec3<double> none{0.0, 0.0, 0.0};
  const Vec3<S> g = vec<S>(gravity ? m.gravity : none);
  if (!m.floating_base) {
    base.a = Vec3<S>{S(0.0), S(0.0), S(0.0)} - g;
  } else {
    base.w = {v[3], v[4], v[5]};
    base.a = cross(base.w, Vec3<S>{v[0], v[1], v[2]});
    if (!vdot.empty()) {
      base.al = {vdot[3], vdot[4], vdot[5]};
      base.a = base.a + Vec3<S>{vdot[0], vdot[1], vdot[2]};
    }
    base.a = base.a - multiply_transposed(base_pose(m, q).R, g);
  }
  base.U = acceleration_matrix(base.w, base.al);
  return base;
}

/// The force and moment about the origin that give masses `x` this motion.
template <class S>
[[nodiscard]] Force<S> inertial_force(const Moments<double>& x, const BodyMotion<S>& body) {
  const Mat3<S>& U = body.U;
  const Sym3<double>& J = x.J;
  Force<S> result;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    result.f[i] = body.a[i] * x.m + U[i][i] * x.h[i] + U[i][j] * x.h[j] + U[i][k] * x.h[k];
    const S diagonal = U[k][j] * J(j, j) - U[j][k] * J(k, k);  // one product if U(j, k) = U(k, j)
    result.n[i] = diagonal + U[k][i] * J(i, j) - U[j][i] * J(i, k) + (U[k][k] - U[j][j]) * J(j, k) +
                  body.a[k] * x.h[j] - body.a[j] * x.h[k];
  }
  return result;
}

/// The external wrench on `body` through its sites, about its origin, in its frame. With `only`,
/// of those sites alone.
template <class S>
[[nodiscard]] Force<S> external_force(const Mechanism& m, int body, std::span<const S> wrench,
                                      const std::vector<int>* only = nullptr) {
  Force<S> sum;
  for (std::size_t s = 0; s < m.sites.size(); ++s) {
    const MechanismSite& site = m.sites[s];
    if (site.body != body || site.wrench < 0) continue;
    if (only != nullptr && std::ranges::count(*only, static_cast<int>(s)) == 0) continue;
    const auto at = wrench.subspan(static_cast<std::size_t>(6 * site.wrench), 6);
    const Vec3<S> f = rotate(site.in_body.R, Vec3<S>{at[0], at[1], at[2]});
    const Vec3<S> n = rotate(site.in_body.R, Vec3<S>{at[3], at[4], at[5]});
    sum = sum + Force<S>{f, n + cross(site.in_body.p, f)};
  }
  return sum;
}

}  // namespace tandem::model
