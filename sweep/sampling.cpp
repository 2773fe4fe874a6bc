// Everything follows from seed, point and key alone: the same points on every machine.
#include "sweep/sampling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/split_mix.hpp"

namespace tandem::sweep {
namespace {

std::string_view ordered(double a, double b) {
  return a < b ? "" : "the first must be less than the second";
}
std::string_view positive_ordered(double a, double b) {
  return a > 0.0 ? ordered(a, b) : "both must be above 0";
}
std::string_view deviation(double, double b) {
  return b > 0.0 ? "" : "the second, the standard deviation, must be above 0";
}

double uniform(double u, double a, double b) { return a + u * (b - a); }
double log_uniform(double u, double a, double b) { return a * std::pow(b / a, u); }

double polynomial(std::span<const double> c, double x) {
  double sum = 0.0;
  for (const double one : c) sum = sum * x + one;
  return sum;
}

/// Quantile of the normal distribution: Acklam's rational approximation (relative error 1.2e-9),
/// refined once by Halley's method.
double normal(double u, double mean, double deviation) {
  constexpr std::array a{-3.969683028665376e+01, 2.209460984245205e+02,  -2.759285104469687e+02,
                         1.383577518672690e+02,  -3.066479806614716e+01, 2.506628277459239e+00};
  constexpr std::array b{-5.447609879822406e+01, 1.615858368580409e+02,  -1.556989798598866e+02,
                         6.680131188771972e+01,  -1.328068155288572e+01, 1.0};
  constexpr std::array c{-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                         -2.549732539343734e+00, 4.374664141464968e+00,  2.938163982698783e+00};
  constexpr std::array d{7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00,
                         3.754408661907416e+00, 1.0};
  constexpr double kTail = 0.02425;
  double x = 0.0;
  if (u < kTail || u > 1.0 - kTail) {
    const double q = std::sqrt(-2.0 * std::log(u < kTail ? u : 1.0 - u));
    x = polynomial(c, q) / polynomial(d, q);
    if (u > kTail) x = -x;
  } else {
    const double q = u - 0.5;
    x = polynomial(a, q * q) * q / polynomial(b, q * q);
  }
  constexpr double kSqrtTwoPi = 2.50662827463100050242;
  const double e = 0.5 * std::erfc(-x / std::sqrt(2.0)) - u;
  const double step = e * kSqrtTwoPi * std::exp(x * x / 2.0);
  return mean + deviation * (x - step / (1.0 + x * step / 2.0));
}

constexpr std::array kDistributions{
    Distribution{"uniform", "[least, greatest]", ordered, uniform},
    Distribution{"log_uniform", "[least, greatest], each factor as likely", positive_ordered,
                 log_uniform, true},
    Distribution{"normal", "[mean, standard deviation]", deviation, normal},
};

/// 0 < u < 1
double unit(std::uint64_t bits) { return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52; }

/// A generator of its own for each key.
std::uint64_t key_state(std::uint64_t seed, std::size_t key) {
  std::uint64_t state = seed;
  const std::uint64_t first = split_mix(state);
  state = first ^ (static_cast<std::uint64_t>(key) + 1) * 0xD1342543DE82EF95U;
  (void)split_mix(state);
  return state;
}

std::vector<double> random(std::size_t points, std::size_t keys, std::uint64_t seed) {
  std::vector<double> all(points * keys);
  for (std::size_t k = 0; k < keys; ++k) {
    std::uint64_t state = key_state(seed, k);
    for (std::size_t p = 0; p < points; ++p) all[p * keys + k] = unit(split_mix(state));
  }
  return all;
}

/// Each of as many equal parts of a key's range as there are points has one of them.
std::vector<double> latin_hypercube(std::size_t points, std::size_t keys, std::uint64_t seed) {
  std::vector<double> all(points * keys);
  std::vector<std::size_t> part(points);
  for (std::size_t k = 0; k < keys; ++k) {
    std::uint64_t state = key_state(seed, k);
    std::iota(part.begin(), part.end(), std::size_t{0});
    for (std::size_t p = points; p > 1; --p)
      std::swap(part[p - 1], part[static_cast<std::size_t>(split_mix(state) % p)]);
    for (std::size_t p = 0; p < points; ++p) {
      all[p * keys + k] =
          (static_cast<double>(part[p]) + unit(split_mix(state))) / static_cast<double>(points);
    }
  }
  return all;
}

/// A primitive polynomial and the first direction numbers that go with it.
struct SobolRow {
  unsigned degree, polynomial;
  std::array<std::uint32_t, 7> first;
};
/// Joe and Kuo, 2008, "new-joe-kuo-6": the dimensions 2 to 21.
constexpr std::array<SobolRow, 20> kSobol{{
    {1, 0, {1}},
    {2, 1, {1, 3}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
    {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}},
    {5, 2, {1, 1, 5, 5, 17}},
    {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}},
    {5, 11, {1, 1, 5, 1, 1}},
    {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}},
    {6, 1, {1, 3, 3, 9, 7, 49}},
    {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}},
    {6, 19, {1, 1, 1, 15, 7, 5}},
    {6, 22, {1, 3, 1, 15, 13, 25}},
    {6, 25, {1, 1, 5, 5, 19, 61}},
    {7, 1, {1, 3, 7, 11, 23, 15, 103}},
    {7, 4, {1, 3, 7, 13, 13, 15, 69}},
}};

std::array<std::uint32_t, 32> directions(std::size_t key) {
  std::array<std::uint32_t, 32> v{};
  if (key == 0) {
    for (unsigned i = 0; i < 32; ++i) v[i] = 1U << (31 - i);
    return v;
  }
  const SobolRow& row = kSobol[key - 1];
  for (unsigned i = 0; i < 32; ++i) {
    if (i < row.degree) {
      v[i] = row.first[i] << (31 - i);
      continue;
    }
    v[i] = v[i - row.degree] ^ (v[i - row.degree] >> row.degree);
    for (unsigned k = 1; k < row.degree; ++k) {
      if ((row.polynomial >> (row.degree - 1 - k) & 1U) != 0) v[i] ^= v[i - k];
    }
  }
  return v;
}

/// Sobol's sequence in Gray code's order, shifted by random digits: so no point is at an edge.
std::vector<double> sobol(std::size_t points, std::size_t keys, std::uint64_t seed) {
  std::vector<double> all(points * keys);
  for (std::size_t k = 0; k < keys; ++k) {
    const auto v = directions(k);
    std::uint64_t state = key_state(seed, k);
    auto x = static_cast<std::uint32_t>(split_mix(state) >> 32);
    for (std::size_t p = 0; p < points; ++p) {
      all[p * keys + k] = (static_cast<double>(x) + 0.5) * 0x1p-32;
      unsigned zeros = 0;
      while ((p >> zeros & 1U) != 0) ++zeros;
      x ^= v[std::min(zeros, 31U)];
    }
  }
  return all;
}

constexpr std::array kMethods{
    Method{.name = "grid", .words = "every combination of the values", .is_grid = true},
    Method{.name = "random", .words = "each value by itself", .spread = random},
    Method{.name = "latin_hypercube",
           .words = "random, each value's range evenly filled",
           .spread = latin_hypercube},
    Method{.name = "sobol",
           .words = "Sobol's sequence, the whole space evenly filled: take 2^k points",
           .most_keys = kSobol.size() + 1,
           .spread = sobol},
};

}  // namespace

std::span<const Distribution> distributions() { return kDistributions; }
std::span<const Method> methods() { return kMethods; }

}  // namespace tandem::sweep
