// Joints along finite Fourier series: what excites a robot's dynamics (tandem excite).
// Layer: controllers.  Thread: configure non-RT; start, play RT.
#pragma once

#include <cstddef>
#include <vector>

#include "controllers/controller.hpp"

namespace tandem {

/// x(t) = x0 + sum_k c_k (cos k w t - 1) + s_k sin k w t, w = 2 pi / period_s, from the measured x0
/// on, for whole periods; afterwards it rests at x0.
class FourierSeries {
 public:
  /// Reads period_s, periods and [[harmonic]]. Errors, at their keys: none, or too few
  /// coefficients; a series that does not start at rest; one that leaves a joint's limits of
  /// position, from the experiment's start posture, or of speed.
  void configure(ControllerSetup& setup, const std::vector<std::size_t>& joints, bool joints_known);

  [[nodiscard]] bool used() const noexcept TANDEM_RT { return !harmonics_.empty(); }
  [[nodiscard]] double end_s() const noexcept TANDEM_RT { return periods_ * period_s_; }
  /// From here on. @rt O(joints)
  void start(const std::vector<std::size_t>& joints,
             const hal::StateImage& state) noexcept TANDEM_RT;
  /// Writes position and velocity references. @rt O(joints * harmonics)
  void play(double t_s, const std::vector<std::size_t>& joints,
            hal::CommandImage& command) const noexcept TANDEM_RT;
  /// For snapshots.
  [[nodiscard]] std::vector<double>& start_rad() { return start_rad_; }

 private:
  struct Harmonic {
    std::vector<double> cos_rad, sin_rad;  // per joint
  };
  struct Point {
    double position, velocity;
  };
  /// Relative to the start.
  [[nodiscard]] Point at(double t_s, std::size_t joint) const noexcept TANDEM_RT;
  void check(ControllerSetup& setup, TomlTable& first,
             const std::vector<std::size_t>& joints) const;

  double period_s_ = 1.0;
  double periods_ = 1.0;
  std::vector<Harmonic> harmonics_;
  std::vector<double> start_rad_;  // per joint
};

}  // namespace tandem
