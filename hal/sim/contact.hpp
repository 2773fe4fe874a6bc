// Feet on compliant ground: the wrench that the ground applies to every sole.
// Layer: hal/sim.  Thread: create non-RT; evaluate RT.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::sim {

/// The ground under the points of the soles: the plane z = height, and its terrain.
///
/// Normal, per point at depth d > 0: Fz = k d (1 + c d'), never below zero (Hunt and Crossley
/// 1975, exponent 1). It is continuous in d and takes out energy whenever d' is not zero.
///
/// Tangential, per point: a spring to an anchor on the ground, set where the point touched down,
/// and a damper, F = -kt (p - a) - dt p'. While the spring's force is within the cone mu Fz the
/// anchor rests: no creep. Beyond, the anchor is dragged so that the spring carries just mu Fz,
/// and the sum is cut to the cone: the point slides (an elastoplastic return, after Cundall and
/// Strack 1979). Both cuts are projections onto a convex set, so no motion gains energy. mu goes
/// from static to sliding friction with the point's speed s,
/// mu = sliding + (static - sliding) / (1 + (s / stick_velocity)^2).
///
/// On terrain d, p and a are along the normal and the tangents of the place, relative to the
/// ground, which may move.
class Contact {
 public:
  struct Sole {
    std::size_t site = 0;                         ///< index in the kernels' sites
    std::size_t wrench = 0;                       ///< index in the kernels' wrenches
    std::vector<std::array<double, 3>> points_m;  ///< in the site's frame
  };

  Contact() = default;
  /// Errors: stiffness or friction that is not positive or finite, static below sliding.
  [[nodiscard]] static Result<Contact> create(const hal::ContactConfig& config,
                                              const std::vector<Sole>& feet);

  [[nodiscard]] std::size_t feet() const noexcept { return feet_.size(); }
  /// Index of foot `foot`'s sole among the kernels' sites.
  [[nodiscard]] std::size_t site(std::size_t foot) const noexcept { return feet_[foot].site; }
  [[nodiscard]] std::size_t points() const noexcept { return x_.size(); }

  [[nodiscard]] const hal::Terrain& terrain() const noexcept { return config_.terrain; }
  /// Where the ground is from now on; for terrain that moves.
  void move_ground(const hal::GroundMotion& moved) noexcept { moved_ = moved; }
  /// The highest terrain under a point of a sole, over the level ground.
  /// @param pose  as evaluate()'s
  [[nodiscard]] double rise_m(const double* pose) const noexcept;

  /// Fills the feet's entries of `wrench`: force then moment about the site's origin, in the
  /// site's frame, acting on the robot (the kernels' input).
  ///
  /// @param pose   (12 * sites) as the kernels give it: R row-major (site to W), then p in W
  /// @param twist  (6 * sites) of the site's origin in W: linear, angular
  /// @param move_anchors  true exactly once per sub-step, at its first evaluation
  void evaluate(const double* pose, const double* twist, bool move_anchors,
                double* wrench) noexcept TANDEM_RT;

  /// The same from the ground's force on every point, which somebody else computed.
  /// @param forces_W  (3 per point) in W
  void take(const double* pose, const double* forces_W, double* wrench) noexcept;

  /// Force on each foot and moment about its site's origin, in W axes, of the last evaluation.
  [[nodiscard]] std::span<const double> wrench_W() const noexcept { return wrench_W_; }
  /// Energy in the normal and tangential springs at the last evaluation [J].
  [[nodiscard]] double elastic_energy_J() const noexcept { return energy_J_; }
  /// Whether point `index` touches the ground.
  [[nodiscard]] bool touching(std::size_t index) const noexcept { return touching_[index] != 0; }

  /// Whether any point does.
  [[nodiscard]] bool touching() const noexcept {
    return std::ranges::find(touching_, 1) != touching_.end();
  }

  void archive(Archive& ar) { ar(anchor_x_, anchor_y_, touching_, wrench_W_, energy_J_); }

 private:
  struct SolePoints {
    std::size_t site, wrench, begin, end;
  };

  /// Writes the force F and moment M on foot `f`, both in W, M about the site's origin.
  void write(std::size_t f, const double* R, const double* F, const double* M,
             double* wrench) noexcept;

  hal::ContactConfig config_;
  hal::GroundMotion moved_;  // at the last evaluation
  std::vector<SolePoints> feet_;
  std::vector<double> x_, y_, z_;            // points, site's frame
  std::vector<double> anchor_x_, anchor_y_;  // W
  std::vector<std::uint8_t> touching_;
  std::vector<double> wrench_W_;  // 6 per foot
  double energy_J_ = 0.0;
};

}  // namespace tandem::sim
