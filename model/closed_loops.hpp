// The equations that keep a mechanism's loops closed, and what follows from them without any
// dynamics: the passive joints' positions, and the torques of the driven ones.
// Layer: model.  Thread: create non-RT; the rest any, one at a time.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "model/kernels.h"
#include "model/kinematic_loop.hpp"
#include "model/semidefinite.hpp"
#include "model/sines.hpp"

namespace tandem::model {

/// One equation c(q) = 0 with its derivative: c' = f . (v1 - v2) + m . (w1 - w2), where v and w
/// are the velocities of the loop's two sites in W.
struct ClosureEquation {
  std::size_t loop = 0;
  double error = 0.0;  ///< c [m]
  double bias = 0.0;   ///< c'' at vdot = 0 [m/s^2]
  Eigen::Vector3d f = Eigen::Vector3d::Zero();
  Eigen::Vector3d m = Eigen::Vector3d::Zero();
};

/// How far a loop is from closed.
struct ClosureGap {
  double position_m = 0.0;  ///< between its sites; of a rod, how much it is too long or short
  double axis_rad = 0.0;    ///< between the axes of a revolute loop, 0 to pi
  /// "a gap of 0.01 m is left", "its axes are 90 degrees apart", or both.
  [[nodiscard]] std::string to_string() const;
};

/// Loops of a robot as equations of its kernels' sites. A ball has three, a revolute joint five,
/// a rod one; of those that a planar loop repeats in space, the solvers drop the surplus.
///
/// Errors of direction are given as the displacement that they make at kAngleArm_m.
///
/// The joints named passive have no motor. For a posture of the others (and the base), close()
/// finds theirs; carry_passive() moves their share of the torques to the driven joints.
class ClosedLoops {
 public:
  static constexpr double kAngleArm_m = 0.1;

  ClosedLoops() = default;
  /// Errors: a site or joint that the kernels lack, a site where no wrench may act (the kernels
  /// are of another robot.toml).
  [[nodiscard]] static Result<ClosedLoops> create(const std::vector<KinematicLoop>& loops,
                                                  const std::vector<std::string>& passive,
                                                  const tandem_kernels& kernels);

  [[nodiscard]] std::size_t loops() const noexcept { return loops_.size(); }
  [[nodiscard]] std::size_t rows() const noexcept { return rows_.size(); }
  [[nodiscard]] const std::string& name(std::size_t loop) const noexcept {
    return loops_[loop].spec.name;
  }
  [[nodiscard]] std::span<const ClosureEquation> equations() const noexcept { return rows_; }
  /// A (rows x nv, row-major) of c' = A v, as of differentiate().
  [[nodiscard]] std::span<const double> jacobian() const noexcept { return A_; }
  /// Per passive joint, its index in v.
  [[nodiscard]] std::span<const std::size_t> passive() const noexcept { return passive_; }

  /// Evaluates the equations at q, v.
  void move(const double* q, const double* v) noexcept TANDEM_RT;
  /// Evaluates A. @pre move() at the same q
  void differentiate(const double* q) noexcept TANDEM_RT;

  /// For the kernels' _at forms at move()'s q; null without a loop.
  [[nodiscard]] const double* sines() const noexcept {
    return loops_.empty() ? nullptr : sines_.data();
  }

  /// How far a loop is open, as of move() [m]; for a rod, how much too long or short.
  [[nodiscard]] double position_error_m(std::size_t loop) const noexcept TANDEM_RT;
  /// The same, by position and direction.
  [[nodiscard]] ClosureGap gap(std::size_t loop) const noexcept TANDEM_RT;
  /// How fast it opens, as of differentiate(). @param v (nv)
  [[nodiscard]] double velocity_error_m_s(std::size_t loop,
                                          const double* v) const noexcept TANDEM_RT;

  /// Zeroes the wrenches at the loops' sites; those of other sites stay.
  void clear_wrenches(double* wrench) const noexcept TANDEM_RT;
  /// Writes the wrenches (kernels' order, in the sites' frames) that the multipliers are:
  /// generalised force A^T lambda. Those of other sites stay. @param lambda (rows)
  void to_wrenches(const double* lambda, double* wrench) const noexcept TANDEM_RT;

  /// Moves the passive joints, and nothing else, until the loops are closed (Gauss-Newton).
  /// @return whether every loop is closed to 1e-12 m
  [[nodiscard]] bool close(double* q, int most_steps) noexcept TANDEM_RT;
  /// Passive joints' rates from the others', so that the loops stay closed.
  /// @pre differentiate() @param v (nv)
  void close_rates(double* v) noexcept TANDEM_RT;
  /// The loops' forces that need no torque at the passive joints, taken off `tau` (nv): what is
  /// left are the motors' torques. @pre differentiate()
  void carry_passive(double* tau) noexcept TANDEM_RT;

 private:
  struct Loop {
    KinematicLoop spec;
    std::size_t site[2] = {0, 0};
    std::size_t wrench[2] = {0, 0};
    Eigen::Vector3d axis, across[2];  // revolute: of unit length, in the site's frame
  };
  Status add(const KinematicLoop& spec);
  void write_rod(const Loop& loop, ClosureEquation& row) const noexcept;
  void write_point(const Loop& loop, ClosureEquation* rows) const noexcept;
  void write_axis(const Loop& loop, ClosureEquation* rows) const noexcept;
  void factorise_passive() noexcept;
  void step_passive(double* unknown) noexcept;

  const tandem_kernels* kernels_ = nullptr;
  Sines sines_;  // of move()'s posture
  std::vector<Loop> loops_;
  std::vector<ClosureEquation> rows_;
  std::vector<std::size_t> passive_;
  std::vector<double> A_, J_, pose_, twist_, acceleration_, zero_;
  std::vector<double> N_, unknown_, lambda_;  // of the passive joints
  SemidefiniteSolver solver_;
};

}  // namespace tandem::model
