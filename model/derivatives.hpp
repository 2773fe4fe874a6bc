// Derivatives of inverse dynamics to the state, over any scalar.
// Layer: model.  Thread: any.
//
// Inverse dynamics is tau_i = sum over the bodies behind joint i of the integral of
// J_i(r) . acc(r) dm, where J_i is the velocity of the point r for a unit rate of joint i. A joint
// at the origin O, about z, changes the accelerations of all points behind it. With w, alpha of its
// body, a the acceleration of O, u(r) the velocity of r relative to that of O, s = w x z and
// sigma = alpha x z + w x (w x z), by
//
//     2 s x r + 2 z x u                  for its rate,
//     -z x a + sigma x r + 2 s x u       for its position, besides turning all that is behind it.
//
// Both are fields of one kind: uniform + turn x r + 2 spin x u. So each joint has two forces that
// its fields need, and one row of integrals against its J (J, r x J, u x J), carried to the base
// from body to body; on the way every entry is a product with a joint's field, whose components are
// mostly zeros. These are the formulas of Singh, Russell, Wensing: Efficient analytical derivatives
// of rigid-body dynamics using spatial vector algebra (2022), in frames whose origins are at rest.
#pragma once

#include "model/forward_dynamics.hpp"
#include "model/momentum.hpp"

namespace tandem::model {

/// d tau / d q, d tau / d v and d tau / d vdot = M of inverse dynamics, each nv x nv, row-major.
/// A floating base's q is varied in its tangent space, in the base's own frame: model/kernels.h.
template <class S>
class RneaDerivatives {
 public:
  RneaDerivatives(const Mechanism& m, std::span<const S> q, std::span<const S> v,
                  std::span<const S> vdot, std::span<const S> wrench, std::span<S> dq,
                  std::span<S> dv, std::span<S> M)
      : m_(m), q_(q), v_(v), vdot_(vdot), wrench_(wrench), dq_(dq), dv_(dv), M_(M) {}

  void run() {
    for (const std::span<S> matrix : {dq_, dv_, M_})
      for (S& entry : matrix) entry = S(0.0);
    motions_.push_back(base_motion(m_, q_, v_, vdot_, true));
    for (int j = 0; j < m_.joint_count(); ++j) start_joint(j);
    for (std::size_t b = 0; b < motions_.size(); ++b)
      subtrees_.push_back(body(static_cast<int>(b)));
    for (int j = m_.joint_count() - 1; j >= 0; --j) {
      joint(j);
      add_to_parent(j);
    }
    if (m_.floating_base) base();
  }

 private:
  // Integrals of the relative velocities of a subtree: u and u r^T.
  struct Flow {
    Vec3<S> P{0.0, 0.0, 0.0};
    Mat3<S> K{};
  };
  struct Subtree {
    Moments<S> x;
    Flow flow;
    Force<S> force;  // that the motion needs, less the external ones
  };
  // Integrals of J_i, of r x J_i and of u x J_i.
  struct Row {
    Force<S> momentum;
    Vec3<S> flow{0.0, 0.0, 0.0};
  };
  // A change of accelerations: uniform + turn x r + 2 spin x u.
  struct Field {
    Vec3<S> uniform{0.0, 0.0, 0.0}, turn{0.0, 0.0, 0.0}, spin{0.0, 0.0, 0.0};
  };

  S& entry(std::span<S> matrix, int i, int j) const { return matrix[i * m_.nv() + j]; }
  static Vec3<S> twice(const Vec3<S>& a) { return a + a; }
  static Vec3<S> unit(int k) {
    Vec3<S> result{S(0.0), S(0.0), S(0.0)};
    result[k] = S(1.0);
    return result;
  }

  // The force that a field needs on a subtree.
  static Force<S> needed(const Subtree& tree, const Field& field) {
    const Moments<S>& x = tree.x;
    const Flow& flow = tree.flow;
    const Vec3<S> spin = twice(field.spin);
    Force<S> result;
    result.f = cross(field.turn, x.h) + cross(spin, flow.P);
    result.n = cross(x.h, field.uniform);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      const int k = (i + 2) % 3;
      result.f[i] += x.m * field.uniform[i];
      result.n[i] += (x.J(j, j) + x.J(k, k)) * field.turn[i] - x.J(i, j) * field.turn[j] -
                     x.J(i, k) * field.turn[k];
      result.n[i] +=
          (flow.K[j][j] + flow.K[k][k]) * spin[i] - flow.K[i][j] * spin[j] - flow.K[i][k] * spin[k];
    }
    return result;
  }
  // The same against J_i.
  static S along(const Row& row, const Field& field) {
    return dot(row.momentum.f, field.uniform) + dot(row.momentum.n, field.turn) +
           dot(row.flow, twice(field.spin));
  }

  // How joint j and its body move, and what changes with the joint's position and rate.
  void start_joint(int j) {
    const int i = m_.v_index(j);
    transforms_.push_back(joint_transform(m_.joints[j], q_[m_.q_index(j)]));
    motions_.push_back(next_motion(transforms_[j], motions_[m_.joints[j].parent], v_[i], vdot_[i]));
    const BodyMotion<S>& motion = motions_.back();
    const Vec3<S> none{S(0.0), S(0.0), S(0.0)};
    const Vec3<S> s{motion.w[1], -motion.w[0], S(0.0)};
    const Vec3<S> sigma{motion.U[0][2], motion.U[1][2], motion.U[2][2]};
    if (m_.joints[j].prismatic) {
      to_q_.push_back({sigma, none, none});
      to_v_.push_back({twice(s), none, none});
    } else {
      to_q_.push_back({{motion.a[1], -motion.a[0], S(0.0)}, sigma, s});
      to_v_.push_back({none, twice(s), unit(2)});
    }
  }

  // One body alone.
  Subtree body(int b) const {
    const BodyMotion<S>& motion = motions_[b];
    Subtree result{in_scalar<S>(m_.moments[b]), {}, inertial_force(m_.moments[b], motion)};
    const Moments<S>& x = result.x;
    result.flow.P = cross(motion.w, x.h);
    for (int k = 0; k < 3; ++k) {
      const Vec3<S> column = cross(motion.w, Vec3<S>{x.J(0, k), x.J(1, k), x.J(2, k)});
      for (int i = 0; i < 3; ++i) result.flow.K[i][k] = column[i];
    }
    if (!wrench_.empty()) result.force = result.force - external_force(m_, b, wrench_);
    return result;
  }

  // All entries between joint j and those before it.
  void joint(int j) {
    const Subtree& tree = subtrees_[j + 1];
    const auto& [x, flow, F] = tree;
    const Mat3<S>& K = flow.K;
    Row row;
    Force<S> moved;  // what moving the force itself adds
    if (m_.joints[j].prismatic) {
      row = {{{S(0.0), S(0.0), x.m}, {x.h[1], -x.h[0], S(0.0)}}, {flow.P[1], -flow.P[0], S(0.0)}};
      moved.n = {-F.f[1], F.f[0], S(0.0)};
    } else {
      row = {{{-x.h[1], x.h[0], S(0.0)}, {-x.J(0, 2), -x.J(1, 2), x.J(0, 0) + x.J(1, 1)}},
             {-K[2][0], -K[2][1], K[0][0] + K[1][1]}};
      moved = {{-F.f[1], F.f[0], S(0.0)}, {-F.n[1], F.n[0], S(0.0)}};
    }
    carry_force(dv_, j, needed(tree, to_v_[j]));
    carry_force(dq_, j, needed(tree, to_q_[j]) + moved);
    carry_row(j, row);
  }

  // The component of a force that joint i feels.
  S felt(int i, const Force<S>& force) const {
    return m_.joints[i].prismatic ? force.f[2] : force.n[2];
  }

  // Column j: the force that a change at joint j needs, at every joint from it to the base.
  void carry_force(std::span<S> matrix, int j, Force<S> force) {
    const int column = m_.v_index(j);
    for (int i = j; i >= 0; i = m_.joints[i].parent - 1) {
      entry(matrix, m_.v_index(i), column) = felt(i, force);
      force = to_parent(transforms_[i], force);
    }
    if (m_.floating_base) set_base_column(matrix, column, force);
  }

  // Row j: what joint j feels of a change at every joint from it to the base. M is symmetric.
  void carry_row(int j, Row row) {
    const int own = m_.v_index(j);
    for (int i = j; i >= 0; i = m_.joints[i].parent - 1) {
      const int k = m_.v_index(i);
      entry(M_, own, k) = entry(M_, k, own) = felt(i, row.momentum);
      if (i != j) {
        entry(dq_, own, k) = along(row, to_q_[i]);
        entry(dv_, own, k) = along(row, to_v_[i]);
      }
      row = seen_from_parent(i, row);
    }
    entry(M_, own, own) += m_.joints[j].armature;
    if (m_.floating_base) base_row(own, row);
  }

  // The velocity of a body's origin relative to that of its parent: first along the joint, in the
  // body's axes, then of the joint's place, in the parent's.
  Vec3<S> sliding(int j) const {
    const Vec3<S>& w = motions_[j + 1].w;
    const S& slide = transforms_[j].slide;
    return {slide * w[1], -(slide * w[0]), v_[m_.v_index(j)]};
  }
  Vec3<S> of_place(int j) const {
    return cross(motions_[m_.joints[j].parent].w, vec<S>(m_.joints[j].in_parent.p));
  }

  Row seen_from_parent(int j, const Row& row) const {
    const JointTransform<S>& t = transforms_[j];
    const Force<S> momentum = to_parent(t, row.momentum);
    Vec3<S> flow = row.flow;
    if (m_.joints[j].prismatic) flow = flow + cross(sliding(j), row.momentum.f);
    return {momentum, to_parent(t, flow) + cross(of_place(j), momentum.f)};
  }

  void add_to_parent(int j) {
    const JointTransform<S>& t = transforms_[j];
    const Subtree& child = subtrees_[j + 1];
    Subtree& sum = subtrees_[m_.joints[j].parent];
    Flow flow = child.flow;
    if (m_.joints[j].prismatic) {
      Moments<S> x = child.x;
      shift(x, 2, t.slide);
      shift_flow(flow, sliding(j), Vec3<S>{S(0.0), S(0.0), t.slide}, x);
    } else {
      flow = {rotate(t.turn, flow.P), rotate(t.turn, flow.K)};
    }
    const auto& [R, p] = m_.joints[j].in_parent;
    const Moments<S> x = to_parent(t, child.x);
    flow = {rotate(R, flow.P), rotate(R, flow.K)};
    shift_flow(flow, of_place(j), p, x);
    add_to(sum.x, x);
    sum.flow.P = sum.flow.P + flow.P;
    for (int i = 0; i < 3; ++i) sum.flow.K[i] = sum.flow.K[i] + flow.K[i];
    sum.force = sum.force + to_parent(t, child.force);
  }
  // Seen from a frame whose origin lies at -p and moves with -u, where the moments are x.
  template <class T>
  static void shift_flow(Flow& flow, const Vec3<S>& u, const Vec3<T>& p, const Moments<S>& x) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) flow.K[a][b] += flow.P[a] * p[b] + u[a] * x.h[b];
    for (int a = 0; a < 3; ++a) flow.P[a] += x.m * u[a];
  }

  // What the base's orientation, its linear and its angular velocity change, about or along its own
  // axis k. Its acceleration, as felt, is vdot + w x v - R^T g.
  Field base_turned(int k) const {
    const Vec3<S> g = multiply_transposed(base_pose(m_, q_).R, vec<S>(m_.gravity));
    return {.uniform = cross(unit(k), g)};
  }
  Field base_linear(int k) const { return {.uniform = cross(motions_[0].w, unit(k))}; }
  Field base_angular(int k) const {
    return {cross(unit(k), Vec3<S>{v_[0], v_[1], v_[2]}), cross(motions_[0].w, unit(k)), unit(k)};
  }

  void base_row(int own, const Row& row) {
    for (int k = 0; k < 3; ++k) {
      entry(dq_, own, k + 3) = along(row, base_turned(k));
      entry(dv_, own, k) = along(row, base_linear(k));
      entry(dv_, own, k + 3) = along(row, base_angular(k));
      entry(M_, own, k) = entry(M_, k, own) = row.momentum.f[k];
      entry(M_, own, k + 3) = entry(M_, k + 3, own) = row.momentum.n[k];
    }
  }
  void base() {
    for (int k = 0; k < 3; ++k) {
      const Subtree& all = subtrees_[0];
      set_base_column(dq_, k + 3, needed(all, base_turned(k)));
      set_base_column(dv_, k, needed(all, base_linear(k)));
      set_base_column(dv_, k + 3, needed(all, base_angular(k)));
      set_base_column(M_, k, needed(all, {.uniform = unit(k)}));
      set_base_column(M_, k + 3, needed(all, {.turn = unit(k)}));
    }
  }
  void set_base_column(std::span<S> matrix, int j, const Force<S>& force) {
    for (int k = 0; k < 3; ++k) {
      entry(matrix, k, j) = force.f[k];
      entry(matrix, k + 3, j) = force.n[k];
    }
  }

  const Mechanism& m_;
  std::span<const S> q_, v_, vdot_, wrench_;
  std::span<S> dq_, dv_, M_;
  std::vector<JointTransform<S>> transforms_;  // per joint
  std::vector<Field> to_q_, to_v_;             // per joint
  std::vector<BodyMotion<S>> motions_;         // per body
  std::vector<Subtree> subtrees_;              // per body, with all that is behind it
};

}  // namespace tandem::model
