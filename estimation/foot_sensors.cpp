// Reads the constant matrices between sensors and soles off the kernels, with unit wrenches and the
// base turned three ways.
#include "estimation/foot_sensors.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "estimation/robot_model.hpp"

namespace tandem::estimation {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// The kernels at rest, at postures of choice.
class Probe {
 public:
  explicit Probe(const tandem_kernels& kernels)
      : k_(kernels), q_(k_.nq), rest_(k_.nv), wrench_(6 * k_.wrenches), out_(6 * k_.sensors) {
    turn({0.0, 0.0, 0.0, 1.0});
  }
  void turn(const std::array<double, 4>& quaternion) {
    for (std::size_t i = 0; i < 4; ++i) q_[3 + i] = quaternion[i];
  }
  void bend(double rad) {
    for (std::size_t i = 7; i < q_.size(); ++i) q_[i] = rad;
  }
  Wrench reading(std::size_t sensor) {
    k_.sensor_wrenches(q_.data(), rest_.data(), rest_.data(), wrench_.data(), out_.data());
    return Eigen::Map<const Wrench>(out_.data() + 6 * sensor);
  }
  // A: what a unit of each component at wrench site `site` adds.
  Matrix6 response(std::size_t sensor, std::size_t site) {
    const Wrench none = reading(sensor);
    Matrix6 A;
    for (std::size_t i = 0; i < 6; ++i) {
      wrench_[6 * site + i] = 1.0;
      A.col(static_cast<int>(i)) = reading(sensor) - none;
      wrench_[6 * site + i] = 0.0;
    }
    return A;
  }
  // Gravity in a site's frame.
  Eigen::Vector3d gravity(std::size_t site) {
    std::vector<double> pose(12 * k_.sites), twist(6 * k_.sites), acceleration(6 * k_.sites);
    k_.site_motion(q_.data(), rest_.data(), rest_.data(), pose.data(), twist.data(),
                   acceleration.data());
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(pose.data() + 12 * site);
    return R.transpose() * Eigen::Vector3d(k_.gravity_m_s2);
  }

 private:
  const tandem_kernels& k_;
  std::vector<double> q_, rest_, wrench_, out_;
};

// All of a wrench passes: forces keep their length.
bool carries(const Matrix6& A) {
  for (int i = 0; i < 3; ++i)
    if (std::abs(A.col(i).head<3>().norm() - 1.0) > 1e-6) return false;
  return true;
}

std::unexpected<Error> lacks_sensor(const hal::Robot& robot, const hal::Foot& foot,
                                    const char* where) {
  return fail("the foot '" + foot.site + "' has no force/torque sensor " + where,
              "add a [[sensor]] of type \"force_torque\" to " + robot.file +
                  ", or leave [estimation.base] out");
}

}  // namespace

Status FootSensors::check(const hal::Robot& robot) {
  if (robot.feet.empty()) {
    return fail("the robot has no feet: nothing carries its base's estimate",
                "declare [[contact.foot]] in " + robot.file + ", or leave [estimation.base] out");
  }
  if (std::ranges::find(robot.sensors, hal::SensorType::kForceTorque, &hal::Sensor::type) ==
      robot.sensors.end()) {
    return lacks_sensor(robot, robot.feet.front(), "above it");
  }
  return {};
}

Result<FootSensors> FootSensors::make(const hal::Robot& robot, const tandem_kernels& kernels) {
  if (Status feet = check(robot); !feet) return std::unexpected(feet.error());
  FootSensors feet;
  Probe probe(kernels);
  for (const hal::Foot& declared : robot.feet) {
    SensedFoot foot;
    foot.site = static_cast<std::size_t>(
        index_of(kernels.site_names, kernels.sites, declared.site));  // the plant has checked it
    foot.wrench =
        static_cast<std::size_t>(index_of(kernels.wrench_names, kernels.wrenches, declared.site));
    bool found = false, bends = false;
    Matrix6 A;
    for (std::size_t s = 0; s < kernels.sensors && !found; ++s) {
      const int in_image = robot.sensor_index(kernels.sensor_names[s]);
      probe.bend(0.0);
      A = probe.response(s, foot.wrench);
      if (in_image < 0 || !carries(A)) continue;
      probe.bend(0.4);
      bends = !probe.response(s, foot.wrench).isApprox(A, 1e-9);
      probe.bend(0.0);
      if (bends) continue;
      found = true;
      foot.sensor = static_cast<std::size_t>(in_image);
      foot.from_sensor = A.inverse();
      Eigen::Matrix3d gravity;
      Eigen::Matrix<double, 6, 3> weight;
      const double half = std::sqrt(0.5);
      int way = 0;
      for (const auto& q :
           {std::array{0.0, 0.0, 0.0, 1.0}, {half, 0.0, 0.0, half}, {0.0, half, 0.0, half}}) {
        probe.turn(q);
        gravity.col(way) = probe.gravity(foot.site);
        weight.col(way++) = probe.reading(s);
      }
      probe.turn({0.0, 0.0, 0.0, 1.0});
      foot.weight = weight * gravity.inverse();
    }
    if (!found) {
      return lacks_sensor(robot, declared, bends ? "without a joint between the two" : "above it");
    }
    feet.feet_.push_back(foot);
  }
  return feet;
}

Wrench FootSensors::ground(std::size_t foot, const hal::StateImage& state,
                           const Eigen::Vector3d& gravity) const noexcept TANDEM_RT {
  const SensedFoot& one = feet_[foot];
  const Eigen::Map<const Wrench> reading(state.sensor_values(one.sensor).data());
  return one.from_sensor * (reading - one.weight * gravity);
}

}  // namespace tandem::estimation
