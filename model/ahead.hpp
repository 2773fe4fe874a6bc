// Where a robot looks, from its feet.
// Layer: model.  Thread: any.
#pragma once

#include <Eigen/Core>
#include <span>

namespace tandem::model {

/// A flat foot: where its last joint is, and the middle of its sole [m], in the root's frame.
struct FootReach {
  Eigen::Vector3d ankle_m, sole_m;
};

/// The root's axis along which the soles reach beyond their ankles; x when there are no flat feet,
/// or they reach less than 5 mm.
[[nodiscard]] inline Eigen::Vector3d direction_ahead(std::span<const FootReach> feet) {
  constexpr double kLeast_m = 0.005;
  Eigen::Vector3d reach = Eigen::Vector3d::Zero();
  for (const FootReach& foot : feet) reach += foot.sole_m - foot.ankle_m;
  reach.z() = 0.0;
  if (feet.empty() || reach.norm() < kLeast_m * static_cast<double>(feet.size())) {
    return Eigen::Vector3d::UnitX();
  }
  Eigen::Index axis = 0;
  reach.cwiseAbs().maxCoeff(&axis);
  return Eigen::Vector3d::Unit(axis) * (reach[axis] > 0.0 ? 1.0 : -1.0);
}

}  // namespace tandem::model
