// Whether a loop keeps a joint swinging about its reference: slow oscillation, by its energy.
// Layer: base.  Thread: RT only.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/realtime.hpp"

namespace tandem {

/// The deviation w is the joint's velocity less its reference's, e its integral, tau the torque
/// that the loop asks for; w and tau through a low-pass of 10 Hz. A half-swing lasts from one
/// threshold, w = +a or -a, to the other; its energy is that of its largest w. Over n of them
///
///     tau = m + b e + c w        by least squares: load, spring and damper of the loop;
///
/// c > 0 is a damper that feeds the swing, with the energy of c times the integral of w^2.
///
/// A loop that takes energy out of a deviation (c < 0) lets it die away: pushes, steps of the
/// reference; it works against whoever shakes the joint. A spring that is let go has c = 0. Only a
/// loop that feeds its own swing has n half-swings in succession, none longer than kLongest_s,
/// whose second half has no less energy than kSteady of the first half's, and c above kFeeding of
/// |b| over the swing's frequency [rad/s].
///
/// A swing of f Hz beyond a is found n / (2 f) after it first went beyond a.
class SwingWatch {
 public:
  static constexpr double kLowPass_Hz = 10.0;
  static constexpr double kLongest_s = 1.0;
  static constexpr double kSteady = 0.9;
  static constexpr double kFeeding = 0.02;
  static constexpr std::size_t kMost = 8;

  /// @param deviation_rad_s  velocity less the reference's, before the low-pass
  /// @param torque_Nm        that the loop asks for
  /// @param threshold_rad_s  a; 0: not watched
  /// @param half_swings      n, even. @pre 2 <= n <= kMost
  /// @return whether it swings
  bool update(double deviation_rad_s, double torque_Nm, double threshold_rad_s,
              std::size_t half_swings, double dt_s) noexcept TANDEM_RT {
    if (!(threshold_rad_s > 0.0)) return false;
    const double share = 2.0 * std::numbers::pi * kLowPass_Hz * dt_s;
    w_ += (deviation_rad_s - w_) * share / (1.0 + share);
    torque_Nm_ += (torque_Nm - torque_Nm_) * share / (1.0 + share);  // as late as w
    e_ += w_ * dt_s;
    now_.energy = std::max(now_.energy, w_ * w_);
    now_.time_s += dt_s;
    const std::array<double, 3> x{1.0, e_, w_};
    for (std::size_t i = 0; i < 3; ++i) {
      now_.by_torque[i] += x[i] * torque_Nm_;
      for (std::size_t k = i; k < 3; ++k) {
        now_.among[i][k] += x[i] * x[k];
        now_.among[k][i] = now_.among[i][k];
      }
    }
    if (now_.time_s > kLongest_s) rest();
    const std::int64_t side = w_ >= threshold_rad_s ? 1 : w_ <= -threshold_rad_s ? -1 : 0;
    if (side == 0 || side == side_) return false;
    const bool completes = side_ != 0;
    side_ = side;
    if (completes) add();
    now_ = {};
    return completes && feeds(half_swings);
  }
  /// Nothing is followed: what was seen does not count.
  void rest() noexcept TANDEM_RT {
    side_ = 0;
    count_ = 0;
    now_ = {};
  }
  /// The same, and the deviation begins anew.
  void restart() noexcept TANDEM_RT {
    rest();
    w_ = e_ = torque_Nm_ = 0.0;
  }

 private:
  struct HalfSwing {
    double energy = 0.0;  ///< the largest w^2
    double time_s = 0.0;
    std::array<double, 3> by_torque{};             ///< sums of tau, e tau, w tau
    std::array<std::array<double, 3>, 3> among{};  ///< of the products of 1, e and w
  };

  void add() noexcept {
    std::shift_right(halves_.begin(), halves_.end(), 1);
    halves_[0] = now_;
    count_ = std::min<std::int64_t>(count_ + 1, kMost);
  }
  [[nodiscard]] bool feeds(std::size_t n) const noexcept {
    if (count_ < static_cast<std::int64_t>(n)) return false;
    double newer = 0.0;
    HalfSwing all;
    for (std::size_t h = 0; h < n; ++h) {
      if (h < n / 2) newer += halves_[h].energy;
      all.energy += halves_[h].energy;
      all.time_s += halves_[h].time_s;
      for (std::size_t i = 0; i < 3; ++i) {
        all.by_torque[i] += halves_[h].by_torque[i];
        for (std::size_t k = 0; k < 3; ++k) all.among[i][k] += halves_[h].among[i][k];
      }
    }
    if (newer < kSteady * (all.energy - newer)) return false;
    return feeds(all, std::numbers::pi * static_cast<double>(n) / all.time_s);
  }
  /// By Cramer's rule about the means: b and c of the least squares.
  [[nodiscard]] static bool feeds(const HalfSwing& all, double rad_s) noexcept {
    const auto about = [&](std::size_t i, std::size_t k) {
      return all.among[i][k] - all.among[0][i] * all.among[0][k] / all.among[0][0];
    };
    const auto with = [&](std::size_t i) {
      return all.by_torque[i] - all.among[0][i] * all.by_torque[0] / all.among[0][0];
    };
    const double size = about(1, 1) * about(2, 2) - about(1, 2) * about(1, 2);
    if (!(size > 0.0)) return false;
    const double b = with(1) * about(2, 2) - with(2) * about(1, 2);
    const double c = with(2) * about(1, 1) - with(1) * about(1, 2);
    return c > 0.0 && c * rad_s > kFeeding * std::abs(b);
  }

  std::array<HalfSwing, kMost> halves_{};  ///< the newest first
  HalfSwing now_;                          ///< since w passed a threshold
  double w_ = 0.0;
  double e_ = 0.0;
  double torque_Nm_ = 0.0;
  std::int64_t side_ = 0;
  std::int64_t count_ = 0;  ///< half-swings in succession
};

}  // namespace tandem
