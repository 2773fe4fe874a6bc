// The sensors' and the clock's interfaces over the state image.
// Layer: hal.  Thread: the one that owns the image (the RT thread in the cycle).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/realtime.hpp"
#include "hal/joint_devices.hpp"

namespace tandem::hal {

/// IAnalogSensor: any sensor's channels.
class AnalogSensor {
 public:
  /// @param index  of the sensor in the robot's configuration
  AnalogSensor(const JointAccess& access, std::size_t index) : io_(&access), index_(index) {}
  [[nodiscard]] std::span<const double> channels() const noexcept TANDEM_RT {
    return io_->state->sensor_values(index_);
  }
  /// 0: measured in this cycle; k: the sample is k cycles old.
  [[nodiscard]] std::uint32_t age_cycles() const noexcept TANDEM_RT {
    return io_->state->sensor_age_cycles()[index_];
  }
  /// Nominal time at which the sample was taken.
  [[nodiscard]] std::int64_t timestamp_ns() const noexcept TANDEM_RT {
    return io_->state->time_ns()[0] - age_cycles() * io_->period_ns;
  }

 private:
  const JointAccess* io_;
  std::size_t index_;
};

/// ISixAxisForceTorque: the wrench that the side away from the base applies to the base's side,
/// about the origin of the sensor's frame and in it. In a foot that stands, the force points up.
class SixAxisForceTorque : public AnalogSensor {
 public:
  using AnalogSensor::AnalogSensor;
  [[nodiscard]] std::array<double, 3> force_N() const noexcept TANDEM_RT {
    return {channels()[0], channels()[1], channels()[2]};
  }
  [[nodiscard]] std::array<double, 3> torque_Nm() const noexcept TANDEM_RT {
    return {channels()[3], channels()[4], channels()[5]};
  }
};

/// The inertial measurement unit.
class Imu : public AnalogSensor {
 public:
  using AnalogSensor::AnalogSensor;
  /// x y z w, unit length: turns a vector of the sensor's frame into W.
  [[nodiscard]] std::array<double, 4> orientation() const noexcept TANDEM_RT {
    return {channels()[0], channels()[1], channels()[2], channels()[3]};
  }
  /// Angular velocity, in the sensor's frame.
  [[nodiscard]] std::array<double, 3> angular_velocity_rad_s() const noexcept TANDEM_RT {
    return {channels()[4], channels()[5], channels()[6]};
  }
  /// Linear acceleration less gravity, in the sensor's frame: at rest it points up, 9.81 m/s^2.
  [[nodiscard]] std::array<double, 3> specific_force_m_s2() const noexcept TANDEM_RT {
    return {channels()[7], channels()[8], channels()[9]};
  }
};

/// The robot's time: a count of cycles, simulated or not.
class RobotClock {
 public:
  explicit RobotClock(const JointAccess& access) : io_(&access) {}
  [[nodiscard]] std::uint64_t cycle() const noexcept TANDEM_RT { return io_->state->cycle()[0]; }
  /// Nominal time since the start.
  [[nodiscard]] std::int64_t now_ns() const noexcept TANDEM_RT { return io_->state->time_ns()[0]; }

 private:
  const JointAccess* io_;
};

}  // namespace tandem::hal
