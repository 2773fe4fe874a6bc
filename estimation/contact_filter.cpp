// Blocks of three by three: of the transition matrix only those that are neither zero nor identity
// are touched, and feet correct one after another.
#include "estimation/contact_filter.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace tandem::estimation {
namespace {

using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor, ContactFilter::kMost, 3>;

}  // namespace

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

Mat3 shortest_turn(const Vec3& from, const Vec3& to) noexcept TANDEM_RT {
  const Vec3 a = from.normalized(), b = to.normalized();
  const Vec3 across = a.cross(b);
  const double cosine = b.dot(a);
  if (cosine < -1.0 + 1e-6) {  // their sum is rounding, and what is across may be nothing
    const double sine = across.norm();
    const Vec3 axis = sine > 0.0 ? Vec3(across / sine) : a.unitOrthogonal();
    return rotation_by(std::atan2(sine, cosine) * axis);
  }
  const double twice_cos_half = std::sqrt((1.0 + cosine) * 2.0);
  const Vec3 axis = across * (1.0 / twice_cos_half);
  return Eigen::Quaterniond(twice_cos_half * 0.5, axis.x(), axis.y(), axis.z()).toRotationMatrix();
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
  const Vec3 force = specific_force_m_s2 - accelerometer_bias_;
  const Vec3 a = R_ * (force + 0.5 * turn.cross(force)) + gravity_;  // half way through the turn
  p_ += (v_ + 0.5 * step_s_ * a) * step_s_;
  v_ += a * step_s_;
  R_ = R_ * rotation_by(turn);
  // Rounding would take it from the rotations in hours: one step of Newton's method back.
  R_ = 0.5 * R_ * (3.0 * Mat3::Identity() - R_.transpose() * R_);
}

/// P <- F P F^T + Q, F = 1 + A h. A's rows: rotation -R bg; velocity g x rotation - v x R bg - R
/// ba; position velocity - p x R bg; feet -d x R bg. The gyro's noise acts as its bias does, for
/// one step: it is added to the bias' variance, and taken away again where it has moved to.
void ContactFilter::move_covariance() noexcept {
  const double noise = noise_.gyro_rad_s * noise_.gyro_rad_s;
  P_.diagonal().segment<3>(kGyroBias).array() += noise;
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
  P_.diagonal().segment<3>(kGyroBias).array() -= noise;
  const auto uncouple = [&](int at, const Mat3& M) {  // the next step's noise is another one
    P_.block<3, 3>(at, kGyroBias) += noise * M;
    P_.block<3, 3>(kGyroBias, at) += noise * M.transpose();
  };
  uncouple(kRotation, hR);
  uncouple(kVelocity, vR);
  uncouple(kPosition, pR);
  for (std::size_t i = 0; i < feet_; ++i) uncouple(foot_at(i), dR[i]);
}

/// Adds the variances of what walks (biases, feet) and of the accelerometer to P_.
void ContactFilter::add_noise() noexcept {
  const double walk = std::sqrt(step_s_);
  const auto squared = [](double x) { return x * x; };
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
    const int p = kPosition, d = foot_at(i);
    // What is not yet in the state is in `error`.
    const Vec3 z = p_ + R_ * h_m[i] - d_[i] - (error.segment<3>(p) - error.segment<3>(d));
    const Columns PH = P_.middleCols<3>(p) - P_.middleCols<3>(d);
    Mat3 S = PH.middleRows<3>(p) - PH.middleRows<3>(d);
    S.diagonal().array() += variance;
    const Mat3 inverse = S.inverse();
    const Columns K = PH * inverse;
    error += K * z;
    nis_ += z.dot(inverse * z);
    nis_dof_ += 3;
    P_.noalias() -= K.lazyProduct(PH.transpose());
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
