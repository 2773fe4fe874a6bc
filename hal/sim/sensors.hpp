// What the force/torque and inertial sensors of the simulated robot feel, exact: noise and bias
// are added by their nodes.
// Layer: hal/sim.  Thread: create non-RT; sample RT.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/plant.hpp"

namespace tandem::sim {

/// The model's site that an IMU's frame is: the first [[site]] that is that link's own frame, or
/// one that the model gets under the sensor's name.
[[nodiscard]] std::string imu_site(const hal::RobotConfig& robot, const hal::SensorConfig& sensor);

/// All sensors of a robot, in the process image's order.
///
/// force_torque (6): force [N] and moment [Nm] about the sensor frame's origin that the side away
/// from the base applies to the other, in the sensor's frame.
/// imu (10): quaternion xyzw of the sensor's frame in W (w >= 0), angular velocity [rad/s] and
/// specific force R^T (a - g) [m/s^2] in the sensor's frame: at rest it reads + 9.81 upwards.
class Sensors {
 public:
  /// Errors: the kernels lack a sensor's joint or frame (they were built from another robot.toml).
  [[nodiscard]] static Result<Sensors> create(const hal::RobotConfig& robot,
                                              const tandem_kernels& kernels);

  /// Fills every sensor's channels, one sensor after another.
  /// @pre plant.evaluate() since its last advance.
  void sample(Plant& plant, std::span<double> channels) noexcept TANDEM_RT;
  [[nodiscard]] std::size_t channels() const noexcept { return channels_; }

 private:
  struct Slot {
    hal::SensorType type;
    std::size_t index;   ///< in the kernels' sensors or sites
    std::size_t offset;  ///< of its first channel
  };
  void sample_imu(const tandem_kernels& kernels, std::size_t site, double* out) noexcept;

  std::vector<Slot> slots_;
  std::vector<double> wrenches_, pose_, twist_, acceleration_;
  std::size_t channels_ = 0;
  bool any_imu_ = false, any_force_ = false;
};

}  // namespace tandem::sim
