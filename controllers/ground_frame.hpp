// Where the ground must be under the contact points of a robot that stands.
// Layer: controllers.  Thread: any.
#pragma once

#include <Eigen/Core>
#include <span>

#include "base/realtime.hpp"
#include "controllers/feet.hpp"

namespace tandem {

/// The frame G of the ground in the frame that the poses stand in.
struct GroundFrame {
  Eigen::Matrix3d R;         ///< columns: ahead, to the left, up
  Eigen::Vector3d origin_m;  ///< the middle of the feet's middles
};

/// Up is normal to the plane that fits the contact points best. Points on one line leave open how
/// the ground leans about it, a single one leaves it open in all directions: then the frame's own
/// z decides. Ahead is the frame's own x, laid onto the ground.
///
/// @param pose  (12 * sites) of the kernels, with the base along the frame
/// @rt    no allocation, lock or throw.
[[nodiscard]] GroundFrame ground_under(std::span<const Foot> feet,
                                       std::span<const double> pose) noexcept TANDEM_RT;

}  // namespace tandem
