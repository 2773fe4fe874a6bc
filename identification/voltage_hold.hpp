// What a motor's voltage, held for a while, does to what is sampled at the end of it.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <Eigen/Core>

namespace tandem::identification {

/// Rigid drives between two samples. The voltages are constant, so the back-EMF brakes:
///
///   M a = u - D v
///
/// By the plant's leapfrog (docs/simulation.md), whose dampers go by predicted velocities, and with
/// A = M^-1 D,
///
///   a_1 = (I - h A) a_0        a_k+2 = (I - 3/2 h A) a_k+1 + 1/2 h A a_k
///
/// Positions show the mean (a_0 / 2 + a_1 + ... + a_n / 2) / n, torques and sensors the last, a_n.
struct VoltageHold {
  double seconds = 0.0;  ///< n h
  int steps = 1;         ///< n

  /// From the middle of the accelerations to the sample [s].
  [[nodiscard]] double lag_s() const { return 0.5 * seconds; }

  /// The accelerations at the samples.
  /// @param M        (n x n) inertia about the joints, rotors included
  /// @param damping  (n) back-EMF and friction of the drives, as viscous friction [Nms/rad]
  /// @param mean     (n) accelerations on the mean of the hold
  [[nodiscard]] Eigen::VectorXd sampled(const Eigen::MatrixXd& M, const Eigen::VectorXd& damping,
                                        const Eigen::VectorXd& mean) const;
};

}  // namespace tandem::identification
