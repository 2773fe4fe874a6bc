// A slave's own clock: it drifts and jitters, and follows the reference that the master hands
// round. Layer: firmware_emu.  Thread: the line's.
#pragma once

#include <cstdint>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/split_mix.hpp"

namespace tandem::firmware::esc {

/// How a clock is wrong.
struct ClockSetup {
  double drift_ppm = 0.0;       ///< it runs faster by so much
  std::int64_t jitter_ns = 0;   ///< most that a time stamp is off, either way
  std::int64_t started_ns = 0;  ///< what it shows at time 0
  std::uint64_t seed = 1;       ///< of the jitter
};

/// Local time, and its regulation to the reference. The line's time goes in, the slave's comes out.
class DcClock {
 public:
  explicit DcClock(const ClockSetup& setup) noexcept;

  /// A time stamp of an event at `now_ns`; takes a number from the jitter's generator.
  [[nodiscard]] std::int64_t stamp(std::int64_t now_ns) noexcept TANDEM_RT;
  /// The clock itself, without jitter.
  [[nodiscard]] std::int64_t local(std::int64_t now_ns) const noexcept TANDEM_RT;
  /// Moves the clock towards the reference: at `now_ns` it was ahead by `difference_ns`.
  void regulate(std::int64_t difference_ns, std::int64_t now_ns) noexcept TANDEM_RT;
  /// Forgets the speed that regulation has found.
  void restart(std::int64_t now_ns) noexcept TANDEM_RT;
  void archive(Archive& ar);

 private:
  [[nodiscard]] std::int64_t corrected(std::int64_t now_ns) const noexcept;

  std::int64_t started_ns_;
  std::int64_t drift_ppb_;
  std::int64_t jitter_ns_;
  std::uint64_t random_;
  std::int64_t correction_ns_ = 0;  ///< at regulated_ns_
  std::int64_t rate_ppb_ = 0;
  std::int64_t regulated_ns_ = -1;  ///< -1: never
};

}  // namespace tandem::firmware::esc
