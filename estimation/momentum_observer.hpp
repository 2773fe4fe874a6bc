// External torques by the generalised momentum: without accelerations, on the link side of springs.
// Layer: estimation.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "model/kernels.h"

namespace tandem::estimation {

/// The observer of A. De Luca and R. Mattone (2003), as in S. Haddadin, A. De Luca, A.
/// Albu-Schäffer, "Robot collisions: a survey on detection, isolation, and identification" (TRO
/// 2017). With p = M v and dp/dt = tau + b + tau_external, its r is tau_external after a
/// first-order low pass, and the residual is r after the same low pass once more:
///
///   r = K (p - integral of (tau + b + r) dt)        residual' = K (r - residual)
///
/// p holds v's noise times M, of which r keeps K times what is faster than K: encoders' counts make
/// velocities noisier the faster they change. The second low pass takes that away, for a step that
/// arrives later: 3 ms at 15 Hz.
///
/// tau is what the springs, or rigid drives, do to the links. So the motor's friction and, behind a
/// spring, the rotor's inertia do not enter; a rigid drive's rotor is armature of the model. What
/// is left in the residual of a robot that nobody touches: errors of masses, of tau, and of v.
///
/// Steps by the trapezoidal rule and the implicit Euler method in r and in the residual:
/// r <- (r + K (p - p_before - h (tau + b, mean of both ends))) / (1 + K h).
class MomentumObserver {
 public:
  /// @param bandwidth_Hz  where an oscillation passes by 1 / sqrt(2): 0.64 K over 2 pi
  MomentumObserver(const tandem_kernels& kernels, double bandwidth_Hz, double step_s);

  /// One step. After restart() the first one only notes the state.
  /// @param sines         of q, for the kernels
  /// @param q, v, wrench  as the kernels take them; known wrenches are not external ones
  /// @param tau           (nv) of the drives; a base's six entries are 0
  void update(const double* sines, const double* q, const double* v, const double* tau,
              const double* wrench) noexcept TANDEM_RT;
  /// Forgets: r is 0.
  void restart() noexcept TANDEM_RT;

  /// (nv) in the kernels' order; a base's six are the wrench on it in its frame.
  [[nodiscard]] std::span<const double> residual() const noexcept { return residual_; }
  void archive(Archive& ar) { ar(residual_, r_, p_, rate_, running_); }

 private:
  const tandem_kernels* kernels_;
  double gain_, step_s_;
  std::vector<double> residual_;          // r_ after a second low pass
  std::vector<double> r_, p_, rate_;      // of the last step
  std::vector<double> p_now_, rate_now_;  // scratch
  std::uint8_t running_ = 0;
};

}  // namespace tandem::estimation
