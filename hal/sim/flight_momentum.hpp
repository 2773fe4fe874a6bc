// A robot that nothing touches keeps its momentum, however fast its joints move.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/sim/added_inertia.hpp"

namespace tandem::sim {

/// The leapfrog's error in the velocities of a tumbling humanoid changes its momentum by 3e-5 in
/// two seconds. In flight the momentum is known: the linear one grows by weight times time, the
/// angular one about the center of mass stays. The base's velocity is corrected to it, which is the
/// change of velocities with the least kinetic energy, as forces between links change no momentum.
class FlightMomentum {
 public:
  FlightMomentum() = default;
  /// Does nothing for a fixed base.
  explicit FlightMomentum(const tandem_kernels& kernels);

  /// Something acts from outside, or the state is another one: the next flight begins anew.
  void end() noexcept TANDEM_RT { flying_ = 0; }
  /// After `h_s` of flight. The first call of a flight takes the momentum that there is.
  /// @param sines  of q
  /// @param v      (nv) gets that momentum
  void keep(double h_s, AddedInertia& added, const double* sines, const double* q,
            double* v) noexcept TANDEM_RT;

  void archive(Archive& ar) { ar(flying_, momentum_W_); }

 private:
  std::vector<double> M_, block_;       // mass matrix; its base's 6x6
  std::array<double, 6> momentum_W_{};  // linear [Ns], angular about the center of mass [Nms]
  std::uint64_t flying_ = 0;
};

}  // namespace tandem::sim
