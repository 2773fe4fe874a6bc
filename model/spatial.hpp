// Small vectors, matrices and inertias over any scalar, turned and shifted one axis at a time,
// which is how joints with aligned frames move and what keeps the operations few.
// Layer: model.  Thread: any.
#pragma once

#include <array>
#include <vector>

namespace tandem::model {

template <class S>
using Vec3 = std::array<S, 3>;
template <class S>
using Mat3 = std::array<std::array<S, 3>, 3>;  ///< [row][column]

/// Symmetric 3x3.
template <class S>
struct Sym3 {
  std::array<S, 6> entry{};  ///< xx yy zz xy xz yz

  [[nodiscard]] static constexpr std::size_t index(int row, int column) {
    return static_cast<std::size_t>(row == column ? row : row + column + 2);
  }
  S& operator()(int row, int column) { return entry[index(row, column)]; }
  const S& operator()(int row, int column) const { return entry[index(row, column)]; }
};

template <class S>
[[nodiscard]] Vec3<S> operator+(const Vec3<S>& a, const Vec3<S>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <class S>
[[nodiscard]] Vec3<S> operator-(const Vec3<S>& a, const Vec3<S>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class S, class T>
[[nodiscard]] Vec3<S> cross(const Vec3<T>& a, const Vec3<S>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
template <class S, class T>
[[nodiscard]] S dot(const Vec3<T>& a, const Vec3<S>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class S, class T>
[[nodiscard]] Vec3<S> multiply(const Mat3<S>& m, const Vec3<T>& v) {
  Vec3<S> result;
  for (int i = 0; i < 3; ++i) result[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return result;
}
template <class S>
[[nodiscard]] Vec3<S> multiply_transposed(const Mat3<S>& m, const Vec3<S>& v) {
  Vec3<S> result;
  for (int i = 0; i < 3; ++i) result[i] = m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2];
  return result;
}
/// A vector of constants in another scalar.
template <class S>
[[nodiscard]] Vec3<S> vec(const Vec3<double>& v) {
  return {S(v[0]), S(v[1]), S(v[2])};
}

/// A rotation about one coordinate axis: R = R(axis, angle).
template <class T>
struct AxisRotation {
  int axis = 2;
  T c = 1.0;   ///< cosine
  T s = 0.0;   ///< sine
  T c2 = 2.0;  ///< twice the cosine

  [[nodiscard]] AxisRotation inverse() const { return {axis, c, -s, c2}; }
};

/// R v
template <class S, class T>
[[nodiscard]] Vec3<S> rotate(const AxisRotation<T>& turn, const Vec3<S>& v) {
  const int i = (turn.axis + 1) % 3;
  const int j = (turn.axis + 2) % 3;
  Vec3<S> result = v;
  result[i] = turn.c * v[i] - turn.s * v[j];
  result[j] = turn.s * v[i] + turn.c * v[j];
  return result;
}

/// R A R^T in 15 operations: with k = s (a_ii - a_jj) + 2 c a_ij the block of the two turned
/// axes becomes [a_ii - s k, c k - a_ij; ., a_jj + s k].
template <class S, class T>
[[nodiscard]] Sym3<S> rotate(const AxisRotation<T>& turn, const Sym3<S>& a) {
  const int k = turn.axis;
  const int i = (k + 1) % 3;
  const int j = (k + 2) % 3;
  Sym3<S> result = a;
  const S f = turn.s * (a(i, i) - a(j, j)) + turn.c2 * a(i, j);
  const S sf = turn.s * f;
  result(i, i) = a(i, i) - sf;
  result(j, j) = a(j, j) + sf;
  result(i, j) = turn.c * f - a(i, j);
  result(i, k) = turn.c * a(i, k) - turn.s * a(j, k);
  result(j, k) = turn.s * a(i, k) + turn.c * a(j, k);
  return result;
}

/// R A R^T, A without symmetry: the same identity, k = s (a_ii - a_jj) + c (a_ij + a_ji).
template <class S, class T>
[[nodiscard]] Mat3<S> rotate(const AxisRotation<T>& turn, const Mat3<S>& a) {
  const int k = turn.axis;
  const int i = (k + 1) % 3;
  const int j = (k + 2) % 3;
  Mat3<S> result = a;
  const S f = turn.s * (a[i][i] - a[j][j]) + turn.c * (a[i][j] + a[j][i]);
  const S sf = turn.s * f;
  const S cf = turn.c * f;
  result[i][i] = a[i][i] - sf;
  result[j][j] = a[j][j] + sf;
  result[i][j] = cf - a[j][i];
  result[j][i] = cf - a[i][j];
  result[i][k] = turn.c * a[i][k] - turn.s * a[j][k];
  result[j][k] = turn.s * a[i][k] + turn.c * a[j][k];
  result[k][i] = turn.c * a[k][i] - turn.s * a[k][j];
  result[k][j] = turn.s * a[k][i] + turn.c * a[k][j];
  return result;
}

/// A rotation that does not change, as few turns about axes after a signed permutation:
/// R = turns[0] turns[1] … P.
struct FixedRotation {
  std::vector<AxisRotation<double>> turns;
  std::array<int, 3> from{0, 1, 2};  ///< (P v)[r] = sign[r] v[from[r]]
  std::array<double, 3> sign{1.0, 1.0, 1.0};
};

template <class S>
[[nodiscard]] Vec3<S> permute(const FixedRotation& r, const Vec3<S>& v) {
  Vec3<S> result;
  for (int i = 0; i < 3; ++i) result[i] = r.sign[i] * v[r.from[i]];
  return result;
}
template <class S>
[[nodiscard]] Sym3<S> permute(const FixedRotation& r, const Sym3<S>& a) {
  Sym3<S> result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) result(i, j) = r.sign[i] * r.sign[j] * a(r.from[i], r.from[j]);
  return result;
}
template <class S>
[[nodiscard]] Mat3<S> permute(const FixedRotation& r, const Mat3<S>& a) {
  Mat3<S> result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result[i][j] = r.sign[i] * r.sign[j] * a[r.from[i]][r.from[j]];
  return result;
}

/// R v, R A R^T
template <class X>
[[nodiscard]] X rotate(const FixedRotation& r, const X& x) {
  X result = permute(r, x);
  for (std::size_t i = r.turns.size(); i-- > 0;) result = rotate(r.turns[i], result);
  return result;
}
/// R^T v
template <class S>
[[nodiscard]] Vec3<S> rotate_back(const FixedRotation& r, Vec3<S> v) {
  for (const AxisRotation<double>& turn : r.turns) v = rotate(turn.inverse(), v);
  Vec3<S> result;
  for (int i = 0; i < 3; ++i) result[r.from[i]] = r.sign[i] * v[i];
  return result;
}
/// The axes' images as a matrix.
template <class S>
[[nodiscard]] Mat3<S> matrix(const FixedRotation& r) {
  Mat3<S> result;
  for (int column = 0; column < 3; ++column) {
    Vec3<S> unit{S(0.0), S(0.0), S(0.0)};
    unit[column] = S(1.0);
    const Vec3<S> image = rotate(r, unit);
    for (int row = 0; row < 3; ++row) result[row][column] = image[row];
  }
  return result;
}

/// Moments of a mass distribution about a frame's origin: the mass, the first moment and the
/// second (J = sum m r r^T, not the inertia tensor). Linear in the masses, and any of them may
/// be negative or zero after regrouping.
template <class S>
struct Moments {
  S m = 0.0;
  Vec3<S> h{0.0, 0.0, 0.0};
  Sym3<S> J{{0.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
};

template <class S, class T>
void add_to(Moments<S>& sum, const Moments<T>& part) {
  sum.m += part.m;
  for (int i = 0; i < 3; ++i) sum.h[i] += part.h[i];
  for (int i = 0; i < 6; ++i) sum.J.entry[i] += part.J.entry[i];
}
/// The same masses seen from a frame whose origin lies `-t` along `axis`: r' = r + t e_axis.
template <class S, class T>
void shift(Moments<S>& x, int axis, const T& t) {
  const S old = x.h[axis];
  x.h[axis] += x.m * t;
  x.J(axis, axis) += t * (old + x.h[axis]);
  for (const int other : {(axis + 1) % 3, (axis + 2) % 3}) x.J(axis, other) += t * x.h[other];
}
template <class R, class S>
[[nodiscard]] Moments<S> turned(const R& rotation, const Moments<S>& x) {
  return {x.m, rotate(rotation, x.h), rotate(rotation, x.J)};
}

/// A force and its moment about a frame's origin.
template <class S>
struct Force {
  Vec3<S> f{0.0, 0.0, 0.0};
  Vec3<S> n{0.0, 0.0, 0.0};
};
template <class S>
[[nodiscard]] Force<S> operator+(const Force<S>& a, const Force<S>& b) {
  return {a.f + b.f, a.n + b.n};
}
template <class S>
[[nodiscard]] Force<S> operator-(const Force<S>& a, const Force<S>& b) {
  return {a.f - b.f, a.n - b.n};
}

/// Symmetric 6x6 that maps acceleration to force: [f; n] = [M H; H^T I] [a; alpha].
template <class S>
struct ArticulatedInertia {
  Sym3<S> M;
  Mat3<S> H;
  Sym3<S> I;
};

template <class S, class T>
[[nodiscard]] ArticulatedInertia<S> rigid_inertia(const Moments<T>& x) {
  ArticulatedInertia<S> result;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    result.M(i, i) = x.m;
    result.M(i, j) = S(0.0);
    result.H[i][i] = S(0.0);
    result.H[i][j] = x.h[k];
    result.H[j][i] = -x.h[k];
    result.I(i, i) = x.J(j, j) + x.J(k, k);
    result.I(i, j) = -x.J(i, j);
  }
  return result;
}
template <class S>
void add_to(ArticulatedInertia<S>& sum, const ArticulatedInertia<S>& part) {
  for (int i = 0; i < 6; ++i) sum.M.entry[i] += part.M.entry[i];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum.H[i][j] += part.H[i][j];
  for (int i = 0; i < 6; ++i) sum.I.entry[i] += part.I.entry[i];
}
template <class R, class S>
[[nodiscard]] ArticulatedInertia<S> turned(const R& rotation, const ArticulatedInertia<S>& x) {
  return {rotate(rotation, x.M), rotate(rotation, x.H), rotate(rotation, x.I)};
}
/// Seen from a frame whose origin lies `-t` along `axis`: with T = [t e_axis x],
/// H' = H - M T and I' = I + (T H)^T + T H'.
template <class S, class T>
void shift(ArticulatedInertia<S>& x, int axis, const T& t) {
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  const Mat3<S> old = x.H;
  for (int row = 0; row < 3; ++row) {
    x.H[row][i] -= t * x.M(row, j);
    x.H[row][j] += t * x.M(row, i);
  }
  x.I(axis, i) -= t * old[j][axis];
  x.I(axis, j) += t * old[i][axis];
  x.I(i, i) -= t * (old[j][i] + x.H[j][i]);
  x.I(j, j) += t * (old[i][j] + x.H[i][j]);
  x.I(i, j) += t * (old[i][i] - x.H[j][j]);
}

}  // namespace tandem::model
