// A zero-phase low-pass filter and its derivatives at single instants.
// Layer: identification.  Thread: any.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace tandem::identification {

/// A symmetric windowed sinc (Kaiser, 80 dB): it shifts nothing in time, and passes what is slower
/// than two thirds of the cut-off unchanged to 1e-4. Derivatives are central differences of the
/// filtered signal. A NaN within reach() of an instant makes its values NaN.
class LowPass {
 public:
  /// @pre cutoff_Hz is less than half of the sampling rate
  LowPass(double period_s, double cutoff_Hz);

  /// Samples on either side of an instant that it looks at.
  [[nodiscard]] std::size_t reach() const { return weights_[0].size() / 2; }
  /// Samples between instants whose white noise is hardly correlated: 1 / (2 cutoff).
  [[nodiscard]] std::size_t stride() const { return stride_; }

  /// @pre reach() <= at < signal.size() - reach()
  [[nodiscard]] double value(std::span<const double> signal, std::size_t at) const {
    return sum(0, signal, at);
  }
  [[nodiscard]] double rate(std::span<const double> signal, std::size_t at) const {
    return sum(1, signal, at);
  }
  [[nodiscard]] double second_rate(std::span<const double> signal, std::size_t at) const {
    return sum(2, signal, at);
  }

  /// Variance of value(), rate() or second_rate(), by `order`, when the signal is white noise of
  /// variance 1.
  [[nodiscard]] double noise(int order) const;

 private:
  [[nodiscard]] double sum(int order, std::span<const double> signal, std::size_t at) const;

  std::vector<double> weights_[3];
  std::size_t stride_;
};

}  // namespace tandem::identification
