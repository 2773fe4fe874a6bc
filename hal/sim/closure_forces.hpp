// The forces that keep the plant's loops closed: accelerations from Lagrange multipliers, and
// after every sub-step a projection of position and velocity. docs/dynamics.md has the equations.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/sim/added_inertia.hpp"
#include "model/closed_loops.hpp"

namespace tandem::sim {

/// Works on the plant's q and v, with the mass matrix of the kernels and what is added to it.
/// Nothing here is state: everything follows from q and v.
class ClosureForces {
 public:
  ClosureForces() = default;
  ClosureForces(model::ClosedLoops loops, const tandem_kernels& kernels);

  [[nodiscard]] bool none() const noexcept { return loops_.loops() == 0; }
  [[nodiscard]] model::ClosedLoops& equations() noexcept { return loops_; }
  [[nodiscard]] const model::ClosedLoops& equations() const noexcept { return loops_; }

  /// The positions have changed: what depends on them is computed when it is needed next.
  void changed() noexcept { fresh_ = false; }

  /// Computes it now, as a restored snapshot needs.
  void prepare(AddedInertia& added, const double* q, const double* v) noexcept;

  /// Zeroes the wrenches at the loops' sites.
  void let_go(double* wrench) const noexcept TANDEM_RT { loops_.clear_wrenches(wrench); }

  /// Corrects the accelerations of the open tree to those with closed loops, and writes the
  /// loops' forces at their sites.
  void constrain(AddedInertia& added, const double* q, const double* v, double* vdot,
                 double* wrench) noexcept TANDEM_RT;

  /// Moves q onto the closed loops along the least kinetic energy. The directions are those of the
  /// last constrain(), which a sub-step changes little.
  void close_positions(double* q, const double* v) noexcept TANDEM_RT;
  /// Moves v onto them in the same way, at q.
  void close_velocities(AddedInertia& added, const double* q, double* v) noexcept TANDEM_RT;

  /// Errors that the last of these two left.
  [[nodiscard]] double position_error_m(std::size_t loop) const noexcept {
    return position_error_m_[loop];
  }
  [[nodiscard]] double velocity_error_m_s(std::size_t loop) const noexcept {
    return velocity_error_m_s_[loop];
  }
  /// Their largest since the start.
  [[nodiscard]] double worst_position_error_m(std::size_t loop) const noexcept {
    return worst_position_m_[loop];
  }

  void archive(Archive& ar) {
    ar(position_error_m_, velocity_error_m_s_, worst_position_m_);
    fresh_ = false;
  }

 private:
  void impulse(const std::vector<double>& change) noexcept;
  void step_positions(double* q) const noexcept;

  const tandem_kernels* kernels_ = nullptr;
  model::ClosedLoops loops_;
  model::SemidefiniteSolver solver_;
  std::vector<double> M_, W_, S_, lambda_, change_, step_;
  std::vector<double> position_error_m_, velocity_error_m_s_, worst_position_m_;
  bool fresh_ = false;
};

}  // namespace tandem::sim
