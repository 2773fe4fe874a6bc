// The state of an inertial sensor that is carried by standing feet: a contact-aided invariant
// extended Kalman filter, without a robot.
// Layer: estimation.  Thread: made non-RT; the rest RT.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "base/archive.hpp"
#include "base/realtime.hpp"

namespace tandem::estimation {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// The matrix that a cross product from the left is: skew(a) b = a x b.
[[nodiscard]] Mat3 skew(const Vec3& a) noexcept TANDEM_RT;
/// The rotation by the vector `r` [rad].
[[nodiscard]] Mat3 rotation_by(const Vec3& r) noexcept TANDEM_RT;
/// The least rotation from one direction to another; of opposites one of the least. Eigen's
/// FromTwoVectors gives the same bits more than two milliradians off, but compiles a
/// singular value decomposition.
[[nodiscard]] Mat3 shortest_turn(const Vec3& from, const Vec3& to) noexcept TANDEM_RT;

/// Deviations of a sample of the inertial sensor, and per root of a second of what walks.
struct FilterNoise {
  double gyro_rad_s, accelerometer_m_s2;               ///< of one sample
  double gyro_drift_rad_s2, accelerometer_drift_m_s3;  ///< walk of the biases
  double foot_m;                                       ///< of a foot's measured place, each axis
  double foot_slip_m_s;                                ///< walk of a standing foot
};

/// The filter of R. Hartley, M. Ghaffari, R. Eustice, J. Grizzle, "Contact-aided invariant extended
/// Kalman filtering for robot state estimation" (IJRR 2020), which has the states of M. Bloesch et
/// al., "State estimation for legged robots" (RSS 2012): orientation R, velocity v and position p
/// of the inertial sensor in W, the feet's positions d in W, and the biases of gyro and
/// accelerometer.
///
/// The error is right-invariant, xi of X_estimate = exp(xi) X_true over (R, v, p, d), and the
/// biases' difference. It moves by a matrix that does not depend on R, v, p and d but through the
/// biases, and a foot's measured place h (seen from the sensor, in its frame) by
///
///   p + R h - d = xi_p - xi_d + R noise
///
/// so that yaw and position, which nothing measures, stay unobservable in the filter as well.
/// Deviations are the same along all axes, as this needs no turning of them.
class ContactFilter {
 public:
  static constexpr std::size_t kMostFeet = 8;

  /// @param gravity_m_s2  in W
  ContactFilter(std::size_t feet, const FilterNoise& noise, const Vec3& gravity_m_s2,
                double step_s);

  /// Deviations at the start.
  struct Uncertainty {
    double tilt_rad, velocity_m_s, height_m, gyro_bias_rad_s, accelerometer_bias_m_s2;
  };
  /// Starts with this orientation, at rest. Yaw and level position are exact by definition. No foot
  /// stands until touch().
  void start(const Mat3& R, const Vec3& p_m, const Vec3& gyro_bias_rad_s,
             const Uncertainty& uncertainty) noexcept TANDEM_RT;

  /// One step, with what the sensor measured over it.
  /// @param gyro_rad_s, specific_force_m_s2  in the sensor's frame, biases included
  void predict(const Vec3& gyro_rad_s, const Vec3& specific_force_m_s2) noexcept TANDEM_RT;

  /// Foot `foot` begins to stand at `h_m`.
  void touch(std::size_t foot, const Vec3& h_m) noexcept TANDEM_RT;
  /// Corrects by the feet that stand.
  /// @param h_m        of every foot [m], seen from the sensor, in its frame
  /// @param standing   of every foot, not 0: it stands
  void correct(std::span<const Vec3> h_m,
               std::span<const std::uint8_t> standing) noexcept TANDEM_RT;

  [[nodiscard]] const Mat3& R() const noexcept { return R_; }
  [[nodiscard]] const Vec3& v() const noexcept { return v_; }
  [[nodiscard]] const Vec3& p() const noexcept { return p_; }
  [[nodiscard]] const Vec3& foot(std::size_t i) const noexcept { return d_[i]; }
  [[nodiscard]] const Vec3& gyro_bias() const noexcept { return gyro_bias_; }
  [[nodiscard]] const Vec3& accelerometer_bias() const noexcept { return accelerometer_bias_; }
  /// Normalised innovation squared of the last correct(), and its degrees of freedom: on average
  /// they are equal if the noise is as stated.
  [[nodiscard]] double nis() const noexcept { return nis_; }
  [[nodiscard]] int nis_dof() const noexcept { return nis_dof_; }

  /// Where the parts of the error stand in covariance(): three entries each.
  enum Part : int {
    kRotation = 0,
    kVelocity = 3,
    kPosition = 6,
    kGyroBias = 9,
    kAccBias = 12,
    kFeet = 15
  };
  static constexpr int kMost = kFeet + 3 * static_cast<int>(kMostFeet);
  using Matrix =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMost, kMost>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMost, 1>;
  [[nodiscard]] const Matrix& covariance() const noexcept { return P_; }

  void archive(Archive& ar);

 private:
  [[nodiscard]] int foot_at(std::size_t i) const noexcept {
    return kFeet + 3 * static_cast<int>(i);
  }
  void move_covariance() noexcept;
  void add_noise() noexcept;
  void apply(const Vector& error) noexcept;

  FilterNoise noise_;
  Vec3 gravity_;
  double step_s_;
  std::size_t feet_;
  Mat3 R_ = Mat3::Identity();
  Vec3 v_ = Vec3::Zero(), p_ = Vec3::Zero();
  Vec3 gyro_bias_ = Vec3::Zero(), accelerometer_bias_ = Vec3::Zero();
  std::array<Vec3, kMostFeet> d_;
  Matrix P_;
  double nis_ = 0.0;
  int nis_dof_ = 0;
};

}  // namespace tandem::estimation
