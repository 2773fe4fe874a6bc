// Unit quaternions [x y z w] and 3x3 rotations (row-major) as plain arrays.
// Layer: hal/sim.  Thread: any.
#pragma once

#include <array>
#include <cmath>

namespace tandem::sim {

using Vec3 = std::array<double, 3>;
using Mat3 = std::array<double, 9>;  ///< row-major

[[nodiscard]] inline Vec3 cross(const Vec3& a, const Vec3& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The rotation of quaternion `q` = [x y z w], normalised first: x_W = R x_B.
[[nodiscard]] inline Mat3 rotation_of(const double* q) noexcept {
  const double s = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {1.0 - s * (y * y + z * z), s * (x * y - w * z),       s * (x * z + w * y),
          s * (x * y + w * z),       1.0 - s * (x * x + z * z), s * (y * z - w * x),
          s * (x * z - w * y),       s * (y * z + w * x),       1.0 - s * (x * x + y * y)};
}

/// The quaternion [x y z w] of rotation `R`, with w >= 0 (Shepperd 1978).
[[nodiscard]] inline std::array<double, 4> quaternion_of(const double* R) noexcept {
  const double trace = R[0] + R[4] + R[8];
  std::array<double, 4> q{};
  if (trace >= R[0] && trace >= R[4] && trace >= R[8]) {
    q = {R[7] - R[5], R[2] - R[6], R[3] - R[1], 1.0 + trace};
  } else if (R[0] >= R[4] && R[0] >= R[8]) {
    q = {1.0 + R[0] - R[4] - R[8], R[1] + R[3], R[2] + R[6], R[7] - R[5]};
  } else if (R[4] >= R[8]) {
    q = {R[1] + R[3], 1.0 - R[0] + R[4] - R[8], R[5] + R[7], R[2] - R[6]};
  } else {
    q = {R[2] + R[6], R[5] + R[7], 1.0 - R[0] - R[4] + R[8], R[3] - R[1]};
  }
  double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (q[3] < 0.0) norm = -norm;
  for (double& value : q) value /= norm;
  return q;
}

/// R v
[[nodiscard]] inline Vec3 rotate(const double* R, const double* v) noexcept {
  return {R[0] * v[0] + R[1] * v[1] + R[2] * v[2], R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
          R[6] * v[0] + R[7] * v[1] + R[8] * v[2]};
}

/// R^T v
[[nodiscard]] inline Vec3 rotate_back(const double* R, const double* v) noexcept {
  return {R[0] * v[0] + R[3] * v[1] + R[6] * v[2], R[1] * v[0] + R[4] * v[1] + R[7] * v[2],
          R[2] * v[0] + R[5] * v[1] + R[8] * v[2]};
}

/// a b, the rotation b first.
[[nodiscard]] inline std::array<double, 4> quaternion_product(const double* a,
                                                              const double* b) noexcept {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

inline void normalise_quaternion(double* q) noexcept {
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (int i = 0; i < 4; ++i) q[i] /= norm;
}

/// sin(x) / x and cos(x). Those of what turns in a sub-step are sums of products, so that a run has
/// the same bits with every C library. @param squared  x^2
[[nodiscard]] inline std::array<double, 2> sinc_and_cosine(double squared) noexcept {
  if (squared > 0.0625) {  // x beyond 1/4
    const double x = std::sqrt(squared);
    return {std::sin(x) / x, std::cos(x)};
  }
  // Taylor's series by Horner; what is left out is below 1e-19.
  double sinc = 1.0, cosine = 1.0;
  for (double n = 12.0; n > 0.0; n -= 2.0) {
    sinc = 1.0 - squared * (1.0 / (n * (n + 1.0))) * sinc;
    cosine = 1.0 - squared * (1.0 / (n * (n - 1.0))) * cosine;
  }
  return {sinc, cosine};
}

/// q <- q exp(w h / 2): turned for `h_s` at the constant rate `w`, in the body's own frame.
inline void turn_quaternion(double* q, const double* w, double h_s) noexcept {
  const double half = 0.5 * h_s;
  const auto [sinc, cosine] =
      sinc_and_cosine(half * half * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]));
  const double k = half * sinc;
  const double turn[4] = {k * w[0], k * w[1], k * w[2], cosine};
  const std::array<double, 4> result = quaternion_product(q, turn);
  for (int i = 0; i < 4; ++i) q[i] = result[static_cast<std::size_t>(i)];
  normalise_quaternion(q);
}

}  // namespace tandem::sim
