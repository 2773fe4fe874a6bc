// Forces on links from outside of the robot: hands, obstacles.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/sim/fault_injection.hpp"
#include "hal/sim/tree_motion.hpp"

namespace tandem::sim {

/// Each acts as a generalized force J^T f, for the kernels need no site there. Force/torque sensors
/// do not feel it but for the motion that it causes.
class Pushes {
 public:
  Pushes() = default;
  /// @param joints  the image's, by name
  Pushes(const model::Tree& tree, const tandem_kernels& kernels,
         const std::vector<std::string>& joints);

  /// Nobody pushes any more.
  void clear() noexcept TANDEM_RT { count_ = 0; }
  /// @param joint    of the image: whose body is pushed
  /// @param force_N  in W
  /// @param point_m  in the joint's frame, which turns with it
  void add(std::size_t joint, const Vec3& force_N, const Vec3& point_m) noexcept TANDEM_RT;
  void archive(Archive& ar) { ar(pushes_, count_); }
  [[nodiscard]] bool any() const noexcept { return count_ > 0; }
  /// Adds J^T f to `forces` (nv) at a state.
  void add_forces(const double* q, const double* v, double* forces) noexcept TANDEM_RT;

 private:
  struct Push {
    std::size_t body;
    Vec3 force_N, point_m;
  };
  TreeMotion motion_;
  std::vector<std::size_t> body_;   // by joint of the image
  std::vector<double> body_force_;  // scratch
  std::vector<Push> pushes_;        // FaultInjection::kMostFaults at most
  std::size_t count_ = 0;
};

}  // namespace tandem::sim
