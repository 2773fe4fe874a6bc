#include "estimation/momentum_observer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::estimation {
namespace {

/// Frequency of a pole over that at which two of them let 1 / sqrt(2) through.
const double kPole = 1.0 / std::sqrt(std::numbers::sqrt2 - 1.0);

}  // namespace

MomentumObserver::MomentumObserver(const tandem_kernels& kernels, double bandwidth_Hz,
                                   double step_s)
    : kernels_(&kernels),
      gain_(2.0 * std::numbers::pi * kPole * bandwidth_Hz),
      step_s_(step_s),
      residual_(kernels.nv),
      r_(kernels.nv),
      p_(kernels.nv),
      rate_(kernels.nv),
      p_now_(kernels.nv),
      rate_now_(kernels.nv) {}

void MomentumObserver::update(const double* sines, const double* q, const double* v,
                              const double* tau, const double* wrench) noexcept TANDEM_RT {
  kernels_->generalised_momentum_at(sines, q, v, wrench, p_now_.data(), rate_now_.data());
  const double kept = 1.0 / (1.0 + gain_ * step_s_);
  bool finite = true;
  for (std::size_t i = 0; i < r_.size(); ++i) {
    rate_now_[i] += tau[i];
    if (running_ != 0) {
      const double moved = p_now_[i] - p_[i] - 0.5 * step_s_ * (rate_[i] + rate_now_[i]);
      r_[i] = kept * (r_[i] + gain_ * moved);
      residual_[i] = kept * (residual_[i] + gain_ * step_s_ * r_[i]);
    }
    finite =
        finite && std::isfinite(r_[i]) && std::isfinite(p_now_[i]) && std::isfinite(rate_now_[i]);
  }
  if (!finite) return restart();
  p_.swap(p_now_);
  rate_.swap(rate_now_);
  running_ = 1;
}

void MomentumObserver::restart() noexcept TANDEM_RT {
  std::ranges::fill(r_, 0.0);
  std::ranges::fill(residual_, 0.0);
  running_ = 0;
}

}  // namespace tandem::estimation
