// Blocks of three by three: of the transition matrix only those that are neither zero nor identity
// are touched, and each foot corrects by three scalars one after another.
#include "estimation/contact_filter.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tandem::estimation {

Mat3 skew(const Vec3& a) noexcept TANDEM_RT {
  Mat3 m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

Mat3 rotation_by(const Vec3& r) noexcept TANDEM_RT {
  const double angle2 = r.squaredNorm();
  const Mat3 K = skew(r);
  double a = 1.0 - angle2 / 6.0, b = 0.5 - angle2 / 24.0;  // to the last bit below 1e-4
  if (angle2 > 1e-8) {
    const double angle = std::sqrt(angle2);
    a = std::sin(angle) / angle;
    b = (1.0 - std::cos(angle)) / angle2;
  }
  return Mat3::Identity() + a * K + b * (K * K);
}

ContactFilter::ContactFilter(std::size_t feet, const FilterNoise& noise, const Vec3& gravity_m_s2,
                             double step_s)
    : noise_(noise),
      gravity_(gravity_m_s2),
      step_s_(step_s),
      feet_(std::min(feet, kMostFeet)),
      P_(Matrix::Zero(kFeet + 3 * static_cast<int>(feet_), kFeet + 3 * static_cast<int>(feet_))) {
  d_.fill(Vec3::Zero());
}

void ContactFilter::start(const Mat3& R, const Vec3& p_m, const Vec3& gyro_bias_rad_s,
                          const Uncertainty& u) noexcept TANDEM_RT {
  R_ = R;
  p_ = p_m;
  v_.setZero();
  gyro_bias_ = gyro_bias_rad_s;
  accelerometer_bias_.setZero();
  d_.fill(p_);
  P_.setZero();
  const auto set = [&](int at, const Vec3& deviation) {
    P_.diagonal().segment<3>(at) = deviation.cwiseAbs2();
  };
  set(kRotation, {u.tilt_rad, u.tilt_rad, 1e-6});
  set(kVelocity, Vec3::Constant(u.velocity_m_s));
  set(kPosition, {1e-6, 1e-6, u.height_m});
  set(kGyroBias, Vec3::Constant(u.gyro_bias_rad_s));
  set(kAccBias, Vec3::Constant(u.accelerometer_bias_m_s2));
  nis_ = 0.0;
  nis_dof_ = 0;
}

void ContactFilter::predict(const Vec3& gyro_rad_s,
                            const Vec3& specific_force_m_s2) noexcept TANDEM_RT {
  move_covariance();
  add_noise();
  const Vec3 turn = (gyro_rad_s - gyro_bias_) * step_s_;
  const Vec3 a =
      R_ * rotation_by(0.5 * turn) * (specific_force_m_s2 - accelerometer_bias_) + gravity_;
  p_ += (v_ + 0.5 * step_s_ * a) * step_s_;
  v_ += a * step_s_;
  R_ = R_ * rotation_by(turn);
  // Rounding would take it from the rotations in hours: one step of Newton's method back.
  R_ = 0.5 * R_ * (3.0 * Mat3::Identity() - R_.transpose() * R_);
}

/// P <- F P F^T, F = 1 + A h. A's rows: rotation -R bg; velocity g x rotation - v x R bg - R ba;
/// position velocity - p x R bg; feet -d x R bg.
void ContactFilter::move_covariance() noexcept {
  const Mat3 hR = step_s_ * R_;
  const Mat3 hg = step_s_ * skew(gravity_);
  const Mat3 vR = skew(v_) * hR, pR = skew(p_) * hR;
  std::array<Mat3, kMostFeet> dR;
  for (std::size_t i = 0; i < feet_; ++i) dR[i] = skew(d_[i]) * hR;
  // Each row is made of others that have not been changed yet; then the columns alike.
  const auto rows = [this](int at) { return P_.middleRows<3>(at); };
  rows(kPosition) += step_s_ * rows(kVelocity);
  rows(kPosition).noalias() -= pR * rows(kGyroBias);
  rows(kVelocity).noalias() += hg * rows(kRotation);
  rows(kVelocity).noalias() -= vR * rows(kGyroBias);
  rows(kVelocity).noalias() -= hR * rows(kAccBias);
  for (std::size_t i = 0; i < feet_; ++i) rows(foot_at(i)).noalias() -= dR[i] * rows(kGyroBias);
  rows(kRotation).noalias() -= hR * rows(kGyroBias);
  const auto columns = [this](int at) { return P_.middleCols<3>(at); };
  columns(kPosition) += step_s_ * columns(kVelocity);
  columns(kPosition).noalias() -= columns(kGyroBias) * pR.transpose();
  columns(kVelocity).noalias() += columns(kRotation) * hg.transpose();
  columns(kVelocity).noalias() -= columns(kGyroBias) * vR.transpose();
  columns(kVelocity).noalias() -= columns(kAccBias) * hR.transpose();
  for (std::size_t i = 0; i < feet_; ++i)
    columns(foot_at(i)).noalias() -= columns(kGyroBias) * dR[i].transpose();
  columns(kRotation).noalias() -= columns(kGyroBias) * hR.transpose();
}

/// The gyro's noise turns v, p and d about W's origin; that of the accelerometer moves v alone.
void ContactFilter::add_noise() noexcept {
  const double gyro = noise_.gyro_rad_s * step_s_;
  const double walk = std::sqrt(step_s_);
  const auto squared = [](double x) { return x * x; };
  const double q = squared(gyro);
  std::array<Mat3, 3 + kMostFeet> turned;
  std::array<int, 3 + kMostFeet> at{kRotation, kVelocity, kPosition};
  turned[0] = Mat3::Identity();
  turned[1] = skew(v_);
  turned[2] = skew(p_);
  for (std::size_t i = 0; i < feet_; ++i) {
    turned[3 + i] = skew(d_[i]);
    at[3 + i] = foot_at(i);
  }
  for (std::size_t a = 0; a < 3 + feet_; ++a)
    for (std::size_t b = 0; b < 3 + feet_; ++b)
      P_.block<3, 3>(at[a], at[b]).noalias() += q * turned[a] * turned[b].transpose();
  const auto add = [&](int part, double variance) {
    P_.diagonal().segment<3>(part).array() += variance;
  };
  add(kVelocity, squared(noise_.accelerometer_m_s2 * step_s_));
  add(kGyroBias, squared(noise_.gyro_drift_rad_s2 * walk));
  add(kAccBias, squared(noise_.accelerometer_drift_m_s3 * walk));
  for (std::size_t i = 0; i < feet_; ++i) add(foot_at(i), squared(noise_.foot_slip_m_s * walk));
}

void ContactFilter::touch(std::size_t foot, const Vec3& h_m) noexcept TANDEM_RT {
  const int at = foot_at(foot);
  d_[foot] = p_ + R_ * h_m;
  P_.middleRows<3>(at) = P_.middleRows<3>(kPosition).eval();
  P_.middleCols<3>(at) = P_.middleCols<3>(kPosition).eval();
  P_.block<3, 3>(at, at) = P_.block<3, 3>(kPosition, kPosition).eval();
  P_.diagonal().segment<3>(at).array() += noise_.foot_m * noise_.foot_m;
}

void ContactFilter::correct(std::span<const Vec3> h_m,
                            std::span<const std::uint8_t> standing) noexcept TANDEM_RT {
  Vector error = Vector::Zero(P_.rows());
  const double variance = noise_.foot_m * noise_.foot_m;
  nis_ = 0.0;
  nis_dof_ = 0;
  for (std::size_t i = 0; i < feet_; ++i) {
    if (standing[i] == 0) continue;
    const Vec3 z = p_ + R_ * h_m[i] - d_[i];
    for (int axis = 0; axis < 3; ++axis) {
      const int p = kPosition + axis, d = foot_at(i) + axis;
      const Vector Ph = P_.row(p).transpose() - P_.row(d).transpose();
      const double S = Ph[p] - Ph[d] + variance;
      const double rest = z[axis] - (error[p] - error[d]);
      error += Ph * (rest / S);
      nis_ += rest * rest / S;
      ++nis_dof_;
      const double weight = 1.0 / S;
      for (Eigen::Index row = 0; row < P_.rows(); ++row)
        P_.row(row) -= (weight * Ph[row]) * Ph.transpose();
    }
  }
  if (nis_dof_ == 0) return;
  P_ = (0.5 * (P_ + P_.transpose())).eval();  // rounding alone makes them differ
  apply(error);
}

/// X <- exp(-xi) X, and the biases less their error. The left Jacobian of so(3) turns v, p and d.
void ContactFilter::apply(const Vector& error) noexcept {
  const Vec3 r = -error.segment<3>(kRotation);
  const Mat3 E = rotation_by(r);
  const Mat3 K = skew(r);
  const Mat3 J = Mat3::Identity() + 0.5 * K + (1.0 / 6.0) * (K * K);  // corrections are small
  R_ = E * R_;
  v_ = E * v_ - J * error.segment<3>(kVelocity);
  p_ = E * p_ - J * error.segment<3>(kPosition);
  for (std::size_t i = 0; i < feet_; ++i) d_[i] = E * d_[i] - J * error.segment<3>(foot_at(i));
  gyro_bias_ -= error.segment<3>(kGyroBias);
  accelerometer_bias_ -= error.segment<3>(kAccBias);
}

void ContactFilter::archive(Archive& ar) {
  ar.raw(R_.data(), sizeof(double) * 9);
  for (Vec3* one : {&v_, &p_, &gyro_bias_, &accelerometer_bias_})
    ar.raw(one->data(), sizeof(double) * 3);
  for (Vec3& foot : d_) ar.raw(foot.data(), sizeof(double) * 3);
  ar.raw(P_.data(), sizeof(double) * static_cast<std::size_t>(P_.size()));
  ar(nis_, nis_dof_);
}

}  // namespace tandem::estimation
