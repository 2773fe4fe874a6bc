// Forces on links from outside of the robot: hands, obstacles.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/sim/fault_injection.hpp"
#include "hal/sim/tree_motion.hpp"

namespace tandem::sim {

/// Each acts as a generalized force J^T f, for the kernels need no site there. In each sub-step it
/// is the mean of its shape over that sub-step, so that its impulse is exact whatever their length.
/// Force/torque sensors do not feel it but for the motion that it causes.
class Pushes {
 public:
  Pushes() = default;
  /// @param joints  the image's, by name
  Pushes(const model::Tree& tree, const tandem_kernels& kernels,
         const std::vector<std::string>& joints);

  /// A push begins at `time_ns`, and ends by itself after its duration.
  /// @param push  of kind kPush. One on what does not move, or beyond kMostFaults, is not taken
  void begin(const ScenarioFault& push, std::int64_t time_ns) noexcept TANDEM_RT;
  /// What acts on the sub-step from `time_ns` on, until the next call. What is over is forgotten.
  void act_on(std::int64_t time_ns, std::int64_t step_ns) noexcept TANDEM_RT;
  [[nodiscard]] bool any() const noexcept { return count_ > 0; }
  /// Adds J^T f to `forces` (nv) at a state.
  void add_forces(const double* q, const double* v, double* forces) noexcept TANDEM_RT;
  /// The sum of all in W [N], and their moment about `center_m` [Nm], at a state.
  void sum_up(const double* q, const double* v, const double* center_m, double* force_N,
              double* moment_Nm) noexcept TANDEM_RT;
  void archive(Archive& ar);

 private:
  struct Push {
    ScenarioFault given;
    std::int64_t begin_ns = 0;
    std::uint64_t body = 0;
    double share = 0.0;  // of what is given, in the sub-step
  };
  void place(const double* q, const double* v) noexcept TANDEM_RT;

  TreeMotion motion_;
  std::vector<std::size_t> body_of_joint_;  // of the image
  std::vector<std::size_t> body_of_link_;   // of the tree
  std::vector<double> body_force_;          // scratch
  std::vector<Push> pushes_;                // FaultInjection::kMostFaults at most
  std::size_t count_ = 0;
};

}  // namespace tandem::sim
