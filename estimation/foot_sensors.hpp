// What the ground does to each foot, from the force/torque sensor above it.
// Layer: estimation.  Thread: made non-RT; the rest RT.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/image.hpp"
#include "hal/robot.hpp"
#include "model/kernels.h"

namespace tandem::estimation {

using Wrench = Eigen::Matrix<double, 6, 1>;  ///< force [N], moment [Nm]

/// A sensor's reading s is A w + G g: w the ground's wrench at the foot's site, in its frame, g
/// gravity in that frame, G g the weight of what is beyond the sensor. A and G are constant where
/// no joint lies between sensor and sole; they are read off the kernels. Of a foot that accelerates
/// its mass times that is missing: while it stands it does not.
class FootSensors {
 public:
  /// What needs no kernels. Errors: the robot has no feet, or no force/torque sensor at all.
  [[nodiscard]] static Status check(const hal::Robot& robot);
  /// Finds for every foot the force/torque sensor through which all of its wrench passes, the
  /// nearest where there are several.
  /// Errors: check()'s; a foot without such a sensor; a joint between the two.
  [[nodiscard]] static Result<FootSensors> make(const hal::Robot& robot,
                                                const tandem_kernels& kernels);

  [[nodiscard]] std::size_t feet() const noexcept { return feet_.size(); }
  /// Index among the kernels' sites.
  [[nodiscard]] std::size_t site(std::size_t foot) const noexcept { return feet_[foot].site; }
  /// Index among the kernels' wrenches.
  [[nodiscard]] std::size_t wrench(std::size_t foot) const noexcept { return feet_[foot].wrench; }
  /// The ground on the foot, about its site, in the site's frame.
  /// @param gravity  [m/s2] in the site's frame
  [[nodiscard]] Wrench ground(std::size_t foot, const hal::StateImage& state,
                              const Eigen::Vector3d& gravity) const noexcept TANDEM_RT;

 private:
  struct SensedFoot {
    std::size_t site = 0, wrench = 0, sensor = 0;  // sensor: of the image
    Eigen::Matrix<double, 6, 6> from_sensor;       // A^-1
    Eigen::Matrix<double, 6, 3> weight;            // G
  };
  std::vector<SensedFoot> feet_;
};

}  // namespace tandem::estimation
