// One-sided spring and damper at both ends of every joint, as stiff as its inertia lets the
// sub-step integrate.
#include "hal/sim/end_stops.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/wide.hpp"

namespace tandem::sim {
namespace {

constexpr double kGive_rad = 0.001;       // under the drive's whole effort; m of a prismatic joint
constexpr double kStopStiffShare = 0.4;   // of 1 / h: the stop's frequency on the lightest link
constexpr double kStopDampedShare = 0.3;  // of least / h

}  // namespace

EndStops::EndStops(const tandem_kernels& kernels, std::span<const JointRange> ranges,
                   std::span<const JointInertia> inertias, std::int64_t substep_ns)
    : lower_(kernels.joints, -std::numeric_limits<double>::infinity()),
      upper_(kernels.joints, std::numeric_limits<double>::infinity()) {
  const double h_s = static_cast<double>(substep_ns) * 1e-9;
  for (const JointRange& range : ranges) {
    const std::size_t joint = joint_of(kernels, range.joint);
    const bool ends = std::isfinite(range.lower_rad) || std::isfinite(range.upper_rad);
    if (joint == kernels.joints || !ends) continue;
    const JointInertia& inertia = inertias[joint];
    const double stiffest = inertia.least * (kStopStiffShare / h_s) * (kStopStiffShare / h_s);
    const double stiffness = std::min(range.effort_Nm / kGive_rad, stiffest);
    const double damping =
        std::min(std::sqrt(stiffness * inertia.most), kStopDampedShare * inertia.least / h_s);
    stops_.push_back({joint, range.lower_rad, range.upper_rad, stiffness, damping});
    lower_[joint] = std::max(lower_[joint], range.lower_rad);
    upper_[joint] = std::min(upper_[joint], range.upper_rad);
  }
}

/// Whether any q[j] is below `lower` or above `upper`. Of this file only: link-time optimisation
/// takes a function with several targets that others call for two.
TANDEM_WIDE static bool any_outside(const double* lower, const double* upper, const double* q,
                                    std::size_t n) noexcept {
  std::int64_t any = 0;  // as wide as what is compared
  for (std::size_t j = 0; j < n; ++j) {
    any |= q[j] < lower[j] ? 1 : 0;
    any |= q[j] > upper[j] ? 1 : 0;
  }
  return any != 0;
}

bool EndStops::touched(const double* q) const noexcept TANDEM_RT {
  return any_outside(lower_.data(), upper_.data(), q, lower_.size());
}

void EndStops::add_torques(const double* q, const double* qd,
                           double* torque_Nm) const noexcept TANDEM_RT {
  for (const Stop& stop : stops_) {
    const double at = q[stop.joint], rate = qd[stop.joint];
    if (at > stop.upper) {
      torque_Nm[stop.joint] -=
          std::max(0.0, stop.stiffness * (at - stop.upper) + stop.damping * rate);
    } else if (at < stop.lower) {
      torque_Nm[stop.joint] +=
          std::max(0.0, stop.stiffness * (stop.lower - at) - stop.damping * rate);
    }
  }
}

double EndStops::elastic_energy_J(const double* q) const noexcept {
  double energy = 0.0;
  for (const Stop& stop : stops_) {
    const double over = std::max({0.0, q[stop.joint] - stop.upper, stop.lower - q[stop.joint]});
    energy += 0.5 * stop.stiffness * over * over;
  }
  return energy;
}

}  // namespace tandem::sim
