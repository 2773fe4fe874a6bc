// The ends of the joints' travel: stiff, damped, on the link side.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "hal/sim/apparent_inertia.hpp"

namespace tandem::sim {

/// A joint that is d beyond an end of its range is pushed back by max(0, k d + b d'): never pulled
/// out further, and never with more energy than it brought.
///
/// k and b follow from how heavy the joint can be (JointInertia) and from the sub-step h:
///
///   k = min(effort / 1 mrad, least (0.4 / h)^2)     the drive's whole effort goes in by 1 mrad
///   b = min(sqrt(k most), 0.3 least / h)            half of critical for the heaviest
///
/// so that the stop of the lightest stays well inside what the sub-step can integrate.
class EndStops {
 public:
  EndStops() = default;
  /// @param ranges  infinite ends have no stop; `inertias` per joint of the kernels
  EndStops(const tandem_kernels& kernels, std::span<const JointRange> ranges,
           std::span<const JointInertia> inertias, std::int64_t substep_ns);

  /// Whether any joint is beyond an end. `q` (joints), as the next three.
  [[nodiscard]] bool touched(const double* q) const noexcept TANDEM_RT;
  /// Adds what the stops push with to `torque_Nm`.
  void add_torques(const double* q, const double* qd, double* torque_Nm) const noexcept TANDEM_RT;
  /// What their springs hold [J].
  [[nodiscard]] double elastic_energy_J(const double* q) const noexcept;

 private:
  struct Stop {
    std::size_t joint;
    double lower, upper, stiffness, damping;
  };
  std::vector<Stop> stops_;
  std::vector<double> lower_, upper_;  // of every joint; infinite without a stop
};

}  // namespace tandem::sim
