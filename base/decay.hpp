// e to a negative power by sums, products and quotients alone: the same bits on every machine.
// Layer: base.  Thread: any.
#pragma once

#include "base/realtime.hpp"

namespace tandem {

namespace detail {

/// A number as the sum of two doubles, the second of them below half a unit of the first's last
/// place (T. J. Dekker, Numerische Mathematik 18, 1971).
struct Pair {
  double high, low;
};

[[nodiscard]] constexpr Pair sum(double a, double b) noexcept TANDEM_RT {
  const double s = a + b;
  const double of_b = s - a;
  return {s, (a - (s - of_b)) + (b - of_b)};
}

[[nodiscard]] constexpr Pair product(double a, double b) noexcept TANDEM_RT {
  constexpr double kSplit = 134217729.0;  // 2^27 + 1
  const double p = a * b;
  const double a_high = kSplit * a - (kSplit * a - a), a_low = a - a_high;
  const double b_high = kSplit * b - (kSplit * b - b), b_low = b - b_high;
  return {p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low};
}

[[nodiscard]] constexpr Pair product(Pair a, Pair b) noexcept TANDEM_RT {
  const Pair p = product(a.high, b.high);
  return sum(p.high, p.low + (a.high * b.low + a.low * b.high));
}

[[nodiscard]] constexpr Pair quotient(Pair a, double b) noexcept TANDEM_RT {
  const double q = a.high / b;
  const Pair back = product(q, b);
  return sum(q, ((a.high - back.high) - back.low + a.low) / b);
}

}  // namespace detail

/// e^-x. Unlike std::exp, whose last bit depends on the library and the processor, it is the same
/// on every machine with IEEE 754 doubles: that of a PC and that of a microcontroller.
///
/// Computed to 2^-85 and rounded once: the nearest double, but where e^-x lies within that of the
/// middle of two.
///
/// @param x  at least 0, also infinite
/// @rt  at most 30 steps
[[nodiscard]] constexpr double decay(double x) noexcept TANDEM_RT {
  constexpr double kSmallestAbove = 745.2;  // beyond, e^-x is below the smallest double
  if (x > kSmallestAbove) return 0.0;
  // e^-x = (e^-y)^(2^n) with y = x / 2^n, which is exact, and below 1/64
  double y = x;
  int doublings = 0;
  for (; y >= 1.0 / 64.0; ++doublings) y *= 0.5;
  constexpr int kTerms = 13;  // y^14 / 14! < 2^-120
  detail::Pair power{1.0, 0.0};
  for (int n = kTerms; n > 0; --n) {  // 1 - y/1 (1 - y/2 (1 - y/3 (...)))
    const detail::Pair term = detail::quotient(detail::product(power, {y, 0.0}), n);
    const detail::Pair one_less = detail::sum(1.0, -term.high);
    power = detail::sum(one_less.high, one_less.low - term.low);
  }
  for (; doublings > 0; --doublings) power = detail::product(power, power);
  return power.high;
}

}  // namespace tandem
