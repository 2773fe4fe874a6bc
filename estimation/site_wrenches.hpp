// Which wrenches at declared places would explain the external torques.
// Layer: estimation.  Thread: made non-RT; solve() RT.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "model/kernels.h"

namespace tandem::estimation {

inline constexpr std::size_t kMostWrenches = 4;  ///< sites in one estimate

/// The wrenches f at some sites that minimise |r - J^T f|^2 + damping |f|^2, with r the residual of
/// MomentumObserver and J the sites' Jacobians, one below the other: damped least squares (S.
/// Haddadin, A. De Luca, A. Albu-Schäffer, "Robot collisions", TRO 2017, section on
/// identification). They hold if nothing else touches the robot.
///
/// - Joints are the rows; the six of a floating base are left out: errors of the base's tilt and of
///   the feet's sensors stand there.
/// - What the joints before a site cannot see comes out as 0: n joints see n combinations of the
///   six numbers, and only their shortest explanation (of N and Nm alike) is found. An arm with
///   less than six joints, or in a singular posture, hides forces along the lines and moments about
///   the axes that load no joint: two joints that turn about parallel axes see only the force in
///   their plane and, mixed with it, the moment about their axis.
/// - A combination of unit length that gives the joints s [Nm] is found as s^2 / (s^2 + 1e-4) of
///   its size: 99 % with a lever of 0.1 m, half with one of 1 cm.
/// - Two sites behind each other on one chain share its joints: only together are they explained.
class SiteWrenches {
 public:
  /// @param sites  one to kMostWrenches, no one twice
  /// Errors: no such site (the nearest is named); one twice; too many.
  [[nodiscard]] static Result<SiteWrenches> make(const tandem_kernels& kernels,
                                                 const std::vector<std::string>& sites);

  /// @param sines     of q, for the kernels
  /// @param q         of the kernels
  /// @param residual  (nv) MomentumObserver::residual()
  /// @rt no allocation; O(nv (6 sites)^2 + (6 sites)^3)
  void solve(const double* sines, const double* q,
             std::span<const double> residual) noexcept TANDEM_RT;

  [[nodiscard]] std::size_t size() const noexcept { return sites_.size(); }
  /// Force [N] and moment [Nm] on the robot about the site's origin, in W's axes.
  [[nodiscard]] std::span<const double, 6> wrench(std::size_t site) const noexcept {
    return std::span(f_).subspan(6 * site).first<6>();
  }
  /// |r - J^T f| over the joints [Nm; N of prismatic ones]: what no wrench at the sites explains.
  [[nodiscard]] double unexplained_Nm() const noexcept { return unexplained_Nm_; }

 private:
  SiteWrenches(const tandem_kernels& kernels, std::vector<std::size_t> sites);
  template <int kSites>
  void solve_for(std::span<const double> residual) noexcept;

  const tandem_kernels* kernels_;
  std::vector<std::size_t> sites_;  // of the kernels
  std::vector<double> jacobians_;
  std::vector<double> f_;
  double unexplained_Nm_ = 0.0;
};

}  // namespace tandem::estimation
