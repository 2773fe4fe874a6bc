// Regulation is proportional (a quarter of the difference, 500 ns at most) and integral.
#include "firmware_emu/slaves/dc_clock.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::firmware::esc {

namespace {

constexpr std::int64_t kNsPerS = 1'000'000'000;
constexpr std::int64_t kMostStepNs = 500;
constexpr std::int64_t kMostRatePpb = 1'000'000;

/// `time_ns` times so many parts in 10^9, without overflow for a century.
constexpr std::int64_t parts(std::int64_t time_ns, std::int64_t ppb) noexcept {
  return time_ns / kNsPerS * ppb + time_ns % kNsPerS * ppb / kNsPerS;
}

}  // namespace

DcClock::DcClock(const ClockSetup& setup) noexcept
    : started_ns_(setup.started_ns),
      drift_ppb_(std::llround(std::clamp(setup.drift_ppm, -1000.0, 1000.0) * 1000.0)),
      jitter_ns_(std::max<std::int64_t>(setup.jitter_ns, 0)),
      random_(setup.seed) {}

std::int64_t DcClock::corrected(std::int64_t now_ns) const noexcept {
  if (regulated_ns_ < 0) return correction_ns_;
  return correction_ns_ + parts(now_ns - regulated_ns_, rate_ppb_);
}

std::int64_t DcClock::local(std::int64_t now_ns) const noexcept TANDEM_RT {
  return started_ns_ + now_ns + parts(now_ns, drift_ppb_) + corrected(now_ns);
}

std::int64_t DcClock::stamp(std::int64_t now_ns) noexcept TANDEM_RT {
  if (jitter_ns_ == 0) return local(now_ns);
  const auto choices = static_cast<std::uint64_t>(2 * jitter_ns_ + 1);
  return local(now_ns) + static_cast<std::int64_t>(split_mix(random_) % choices) - jitter_ns_;
}

void DcClock::regulate(std::int64_t difference_ns, std::int64_t now_ns) noexcept TANDEM_RT {
  const std::int64_t step_ns = std::clamp(difference_ns / 4, -kMostStepNs, kMostStepNs);
  const std::int64_t passed_ns = regulated_ns_ < 0 ? 0 : now_ns - regulated_ns_;
  correction_ns_ = corrected(now_ns) - step_ns;
  regulated_ns_ = now_ns;
  if (passed_ns <= 0) return;
  const std::int64_t rate = step_ns * (kNsPerS / 16) / passed_ns;
  rate_ppb_ = std::clamp(rate_ppb_ - rate, -kMostRatePpb, kMostRatePpb);
}

void DcClock::restart(std::int64_t now_ns) noexcept TANDEM_RT {
  correction_ns_ = corrected(now_ns);
  rate_ppb_ = 0;
  regulated_ns_ = -1;
}

void DcClock::archive(Archive& ar) { ar(random_, correction_ns_, rate_ppb_, regulated_ns_); }

}  // namespace tandem::firmware::esc
