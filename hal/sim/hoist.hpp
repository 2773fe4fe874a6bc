// The hoist that holds a robot's base until its drives are on, then lets it down.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <array>
#include <cstdint>

#include "base/archive.hpp"
#include "base/realtime.hpp"

namespace tandem::sim {

/// A critically damped 6-D spring from the base to where it stood at the start, with the load
/// that it carried there compensated, so that nothing moves at the start. A release fades all of
/// it to zero along a minimum-jerk profile; the robot sinks onto its feet while the hoist yields.
/// Its frequency is set on the base's apparent inertia, so that no sub-step finds it stiff.
class Hoist {
 public:
  /// @param mass_kg, inertia_kg_m2  apparent at the base, with free joints; sets it to 40 Hz
  /// @param pose  (7) of the base: position, quaternion [x y z w]
  /// @param load  (6) force, moment in the base's frame that keep the robot at rest
  void hold(double mass_kg, double inertia_kg_m2, const double* pose, const double* load) noexcept;
  /// Lets the base down within `duration_ns` (0: at once).
  void release(std::int64_t duration_ns) noexcept TANDEM_RT;
  /// Moves the release on by one sub-step.
  void advance(std::int64_t step_ns) noexcept TANDEM_RT;

  [[nodiscard]] bool holding() const noexcept { return share_ > 0.0; }
  /// Share of the whole hoist that still acts, 1 to 0.
  [[nodiscard]] double share() const noexcept { return share_; }

  /// Adds the hoist's force and moment on the base, in the base's frame, to `wrench` (6).
  /// @param q  (7) base pose;  @param v  (6) base velocity in the base's frame
  void add_wrench(const double* q, const double* v, double* wrench) const noexcept TANDEM_RT;

  void archive(Archive& ar) {
    ar(pose_, load_, stiffness_, damping_, share_, elapsed_ns_, duration_ns_, releasing_);
  }

 private:
  std::array<double, 7> pose_{};
  std::array<double, 6> load_{};
  std::array<double, 2> stiffness_{}, damping_{};  // linear, angular
  double share_ = 0.0;
  std::int64_t elapsed_ns_ = 0, duration_ns_ = 0;
  std::uint8_t releasing_ = 0;
};

}  // namespace tandem::sim
