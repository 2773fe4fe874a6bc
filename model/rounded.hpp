// A number and how far rounding may have moved it: distinguishes a small constant that matters from
// the noise that is left where large ones cancelled. Layer: model.  Thread: any.
#pragma once

#include <cmath>
#include <limits>

namespace tandem::model {

/// A double with a bound on its rounding error. A double becomes one that is off by half a unit
/// of its last place, except 0, 1 and 2, which are meant as they stand.
struct Rounded {
  double value = 0.0;
  double noise = 0.0;

  Rounded() = default;
  Rounded(double exact_or_rounded)  // NOLINT: constants mix freely
      : value(exact_or_rounded), noise(is_exact(value) ? 0.0 : kUnit * std::abs(value)) {}
  Rounded(double v, double bound) : value(v), noise(bound) {}

  /// The value, or zero where it is no more than noise.
  [[nodiscard]] double without_noise() const {
    return std::abs(value) <= kMargin * noise ? 0.0 : value;
  }

  Rounded operator-() const { return {-value, noise}; }
  Rounded& operator+=(const Rounded& other) { return *this = *this + other; }
  Rounded& operator-=(const Rounded& other) { return *this = *this + -other; }

  friend Rounded operator+(const Rounded& a, const Rounded& b) {
    const double sum = a.value + b.value;
    const bool exact = a.value == 0.0 || b.value == 0.0;
    return {sum, a.noise + b.noise + (exact ? 0.0 : kUnit * std::abs(sum))};
  }
  friend Rounded operator-(const Rounded& a, const Rounded& b) { return a + -b; }
  friend Rounded operator*(const Rounded& a, const Rounded& b) {
    const double product = a.value * b.value;
    const bool exact = is_exact(a.value) || is_exact(b.value);
    return {product, std::abs(a.value) * b.noise + std::abs(b.value) * a.noise + a.noise * b.noise +
                         (exact ? 0.0 : kUnit * std::abs(product))};
  }

 private:
  static constexpr double kUnit = 0.5 * std::numeric_limits<double>::epsilon();
  static constexpr double kMargin = 4.0;  // what rounded before it came here

  static bool is_exact(double v) { return v == 0.0 || std::abs(v) == 1.0 || std::abs(v) == 2.0; }
};

}  // namespace tandem::model
