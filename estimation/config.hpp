// What is estimated of a robot, and how: [estimation] of an experiment. Plain data.
// docs/estimation.md documents each key.
// Layer: estimation.  Thread: non-RT.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/stop_category.hpp"

namespace tandem::estimation {

/// [estimation.base]. Standard deviations are of one sample, as robot.toml's `noise`.
struct BaseConfig {
  std::string imu;  ///< sensor; empty: the robot's only one
  double gyro_noise_rad_s = 0.002;
  double accelerometer_noise_m_s2 = 0.05;
  double gyro_drift_rad_s2 = 1e-4;         ///< random walk, per root of a second
  double accelerometer_drift_m_s3 = 1e-3;  ///< random walk, per root of a second
  double gyro_bias_rad_s = 0.01;           ///< standard deviation at the start
  double accelerometer_bias_m_s2 = 0.1;    ///< the same
  double foot_noise_m = 0.001;             ///< of a foot's place seen from the IMU, by encoders
  double foot_slip_m_s = 0.005;            ///< random walk of a standing foot, per root of a second
  double contact_force_N = 0.0;  ///< at which a foot stands as likely as not; 0: weight / 10
  double rest_s = 0.25;          ///< at rest on its feet before the estimate starts
};

/// [estimation.observer]
struct ObserverConfig {
  double bandwidth_Hz = 15.0;  ///< of the external torques: a low pass of second order
};

/// [estimation.collision]
struct CollisionConfig {
  struct Threshold {
    std::string joint;
    double torque_Nm = 0.0;
  };
  std::vector<Threshold> thresholds;  ///< of joints and kBaseChannels; what has none is not watched
  hal::StopCategory reaction = hal::StopCategory::kWarn;
};

/// [[estimation.wrench]]
struct WrenchConfig {
  std::string site;  ///< of robot.toml
};

/// [estimation]
struct EstimationConfig {
  std::optional<BaseConfig> base = std::nullopt;
  std::optional<ObserverConfig> observer = std::nullopt;
  std::optional<CollisionConfig> collision = std::nullopt;
  std::vector<WrenchConfig> wrenches = {};  ///< in the image's order

  [[nodiscard]] std::vector<std::string> wrench_sites() const {
    std::vector<std::string> sites;
    for (const WrenchConfig& wrench : wrenches) sites.push_back(wrench.site);
    return sites;
  }
  [[nodiscard]] bool any() const { return base || observer || collision || !wrenches.empty(); }
};

}  // namespace tandem::estimation
