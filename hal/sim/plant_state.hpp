// The plant's state as one vector: where its parts lie, and how it moves along a rate of change.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/sim/actuator.hpp"
#include "model/kernels.h"

namespace tandem::sim {

/// A state, or a rate of change with every part in the same place:
///
///   q       (nq)  [p_W, quaternion xyzw of the base, joints] or [joints]
///   v       (nv)  [linear, angular of the base in its own frame, joint rates]
///   th      (n)   motor positions on the link side
///   th'     (n)   motor velocities
///   i       (n)   winding currents
class PlantState {
 public:
  explicit PlantState(const tandem_kernels& kernels)
      : nq_(kernels.nq), nv_(kernels.nv), joints_(kernels.joints), x_(nq_ + nv_ + 3 * joints_) {}

  [[nodiscard]] double* q() noexcept { return x_.data(); }
  [[nodiscard]] const double* q() const noexcept { return x_.data(); }
  [[nodiscard]] double* v() noexcept { return x_.data() + nq_; }
  [[nodiscard]] const double* v() const noexcept { return x_.data() + nq_; }
  /// Those of the joints, after the base's.
  [[nodiscard]] double* joint_q() noexcept { return q() + (nq_ - joints_); }
  [[nodiscard]] const double* joint_q() const noexcept { return q() + (nq_ - joints_); }
  [[nodiscard]] const double* joint_v() const noexcept { return v() + (nv_ - joints_); }
  [[nodiscard]] MotorState motor() noexcept {
    double* th = v() + nv_;
    return {th, th + joints_, th + 2 * joints_};
  }
  [[nodiscard]] MotorStateView motor() const noexcept {
    const double* th = v() + nv_;
    return {th, th + joints_, th + 2 * joints_};
  }

  /// Motors move with their joints, without currents.
  void place(std::span<const double> q, std::span<const double> v) noexcept TANDEM_RT;
  /// v after `h_s` of an acceleration, at the same q.
  /// @param vdot, at_v  (nv) v's rate of change as forward dynamics has it at the velocity `at_v`
  void kick(double h_s, const double* vdot, const double* at_v) noexcept TANDEM_RT;
  /// q after `h_s` of the velocity v.
  /// @param ahead  (nv) a velocity at the old q; like v it comes out in the base's new axes
  void drift(double h_s, double* ahead) noexcept TANDEM_RT;
  /// Becomes `from` after `h_s` of `rate`, with a quaternion of unit length.
  void move(const PlantState& from, double h_s, const PlantState& rate) noexcept TANDEM_RT;

  /// As a rate: fills those of q and v at the state `x`. A quaternion off unit length turns as its
  /// normalised self would, which keeps its length and the integrator's order.
  void follow(const PlantState& x, const double* vdot) noexcept TANDEM_RT;
  /// As a rate: adds `weight` times `rate`.
  void add(double weight, const PlantState& rate) noexcept TANDEM_RT;

  void archive(Archive& ar) { ar(x_); }

 private:
  [[nodiscard]] bool floating() const noexcept { return nv_ != joints_; }

  std::size_t nq_, nv_, joints_;
  std::vector<double> x_;
};

}  // namespace tandem::sim
