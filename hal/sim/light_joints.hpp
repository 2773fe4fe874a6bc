// Joints whose link can be so light that the sub-step does not integrate their spring: a shoulder's
// yaw when the arm beyond it is straight. Where it is, the sub-step is halved.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/sim/actuator.hpp"
#include "hal/sim/added_inertia.hpp"
#include "hal/sim/apparent_inertia.hpp"
#include "model/kernels.h"

namespace tandem::sim {

/// With u = h / s (hal/sim/stability.hpp) a joint's springs and dampers take up
///
///   need(h) = a + a^2 / (J - a - u b) + u d      a = u^2 Ks + u Ds, of a rigid drive u (b + d)
///
/// of the link's inertia I [kg m^2], J and b the motor's, d the link's damping: the sub-step h is
/// stable while need(h) < I. It is halved, three times at most, until need(h) <= I / 2, which
/// leaves the rest to the ground and to end stops.
class LightJoints {
 public:
  static constexpr std::int64_t kLook_ns = 10'000'000;  ///< between two looks; time 0 is one
  static constexpr double kTaken = 0.5;                 ///< of a link's inertia, at most

  /// need(h), with Ds, d and a rigid drive's b as many times as `dampers`.
  [[nodiscard]] static double need_kg_m2(const ActuatorModel& motor, double link_damping_Nms_rad,
                                         double u_s, double dampers = 1.0) noexcept;

  LightJoints() = default;
  /// Watches the joints that need more than half of the least inertia of `inertias`.
  /// @param damping_Nms_rad  of the links, per joint of the kernels
  /// @param stretch          s
  LightJoints(const tandem_kernels& kernels, const Actuators& actuators,
              std::span<const double> damping_Nms_rad, std::span<const JointInertia> inertias,
              double stretch, std::int64_t substep_ns);

  [[nodiscard]] bool none() const noexcept { return watched_.empty(); }
  [[nodiscard]] bool due(std::int64_t time_ns) const noexcept TANDEM_RT {
    return !none() && time_ns >= next_look_ns_;
  }
  /// Finds the inertia that each watched link shows here: 1 over what a unit of torque adds to its
  /// acceleration.
  /// @param sines   of q
  /// @param forces  (nv) scratch that holds the generalized forces, and does so afterwards
  /// @param wrench  the kernels' wrenches
  void look(AddedInertia& dynamics, const double* sines, const double* q, const double* v,
            double* forces, const double* wrench, std::int64_t time_ns) noexcept TANDEM_RT;
  [[nodiscard]] std::int64_t step_ns(std::int64_t substep_ns) const noexcept TANDEM_RT {
    return substep_ns >> halvings_;
  }
  /// The robot is somewhere else.
  void lost() noexcept TANDEM_RT { next_look_ns_ = 0; }

  void archive(Archive& ar) { ar(next_look_ns_, halvings_); }

 private:
  static constexpr std::size_t kHalvings = 3;
  struct Watched {
    std::size_t joint;                             // of the kernels
    std::array<double, kHalvings + 1> need_kg_m2;  // after so many halvings
  };
  std::vector<Watched> watched_;
  std::vector<double> rest_, pushed_;  // accelerations, scratch
  std::size_t joints_ = 0;             // of the kernels
  std::int64_t next_look_ns_ = 0, halvings_ = 0;
};

}  // namespace tandem::sim
