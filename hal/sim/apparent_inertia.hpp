// How light a robot can feel: the least inertia that its joints and points show to a force, over
// postures. What is stiff against it (end stops, the ground) takes its stiffness from there.
// Layer: hal/sim.  Thread: non-RT only.
#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "hal/sim/added_inertia.hpp"
#include "model/kernels.h"

namespace tandem::sim {

/// The travel of one of the kernels' joints between its end stops; infinite where it has none.
struct JointRange {
  std::string joint;                                            ///< of the kernels
  double lower_rad = -std::numeric_limits<double>::infinity();  ///< [rad or m]
  double upper_rad = std::numeric_limits<double>::infinity();
  double effort_Nm = std::numeric_limits<double>::infinity();  ///< that its drive can push with
};

/// A posture, its mass matrix, and the inverse of that.
struct PostureInertia {
  std::vector<double> q;  ///< (nq)
  Eigen::MatrixXd M;      ///< (nv, nv)
  Eigen::MatrixXd mobility;
};

/// `start` (nq) and `more`, drawn from a generator with a fixed seed: each joint evenly within
/// its range, or a turn about its start where it has none.
/// @param dynamics  the robot's; of kernels alone, too
[[nodiscard]] std::vector<PostureInertia> postures_within(AddedInertia dynamics,
                                                          std::span<const double> start,
                                                          std::span<const JointRange> ranges,
                                                          int more = 16);

/// Along one joint, on the link side [kg m^2 or kg].
struct JointInertia {
  double least = 0.0;  ///< every other joint and the base free: 1 / (M^-1)jj, its least
  double most = 0.0;   ///< all of them locked: Mjj, its most
};

/// Per joint of the kernels.
[[nodiscard]] std::vector<JointInertia> joint_inertias(const tandem_kernels& kernels,
                                                       std::span<const PostureInertia> postures);

/// A point's Jacobian, transposed: (nv, 3), a column for each axis of W.
using PointJacobian = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// The mass that a point shows where it is lightest [kg].
[[nodiscard]] double point_mass(const PostureInertia& posture, const PointJacobian& J);

/// The kernels' joint of this name; `kernels.joints` when there is none.
[[nodiscard]] std::size_t joint_of(const tandem_kernels& kernels, const std::string& name);

}  // namespace tandem::sim
