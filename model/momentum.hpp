// Mass matrix, centre of mass, momentum and energy, over any scalar.
// Layer: model.  Thread: any.
#pragma once

#include "model/kinematics.hpp"

namespace tandem::model {

template <class S>
[[nodiscard]] Moments<S> in_scalar(const Moments<double>& x) {
  Moments<S> result;
  add_to(result, x);
  return result;
}

/// M by the composite-rigid-body algorithm (CRBA; Featherstone 2008, chapter 6): nv x nv, both
/// triangles.
template <class S>
class Crba {
 public:
  Crba(const Mechanism& m, std::span<const S> q, std::span<S> M) : m_(m), q_(q), M_(M) {}

  void run() {
    for (S& entry : M_) entry = S(0.0);
    std::vector<Column> columns;
    const Moments<S> all = visit(0, columns);
    if (!m_.floating_base) return;
    for (const Column& column : columns)
      for (int i = 0; i < 3; ++i) {
        set(i, column.index, column.force.f[i]);
        set(i + 3, column.index, column.force.n[i]);
      }
    const ArticulatedInertia<S> x = rigid_inertia<S>(all);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        set(i, j, x.M(i, j));
        set(i, j + 3, x.H[i][j]);
        set(i + 3, j + 3, x.I(i, j));
      }
  }

 private:
  // The force on a body that a unit acceleration of joint `index` behind it needs.
  struct Column {
    int index;
    Force<S> force;
  };

  void set(int i, int j, const S& value) {
    M_[i * m_.nv() + j] = value;
    M_[j * m_.nv() + i] = value;
  }

  Moments<S> visit(int body, std::vector<Column>& columns) {
    Moments<S> composite = in_scalar<S>(m_.moments[body]);
    for (const int j : m_.children[body]) {
      const bool slides = m_.joints[j].prismatic;
      const JointTransform<S> t = joint_transform(m_.joints[j], q_[m_.q_index(j)]);
      std::vector<Column> behind;
      const Moments<S> child = visit(j + 1, behind);
      behind.push_back({m_.v_index(j), slides ? slide(child) : turn(child)});
      for (const Column& column : behind) {
        const S entry = slides ? column.force.f[2] : column.force.n[2];
        const bool own = column.index == m_.v_index(j);
        set(m_.v_index(j), column.index, own ? entry + m_.joints[j].armature : entry);
        columns.push_back({column.index, to_parent(t, column.force)});
      }
      add_to(composite, to_parent(t, child));
    }
    return composite;
  }
  static Force<S> turn(const Moments<S>& x) {
    return {{-x.h[1], x.h[0], S(0.0)}, {-x.J(0, 2), -x.J(1, 2), x.J(0, 0) + x.J(1, 1)}};
  }
  static Force<S> slide(const Moments<S>& x) {
    return {{S(0.0), S(0.0), x.m}, {x.h[1], -x.h[0], S(0.0)}};
  }

  const Mechanism& m_;
  std::span<const S> q_;
  std::span<S> M_;
};

/// The centre of mass, its velocity and its Jacobian (3 x nv, row-major), in the world.
template <class S>
class CenterOfMass {
 public:
  CenterOfMass(const Mechanism& m, std::span<const S> q, std::span<const S> v, std::span<S> c,
               std::span<S> cdot, std::span<S> J)
      : m_(m), q_(q), v_(v), c_(c), cdot_(cdot), J_(J) {}

  void run() {
    const BasePose<S> base = base_pose(m_, q_);
    const Vec3<S> h = visit(0, base.R).h;
    const Vec3<S> from_base = multiply(base.R, h);
    for (int i = 0; i < 3; ++i) c_[i] = base.p[i] + from_base[i];
    if (m_.floating_base) {
      for (int k = 0; k < 3; ++k) {
        Vec3<S> unit{S(0.0), S(0.0), S(0.0)};
        unit[k] = S(1.0);
        set_column(k, multiply(base.R, unit));
        set_column(k + 3, multiply(base.R, cross(unit, h)));
      }
    }
    for (int i = 0; i < 3; ++i) {
      cdot_[i] = S(0.0);
      for (int k = 0; k < m_.nv(); ++k) cdot_[i] += J_[i * m_.nv() + k] * v_[k];
    }
  }

 private:
  void set_column(int k, const Vec3<S>& column) {
    for (int i = 0; i < 3; ++i) J_[i * m_.nv() + k] = column[i];
  }

  // The subtree's moments over the robot's mass; R: the body to the world.
  Moments<S> visit(int body, const Mat3<S>& R) {
    Moments<S> sum;
    const double scale = 1.0 / m_.mass_kg;
    sum.m = m_.moments[body].m * scale;
    for (int i = 0; i < 3; ++i) sum.h[i] = m_.moments[body].h[i] * scale;
    for (const int j : m_.children[body]) {
      const JointTransform<S> t = joint_transform(m_.joints[j], q_[m_.q_index(j)]);
      Mat3<S> child_R;
      for (int row = 0; row < 3; ++row) child_R[row] = to_child(t, R[row]);
      const Moments<S> child = visit(j + 1, child_R);
      const Vec3<S> column = m_.joints[j].prismatic ? Vec3<S>{S(0.0), S(0.0), child.m}
                                                    : Vec3<S>{-child.h[1], child.h[0], S(0.0)};
      set_column(m_.v_index(j), multiply(child_R, column));
      add_to(sum, to_parent(t, child));
    }
    return sum;
  }

  const Mechanism& m_;
  std::span<const S> q_, v_;
  std::span<S> c_, cdot_, J_;
};

/// The momentum of masses that turn with w about an origin that moves with v, about it.
template <class S>
[[nodiscard]] Force<S> momentum_of(const Moments<double>& x, const Vec3<S>& w, const Vec3<S>& v) {
  Force<S> p;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    p.f[i] = v[i] * x.m + w[j] * x.h[k] - w[k] * x.h[j];
    p.n[i] = w[i] * (x.J(j, j) + x.J(k, k)) - w[j] * x.J(i, j) - w[k] * x.J(i, k) + v[k] * x.h[j] -
             v[j] * x.h[k];
  }
  return p;
}

/// The momentum of everything and the moments of the masses, about the base's origin, in the
/// base's frame; and what the joints' motion adds to twice the kinetic energy.
template <class S>
class Momentum {
 public:
  Momentum(const Mechanism& m, std::span<const S> q, std::span<const S> v) : m_(m), q_(q), v_(v) {
    if (m.floating_base) {
      linear_ = {v[0], v[1], v[2]};
      angular_ = {v[3], v[4], v[5]};
    }
    const Total total = visit(0, angular_, linear_);
    momentum_ = total.momentum;
    moments_ = total.moments;
    energy2_ += dot(linear_, momentum_.f) + dot(angular_, momentum_.n);
  }

  [[nodiscard]] const Force<S>& momentum() const { return momentum_; }
  [[nodiscard]] const Vec3<S>& first_moment() const { return moments_.h; }
  [[nodiscard]] const S& twice_kinetic_energy() const { return energy2_; }

 private:
  struct Total {
    Force<S> momentum;
    Moments<S> moments;
  };

  Total visit(int body, const Vec3<S>& angular, const Vec3<S>& linear) {
    Total total{momentum_of(m_.moments[body], angular, linear), {}};
    total.moments.m = m_.moments[body].m;
    total.moments.h = vec<S>(m_.moments[body].h);
    for (const int j : m_.children[body]) {
      const S rate = v_[m_.v_index(j)];
      const bool slides = m_.joints[j].prismatic;
      const JointTransform<S> t = joint_transform(m_.joints[j], q_[m_.q_index(j)]);
      Vec3<S> w;
      Vec3<S> v;
      carry_down(t, angular, linear, w, v);
      (slides ? v : w)[2] += rate;
      const Total child = visit(j + 1, w, v);
      const S own = slides ? child.momentum.f[2] : child.momentum.n[2];
      energy2_ += rate * (own + m_.joints[j].armature * rate);
      total.momentum = total.momentum + to_parent(t, child.momentum);
      add_to(total.moments, to_parent(t, child.moments));
    }
    return total;
  }

  const Mechanism& m_;
  std::span<const S> q_, v_;
  Vec3<S> linear_{0.0, 0.0, 0.0}, angular_{0.0, 0.0, 0.0};
  Force<S> momentum_;
  Moments<S> moments_;
  S energy2_ = 0.0;
};

/// p = M v and b with dp/dt = tau + b (A. De Luca et al., "Collision detection and safe reaction
/// with the DLR-III lightweight manipulator arm", 2006). An entry of p is S . H of a joint's axis S
/// and the momentum H of all that it moves, as spatial vectors. H changes by the forces on these
/// masses, of which S . F is tau; S turns with the body's velocity V. So b = (V x S) . H + S .
/// (gravity and wrenches), by one pass over the tree, and no mass matrix is differentiated.
template <class S>
class GeneralisedMomentum {
 public:
  GeneralisedMomentum(const Mechanism& m, std::span<const S> q, std::span<const S> v,
                      std::span<const S> wrench, std::span<S> p, std::span<S> b)
      : m_(m), q_(q), v_(v), wrench_(wrench), p_(p), b_(b) {}

  void run() {
    Motion base{.gravity = multiply_transposed(base_pose(m_, q_).R, vec<S>(m_.gravity))};
    if (m_.floating_base) {
      base.linear = {v_[0], v_[1], v_[2]};
      base.angular = {v_[3], v_[4], v_[5]};
    }
    const Total total = visit(0, base);
    if (!m_.floating_base) return;
    const Force<S> change = rate(total, base);
    for (int i = 0; i < 3; ++i) {
      p_[i] = total.momentum.f[i];
      p_[i + 3] = total.momentum.n[i];
      b_[i] = change.f[i];
      b_[i + 3] = change.n[i];
    }
  }

 private:
  // Motion of a body's origin, and gravity, in its frame.
  struct Motion {
    Vec3<S> angular{S(0.0), S(0.0), S(0.0)};
    Vec3<S> linear{S(0.0), S(0.0), S(0.0)};
    Vec3<S> gravity;
  };
  // Sums over a body and all behind it, about its origin, in its frame.
  struct Total {
    Force<S> momentum;
    Moments<S> moments;
    Force<S> external;
  };

  // What the body's motion, gravity and wrenches change of the momentum's components in its frame.
  static Force<S> rate(const Total& t, const Motion& body) {
    Force<S> g;
    for (int i = 0; i < 3; ++i) g.f[i] = t.moments.m * body.gravity[i];
    g.n = cross(t.moments.h, body.gravity);
    const Force<S> turned{cross(t.momentum.f, body.angular),
                          cross(t.momentum.n, body.angular) + cross(t.momentum.f, body.linear)};
    return turned + g + t.external;
  }

  Total visit(int body, const Motion& motion) {
    Total total{momentum_of(m_.moments[body], motion.angular, motion.linear), {}, {}};
    total.moments.m = m_.moments[body].m;
    total.moments.h = vec<S>(m_.moments[body].h);
    total.external = external_force(m_, body, wrench_);
    for (const int j : m_.children[body]) {
      const int i = m_.v_index(j);
      const bool slides = m_.joints[j].prismatic;
      const JointTransform<S> t = joint_transform(m_.joints[j], q_[m_.q_index(j)]);
      Motion child{.gravity = to_child(t, motion.gravity)};
      carry_down(t, motion.angular, motion.linear, child.angular, child.linear);
      (slides ? child.linear : child.angular)[2] += v_[i];
      const Total behind = visit(j + 1, child);
      const Force<S> change = rate(behind, child);
      p_[i] = (slides ? behind.momentum.f : behind.momentum.n)[2] + m_.joints[j].armature * v_[i];
      b_[i] = (slides ? change.f : change.n)[2];
      total.momentum = total.momentum + to_parent(t, behind.momentum);
      total.external = total.external + to_parent(t, behind.external);
      add_to(total.moments, to_parent(t, behind.moments));
    }
    return total;
  }

  const Mechanism& m_;
  std::span<const S> q_, v_, wrench_;
  std::span<S> p_, b_;
};

/// Linear, then angular about the centre of mass, in the world.
template <class S>
void centroidal_momentum(const Mechanism& m, std::span<const S> q, std::span<const S> v,
                         std::span<S> h) {
  const Momentum<S> total(m, q, v);
  const Vec3<S> arm = cross(total.first_moment(), total.momentum().f);
  Vec3<S> about_com;
  for (int i = 0; i < 3; ++i) about_com[i] = total.momentum().n[i] - arm[i] * (1.0 / m.mass_kg);
  const Mat3<S> R = base_pose(m, q).R;
  const Vec3<S> linear = multiply(R, total.momentum().f);
  const Vec3<S> angular = multiply(R, about_com);
  for (int i = 0; i < 3; ++i) {
    h[i] = linear[i];
    h[i + 3] = angular[i];
  }
}

/// Kinetic and potential energy; the potential is zero at the world's origin.
template <class S>
void energy(const Mechanism& m, std::span<const S> q, std::span<const S> v,
            std::span<S> kinetic_potential) {
  const Momentum<S> total(m, q, v);
  kinetic_potential[0] = total.twice_kinetic_energy() * 0.5;
  const BasePose<S> base = base_pose(m, q);
  const Vec3<S> h = multiply(base.R, total.first_moment());
  S potential = 0.0;
  for (int i = 0; i < 3; ++i) potential -= (base.p[i] * m.mass_kg + h[i]) * m.gravity[i];
  kinetic_potential[1] = potential;
}

}  // namespace tandem::model
