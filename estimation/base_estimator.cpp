// The kernels place IMU and feet relative to the base; the filter knows the IMU and the feet alone.
#include "estimation/base_estimator.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/quoting.hpp"

namespace tandem::estimation {
namespace {

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using ConstMat3 = Eigen::Map<const RowMajor3>;
using ConstVec3 = Eigen::Map<const Vec3>;

constexpr double kStill_rad_s = 0.1;      // turning faster is no rest
constexpr double kStill_m_s2 = 0.5;       // nor is a force that is not the weight's
constexpr double kSteepness = 5.0;        // of the contact's probability: 0.99 at twice the force
constexpr double kStands = 0.5;           // likely enough
constexpr double kStartHeight_m = 0.005;  // deviations at the start
constexpr double kStartVelocity_m_s = 0.02;

}  // namespace

BaseEstimator::BaseEstimator(const tandem_kernels& kernels, const ModelJoints& joints,
                             const BaseConfig& config, FootSensors feet, std::size_t imu_sensor,
                             std::size_t imu_site, double step_s)
    : kernels_(&kernels),
      sines_(kernels),
      joints_(joints),
      config_(config),
      feet_(std::move(feet)),
      imu_sensor_(imu_sensor),
      imu_site_(imu_site),
      step_s_(step_s),
      filter_(feet_.feet(),
              {config.gyro_noise_rad_s, config.accelerometer_noise_m_s2, config.gyro_drift_rad_s2,
               config.accelerometer_drift_m_s3, config.foot_noise_m, config.foot_slip_m_s},
              Vec3(kernels.gravity_m_s2), step_s),
      q_(kernels.nq),
      v_(kernels.nv),
      pose_(12 * kernels.sites),
      twist_(6 * kernels.sites),
      h_(feet_.feet(), Vec3::Zero()),
      ground_(feet_.feet(), Wrench::Zero()),
      probability_(feet_.feet()),
      standing_(feet_.feet()) {
  q_[6] = 1.0;
  if (!(config_.contact_force_N > 0.0)) {
    config_.contact_force_N = 0.1 * kernels.mass_kg * Vec3(kernels.gravity_m_s2).norm();
  }
}

Result<std::size_t> BaseEstimator::find_imu(const hal::Robot& robot, const BaseConfig& config) {
  if (!robot.floating_base) {
    return fail("the robot's base does not move: there is nothing to estimate",
                "leave [estimation.base] out");
  }
  std::vector<std::size_t> imus;
  for (std::size_t s = 0; s < robot.sensors.size(); ++s) {
    const bool named = config.imu.empty() || robot.sensors[s].name == config.imu;
    if (robot.sensors[s].type == hal::SensorType::kImu && named) imus.push_back(s);
  }
  if (imus.empty()) {
    return fail(
        config.imu.empty() ? "the robot has no IMU" : "the robot has no IMU '" + config.imu + "'",
        "declare a [[sensor]] of type \"imu\" in " + robot.file);
  }
  if (imus.size() > 1) {
    std::string names;
    for (const std::size_t s : imus) names += (names.empty() ? "" : ", ") + robot.sensors[s].name;
    return fail("the robot has several IMUs", "say which one: imu = \"…\", of " + names);
  }
  return imus.front();
}

Result<BaseEstimator> BaseEstimator::make(const hal::Robot& robot, const tandem_kernels& kernels,
                                          const ModelJoints& joints, const BaseConfig& config,
                                          double step_s) {
  const auto found = find_imu(robot, config);
  if (!found) return std::unexpected(found.error());
  const hal::Sensor& imu = robot.sensors[*found];
  const int site = imu_site(robot, imu, kernels);
  if (site < 0) {
    return fail("the robot's kernels have no site for the IMU '" + imu.name + "'",
                "run `tandem model build " + shell_word(robot.file) + "`");
  }
  auto feet = FootSensors::make(robot, kernels);
  if (!feet) return std::unexpected(feet.error());
  if (feet->feet() > ContactFilter::kMostFeet) {
    return fail("the base's estimate has room for " + std::to_string(ContactFilter::kMostFeet) +
                " feet, the robot has " + std::to_string(feet->feet()));
  }
  return BaseEstimator(kernels, joints, config, std::move(*feet), *found,
                       static_cast<std::size_t>(site), step_s);
}

void BaseEstimator::update(const hal::StateImage& state,
                           hal::EstimateImage& out) noexcept TANDEM_RT {
  see_feet(state);
  const auto values = state.sensor_values(imu_sensor_);
  const Sample sample{ConstVec3(values.data() + 4), ConstVec3(values.data() + 7)};
  if (!sample.gyro.allFinite() || !sample.force.allFinite()) return;  // the last estimate stays
  const Mat3 R = started() ? filter_.R() : shortest_turn(sample.force, Vec3::UnitZ());
  weigh_feet(state, R);
  if (started()) {
    step(sample);
  } else {
    rest(sample);
  }
  last_ = sample;
  write(sample, out);
}

/// Where the feet are, seen from the IMU.
void BaseEstimator::see_feet(const hal::StateImage& state) noexcept {
  joints_.to_model(state.position_rad(), q_.data() + 7);
  joints_.to_model(state.velocity_rad_s(), v_.data() + 6);
  sines_.take(q_.data());
  kernels_->site_twists_at(sines(), q_.data(), v_.data(), pose_.data(), twist_.data());
  const double* imu = pose_.data() + 12 * imu_site_;
  for (std::size_t i = 0; i < h_.size(); ++i) {
    const ConstVec3 foot(pose_.data() + 12 * feet_.site(i) + 9);
    h_[i] = ConstMat3(imu).transpose() * (foot - ConstVec3(imu + 9));
  }
}

/// The ground's wrenches, and how likely each foot stands.
/// @param R_imu  the IMU's orientation, but for its yaw
void BaseEstimator::weigh_feet(const hal::StateImage& state, const Mat3& R_imu) noexcept {
  const Vec3 down_base =
      ConstMat3(pose_.data() + 12 * imu_site_) * (R_imu.transpose() * Vec3(kernels_->gravity_m_s2));
  for (std::size_t i = 0; i < h_.size(); ++i) {
    const ConstMat3 R_foot(pose_.data() + 12 * feet_.site(i));
    const Vec3 gravity = R_foot.transpose() * down_base;
    ground_[i] = feet_.ground(i, state, gravity);
    const double up_N = -ground_[i].head<3>().dot(gravity.normalized());
    const double ratio = up_N / config_.contact_force_N - 1.0;
    probability_[i] = 1.0 / (1.0 + std::exp(-kSteepness * std::clamp(ratio, -50.0, 50.0)));
    if (!std::isfinite(probability_[i])) probability_[i] = 0.0;
  }
}

/// Gathers samples of a robot that stands still; with enough of them the estimate starts.
void BaseEstimator::rest(const Sample& sample) noexcept {
  const double gravity = Vec3(kernels_->gravity_m_s2).norm();
  const bool stands = std::ranges::any_of(probability_, [](double p) { return p > kStands; });
  const bool still =
      sample.gyro.norm() < kStill_rad_s && std::abs(sample.force.norm() - gravity) < kStill_m_s2;
  if (!stands || !still) {
    rested_ = 0;
    force_sum_.setZero();
    gyro_sum_.setZero();
    return;
  }
  force_sum_ += sample.force;
  gyro_sum_ += sample.gyro;
  ++rested_;
  if (static_cast<double>(rested_) * step_s_ < config_.rest_s) return;
  const auto n = static_cast<double>(rested_);
  // The base's x axis is forward at the start: W's yaw is chosen for that.
  const Mat3 tilt = shortest_turn(force_sum_, Vec3::UnitZ());
  const ConstMat3 R_base_imu(pose_.data() + 12 * imu_site_);
  const Vec3 forward = tilt * R_base_imu.transpose() * Vec3::UnitX();
  const Mat3 R = rotation_by({0.0, 0.0, -std::atan2(forward.y(), forward.x())}) * tilt;
  const Mat3 R_base = R * R_base_imu.transpose();
  double height = 0.0, feet = 0.0;
  for (std::size_t i = 0; i < h_.size(); ++i) {
    if (probability_[i] <= kStands) continue;
    height -= (R * h_[i]).z();
    feet += 1.0;
  }
  Vec3 p = R_base * ConstVec3(pose_.data() + 12 * imu_site_ + 9);  // the base at x = y = 0
  p.z() = height / feet;
  const double deviation = config_.accelerometer_bias_m_s2 / gravity +
                           config_.accelerometer_noise_m_s2 / gravity / std::sqrt(n);
  filter_.start(R, p, gyro_sum_ / n,
                {deviation, kStartVelocity_m_s, kStartHeight_m,
                 config_.gyro_noise_rad_s / std::sqrt(n) + 0.1 * config_.gyro_bias_rad_s,
                 config_.accelerometer_bias_m_s2});
  std::ranges::fill(standing_, std::uint8_t{0});
  for (std::size_t i = 0; i < h_.size(); ++i) {
    if (probability_[i] <= kStands) continue;
    filter_.touch(i, h_[i]);
    standing_[i] = 1;
  }
  started_ = 1;
}

/// Over the period that ends now both samples count half.
void BaseEstimator::step(const Sample& sample) noexcept {
  filter_.predict(0.5 * (last_.gyro + sample.gyro), 0.5 * (last_.force + sample.force));
  for (std::size_t i = 0; i < h_.size(); ++i) {
    const std::uint8_t stands = probability_[i] > kStands ? 1 : 0;
    if (stands != 0 && standing_[i] == 0) filter_.touch(i, h_[i]);
    standing_[i] = stands;
  }
  filter_.correct(h_, standing_);
}

/// From the IMU to the base: the joints between the two may move.
void BaseEstimator::write(const Sample& sample, hal::EstimateImage& out) noexcept {
  out.base_valid()[0] = started_;
  std::ranges::copy(probability_, out.contact_probability().begin());
  if (!started()) {
    out.base_quaternion()[3] = 1.0;
    return;
  }
  const double* imu = pose_.data() + 12 * imu_site_;
  const ConstMat3 R_base_imu(imu);
  const ConstVec3 p_base_imu(imu + 9), v_rel(twist_.data() + 6 * imu_site_);
  const ConstVec3 w_rel(twist_.data() + 6 * imu_site_ + 3);
  const Mat3 R = filter_.R() * R_base_imu.transpose();
  const Vec3 w = R_base_imu * (sample.gyro - filter_.gyro_bias()) - w_rel;  // in the base's frame
  const Vec3 v = R.transpose() * filter_.v() - v_rel - w.cross(p_base_imu);
  const Vec3 p = filter_.p() - R * p_base_imu;
  const Eigen::Quaterniond q(R);
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  std::copy_n(p.data(), 3, out.base_position_m().begin());
  for (int i = 0; i < 4; ++i)
    out.base_quaternion()[static_cast<std::size_t>(i)] = sign * q.coeffs()[i];
  std::copy_n(v.data(), 3, out.base_velocity().begin());
  std::copy_n(w.data(), 3, out.base_velocity().begin() + 3);
  for (int i = 0; i < 9; ++i)
    out.base_deviation()[static_cast<std::size_t>(i)] =
        std::sqrt(std::max(0.0, filter_.covariance()(i, i)));
  std::copy_n(filter_.gyro_bias().data(), 3, out.gyro_bias_rad_s().begin());
  std::copy_n(filter_.accelerometer_bias().data(), 3, out.accelerometer_bias_m_s2().begin());
  out.innovation()[0] = filter_.nis_dof() == 0 ? 0.0 : filter_.nis() / filter_.nis_dof();
  for (std::size_t i = 0; i < h_.size(); ++i) {
    const ConstMat3 R_foot(pose_.data() + 12 * feet_.site(i));
    const Vec3 force = R * (R_foot * ground_[i].head<3>());
    const Vec3 moment = R * (R_foot * ground_[i].tail<3>());
    std::copy_n(force.data(), 3, out.foot_force_N().begin() + static_cast<std::ptrdiff_t>(3 * i));
    std::copy_n(moment.data(), 3,
                out.foot_moment_Nm().begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
}

void BaseEstimator::archive(Archive& ar) {
  filter_.archive(ar);
  for (Vec3* one : {&last_.gyro, &last_.force, &force_sum_, &gyro_sum_})
    ar.raw(one->data(), sizeof(double) * 3);
  ar(probability_, standing_, rested_, started_);
}

}  // namespace tandem::estimation
