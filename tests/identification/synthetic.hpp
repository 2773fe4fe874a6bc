// Recordings of a robot that follows a series exactly, made from inverse dynamics of its kernels'
// algorithms: no simulator, so that every error in them is known.
// Layer: tests.  Thread: one.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "identification/recording.hpp"
#include "identification/series.hpp"
#include "model/dynamics.hpp"
#include "model/urdf.hpp"

namespace tandem::identification {

/// What the recorded robot has besides its links, and its sensors' errors.
struct Reality {
  std::vector<double> rotor_kg_m2, viscous_Nms_rad, coulomb_Nm, offset_Nm;  ///< per joint
  double torque_noise_Nm = 0.0;
  double torque_quantum_Nm = 0.0;
  double position_quantum_rad = 0.0;
  double duration_s = 30.0;
};

/// A fixed base; joints of the tree in the configuration's order.
inline Recording synthetic_recording(const model::Tree& tree, const ExcitingSeries& series,
                                     const Reality& reality, std::uint64_t seed) {
  constexpr double kPeriod_s = 2e-3;
  const auto mechanism = model::make_mechanism(tree, {});
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto n = static_cast<std::size_t>(series.start.size());
  Recording r;
  r.path = "synthetic";
  r.period_s = kPeriod_s;
  for (std::vector<Signal>* signals :
       {&r.position_rad, &r.torque_Nm, &r.motor_position_rad, &r.current_A, &r.reference_rad})
    signals->assign(n, {});
  const auto rounded = [](double value, double quantum) {
    return quantum > 0.0 ? quantum * std::round(value / quantum) : value;
  };
  for (int k = 0; k * kPeriod_s < reality.duration_s; ++k) {
    const double t = k * kPeriod_s;
    r.time_s.push_back(t);
    const ExcitingSeries::State now = series.at(t);
    const std::vector<double> q(now.x.begin(), now.x.end()), v(now.v.begin(), now.v.end()),
        a(now.acceleration.begin(), now.acceleration.end());
    const auto tau =
        model::evaluate_kernel(model::Kernel::kInverseDynamics, *mechanism, {q, v, a, {}});
    for (std::size_t j = 0; j < n; ++j) {
      double torque = tau[0][j];
      if (!reality.rotor_kg_m2.empty()) torque += reality.rotor_kg_m2[j] * a[j];
      if (!reality.viscous_Nms_rad.empty()) torque += reality.viscous_Nms_rad[j] * v[j];
      if (!reality.coulomb_Nm.empty()) torque += reality.coulomb_Nm[j] * std::tanh(v[j] / 0.01);
      if (!reality.offset_Nm.empty()) torque += reality.offset_Nm[j];
      torque += reality.torque_noise_Nm * normal(random);
      r.torque_Nm[j].push_back(rounded(torque, reality.torque_quantum_Nm));
      r.position_rad[j].push_back(rounded(q[j], reality.position_quantum_rad));
      r.reference_rad[j].push_back(q[j]);
      r.motor_position_rad[j].push_back(q[j]);
      r.current_A[j].push_back(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return r;
}

/// The bundled arm, its fingers locked.
struct Arm {
  hal::RobotConfig robot;
  model::Tree tree;
};
inline Arm arm(const std::string& name) {
  const std::string folder = TANDEM_SOURCE_DIR "/config/" + name + "/";
  auto robot = hal::read_robot_config(folder + "robot.toml");
  if (!robot) throw std::runtime_error(robot.error().front().to_string());
  auto description = model::read_urdf(
      robot->model.urdf, {.floating_base = robot->model.floating_base, .lock = robot->model.lock});
  if (!description) throw std::runtime_error(description.error().front().to_string());
  for (hal::JointConfig& joint : robot->joints) {
    const int index = description->tree.joint_index(joint.name);
    const model::Joint& limits = description->tree.joints[static_cast<std::size_t>(index)];
    if (std::isnan(joint.min_position_rad)) joint.min_position_rad = limits.lower;
    if (std::isnan(joint.max_position_rad)) joint.max_position_rad = limits.upper;
    if (std::isnan(joint.max_velocity_rad_s)) joint.max_velocity_rad_s = limits.velocity;
    if (std::isnan(joint.max_torque_Nm)) joint.max_torque_Nm = limits.effort;
  }
  return {std::move(*robot), std::move(description->tree)};
}

/// All joints move, about a radian.
inline ExcitingSeries wide_series(const Arm& arm, std::uint64_t seed) {
  const auto n = static_cast<Eigen::Index>(arm.robot.joints.size());
  ExcitingSeries series = random_series(Eigen::VectorXd::Zero(n), 5, 10.0, seed);
  series.a *= 0.8;
  series.b *= 0.8;
  return series;
}

}  // namespace tandem::identification
