// Where the floating base is and how it moves, from IMU, encoders and the feet's force sensors.
// Layer: estimation.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstdint>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "estimation/config.hpp"
#include "estimation/contact_filter.hpp"
#include "estimation/foot_sensors.hpp"
#include "estimation/robot_model.hpp"
#include "hal/estimate.hpp"
#include "model/sines.hpp"

namespace tandem::estimation {

/// A ContactFilter at the robot's IMU, fed by its images. It starts by itself when the robot has
/// stood still on its feet for `rest_s`: orientation from the accelerometer, gyro bias from the
/// gyro, height from the feet, which are at 0 then.
///
/// A foot stands when the vertical force on it, by its sensor less the foot's weight, makes that
/// likely: a logistic curve around `contact_force_N`. Its place is corrected for as long; when it
/// touches down again its place is new.
class BaseEstimator {
 public:
  /// Index of the sensor that the estimate rests on; needs no kernels.
  /// Errors, each with the missing thing's name: the base does not float; no IMU, several and none
  /// named.
  [[nodiscard]] static Result<std::size_t> find_imu(const hal::Robot& robot,
                                                    const BaseConfig& config);
  /// Errors: find_imu()'s; an IMU where the model has no site; FootSensors::make()'s.
  [[nodiscard]] static Result<BaseEstimator> make(const hal::Robot& robot,
                                                  const tandem_kernels& kernels,
                                                  const ModelJoints& joints,
                                                  const BaseConfig& config, double step_s);

  /// One cycle: fills the base's and the feet's fields.
  void update(const hal::StateImage& state, hal::EstimateImage& out) noexcept TANDEM_RT;

  /// For the kernels' _at forms at the joints' positions of the last update().
  [[nodiscard]] const double* sines() const noexcept { return sines_.data(); }
  [[nodiscard]] bool started() const noexcept { return started_ != 0; }
  [[nodiscard]] const ContactFilter& filter() const noexcept { return filter_; }
  [[nodiscard]] const FootSensors& feet() const noexcept { return feet_; }
  /// The ground on a foot, about its site, in the site's frame: of the last update().
  [[nodiscard]] const Wrench& ground(std::size_t foot) const noexcept { return ground_[foot]; }
  void archive(Archive& ar);

 private:
  BaseEstimator(const tandem_kernels& kernels, const ModelJoints& joints, const BaseConfig& config,
                FootSensors feet, std::size_t imu_sensor, std::size_t imu_site, double step_s);

  struct Sample {
    Vec3 gyro = Vec3::Zero(), force = Vec3::Zero();
  };
  void see_feet(const hal::StateImage& state) noexcept;
  void weigh_feet(const hal::StateImage& state, const Mat3& R_imu) noexcept;
  void rest(const Sample& sample) noexcept;
  void step(const Sample& sample) noexcept;
  void write(const Sample& sample, hal::EstimateImage& out) noexcept;

  const tandem_kernels* kernels_;
  model::Sines sines_;
  ModelJoints joints_;
  BaseConfig config_;
  FootSensors feet_;
  std::size_t imu_sensor_, imu_site_;
  double step_s_;
  ContactFilter filter_;
  std::vector<double> q_, v_, pose_, twist_;  // with the base at W's origin
  std::vector<Vec3> h_;                       // of each foot from the IMU, in its frame
  std::vector<Wrench> ground_;
  std::vector<double> probability_;
  std::vector<std::uint8_t> standing_;
  Sample last_;
  Vec3 force_sum_ = Vec3::Zero(), gyro_sum_ = Vec3::Zero();  // at rest
  std::uint64_t rested_ = 0;
  std::uint8_t started_ = 0;
};

}  // namespace tandem::estimation
