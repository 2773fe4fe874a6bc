// The torques of a robot that the ground carries at its feet.
// Layer: controllers.  Thread: made non-RT; then any, RT-safe.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "controllers/feet.hpp"
#include "model/kernels.h"

namespace tandem {

/// Shares the load of a floating base out among the contact points of its feet. Feet only push:
///
/// Vertical: the smallest forces, in the sense of least squares with every foot counted alike,
/// that carry the force and put the centre of pressure where the moment wants it. A point that
/// would have to pull is left out and the rest shares anew. Where the centre of pressure is beyond
/// the points (the robot tips), the points nearest to it carry the whole force.
/// Horizontal: every point takes its share as it carries, so that all are equally far from
/// slipping, and a moment about the vertical turns about the centre of pressure alike.
/// Points are taken to be level for the vertical forces.
class Support {
 public:
  /// @param feet  at least one
  explicit Support(std::span<const FootContact> feet);

  /// Takes the ground's share out of inverse dynamics: the wrench on the base, which no motor can
  /// give, must come from the ground.
  ///
  /// @param q     (nq) of a floating base
  /// @param pose  (12 * sites), J (6 * nv * sites): of the kernels at q
  /// @param tau   (nv) in: inverse dynamics without contact; out: the joints' torques with the
  ///              feet on the ground, and zero for the base
  /// @rt    no allocation, lock or throw; O(feet (nv + points) + points^2).
  void carry(const tandem_kernels& kernels, std::span<const double> q, std::span<const double> pose,
             std::span<const double> J, std::span<double> tau) noexcept TANDEM_RT;

  /// The force on every point in W's axes that the last carry() found, foot after foot.
  struct Point {
    std::size_t foot = 0;
    double weight = 1.0;  ///< in the least squares: 1 / points of its foot
    Eigen::Vector3d in_site_m, position_m, force_N;
    bool pushes = true;
  };
  [[nodiscard]] std::span<const Point> points() const noexcept { return points_; }

 private:
  [[nodiscard]] bool share_vertical(double force_N,
                                    const Eigen::Vector2d& first_Nm) noexcept TANDEM_RT;
  void share_horizontal(const Eigen::Vector3d& force_N, double moment_Nm) noexcept TANDEM_RT;

  std::vector<std::size_t> sites_;  // of each foot
  std::vector<Point> points_;
};

}  // namespace tandem
