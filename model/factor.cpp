// Constant rotations as the fewest turns about coordinate axes.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "model/mechanism.hpp"
#include "model/right_angles.hpp"

namespace tandem::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kExact = kExactRightAngle;  // below this an entry is rounding noise

AxisRotation<double> make_turn(int axis, double c, double s) {
  const double norm = std::hypot(c, s);
  return {axis, c / norm, s / norm, 2.0 * c / norm};
}

Matrix3d matrix_of(const AxisRotation<double>& turn) {
  Matrix3d R = Matrix3d::Identity();
  const int i = (turn.axis + 1) % 3;
  const int j = (turn.axis + 2) % 3;
  R(i, i) = R(j, j) = turn.c;
  R(j, i) = turn.s;
  R(i, j) = -turn.s;
  return R;
}

// The turn about `axis` that moves e_b (b != axis) towards `image`.
AxisRotation<double> turn_towards(int axis, int b, const Vector3d& image) {
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  if (b == i) return make_turn(axis, image[i], image[j]);
  return make_turn(axis, image[j], -image[i]);
}

bool one_turn(const Matrix3d& Q, std::vector<AxisRotation<double>>& turns) {
  for (int k = 0; k < 3; ++k) {
    if ((Q.col(k) - Vector3d::Unit(k)).lpNorm<Eigen::Infinity>() > kExact) continue;
    const int i = (k + 1) % 3;
    turns.push_back(turn_towards(k, i, Q.col(i)));
    return true;
  }
  return false;
}

// Q as turns, the first outermost; none when Q is the identity.
std::vector<AxisRotation<double>> factor_turns(const Matrix3d& Q) {
  std::vector<AxisRotation<double>> turns;
  if ((Q - Matrix3d::Identity()).lpNorm<Eigen::Infinity>() < kExact) return turns;
  if (one_turn(Q, turns)) return turns;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      if (a == b || std::abs(Q(a, b)) > kExact) continue;  // Q = R_a R_b: Q e_b is normal to e_a
      turns.push_back(turn_towards(a, b, Q.col(b)));
      const Matrix3d rest = matrix_of(turns[0]).transpose() * Q;
      const int i = (b + 1) % 3;
      turns.push_back(turn_towards(b, i, rest.col(i)));
      return turns;
    }
  }
  turns.push_back(make_turn(2, Q(0, 0), Q(1, 0)));  // Q = R_z R_y R_x
  const Matrix3d yx = matrix_of(turns[0]).transpose() * Q;
  turns.push_back(make_turn(1, yx(0, 0), -yx(2, 0)));
  const Matrix3d x = matrix_of(turns[1]).transpose() * yx;
  turns.push_back(make_turn(0, x(1, 1), x(2, 1)));
  return turns;
}

}  // namespace

FixedRotation factor_rotation(const Matrix3d& R) {
  FixedRotation best;
  std::size_t fewest = 9;
  double smallest_angle = 0.0;
  std::array<int, 3> from{0, 1, 2};
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      Matrix3d P = Matrix3d::Zero();
      FixedRotation candidate;
      candidate.from = from;
      for (int r = 0; r < 3; ++r) {
        candidate.sign[r] = ((signs >> r) & 1u) != 0 ? -1.0 : 1.0;
        P(r, from[r]) = candidate.sign[r];
      }
      if (P.determinant() < 0.0) continue;
      candidate.turns = factor_turns(R * P.transpose());
      double angle = 0.0;
      for (const AxisRotation<double>& turn : candidate.turns)
        angle += std::abs(std::atan2(turn.s, turn.c));
      const std::size_t count = candidate.turns.size();
      if (count > fewest || (count == fewest && angle > smallest_angle - 1e-9)) continue;
      best = candidate;
      fewest = count;
      smallest_angle = angle;
    }
  } while (std::next_permutation(from.begin(), from.end()));
  return best;
}

MechanismJoint make_joint(const Joint& joint, const Placement& parent, const Placement& own) {
  const Placement in_parent = joint.in_parent * own;
  const Matrix3d R = parent.R.transpose() * in_parent.R;
  const Vector3d p = parent.R.transpose() * (in_parent.p - parent.p);
  MechanismJoint result;
  const double size = joint.in_parent.p.norm() + own.p.norm() + parent.p.norm();
  for (int k = 0; k < 3; ++k) result.in_parent.p[k] = std::abs(p[k]) < kExact * size ? 0.0 : p[k];
  result.prismatic = joint.type == JointType::kPrismatic;
  if (result.prismatic) {
    result.in_parent.R = factor_rotation(R);
    return result;
  }
  const Vector3d z = R.col(2);
  Vector3d x = Vector3d::UnitZ().cross(z);  // the common normal, or the parent's x when parallel
  x = x.norm() < kExact ? Vector3d::UnitX() : x.normalized();
  x = (x - x.dot(z) * z).normalized();
  Matrix3d fixed;
  fixed << x, z.cross(x), z;
  result.in_parent.R = factor_rotation(fixed);
  const Matrix3d rest = fixed.transpose() * R;  // a turn about z: the angle's offset
  double c = rest(0, 0);
  double s = rest(1, 0);
  if (std::abs(c) < kExact) c = 0.0;
  if (std::abs(s) < kExact) s = 0.0;
  const double norm = std::hypot(c, s);
  result.cos_offset = c / norm;
  result.sin_offset = s / norm;
  result.offset = std::atan2(s, c);
  return result;
}

}  // namespace tandem::model
