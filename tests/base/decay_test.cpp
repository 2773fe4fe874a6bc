#include "base/decay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace tandem {
namespace {

// Rounded from 80 decimal digits. A constant is computed by the compiler, a variable by the
// machine.
TEST(Decay, IsTheNearestDouble) {
  constexpr struct {
    double x, value;
  } kRows[] = {
      {0.0, 1.0},
      {5e-324, 1.0},
      {1e-20, 1.0},
      {0x1.0p-53, 0x1.fffffffffffffp-1},
      {0x1.12e0be826d695p-30, 0x1.fffffff768fa1p-1},
      {0x1.0p-6, 0x1.f80feabfeefa5p-1},
      {0x1.999999999999ap-5, 0x1.e7078b0a726a6p-1},
      {0x1.3333333333333p-2, 0x1.7b4c869c37c05p-1},
      {0x1.e28c731eb6950p-1, 0x1.8f0354463275ep-2},
      {0x1.0p+0, 0x1.78b56362cef38p-2},
      {0x1.4p+3, 0x1.7cd79b5647c9bp-15},
      {0x1.0a00000000000p+5, 0x1.057322ef4a1c2p-48},
      {0x1.9000000000000p+6, 0x1.a8c1f14e2af5dp-145},
      {0x1.5e40000000000p+9, 0x1.4ff475c68ca02p-1011},
      {746.0, 0.0},
      {std::numeric_limits<double>::infinity(), 0.0},
  };
  for (const auto& row : kRows) {
    volatile double x = row.x;
    EXPECT_EQ(decay(x), row.value) << row.x;
  }
  static_assert(decay(0.05) == 0x1.e7078b0a726a6p-1);
}

// The library's exponential is off by less than a unit of the last place, and so is its agreement.
TEST(Decay, IsWithinAUnitOfTheLibrarys) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<int> binade(-30, 9);
  std::uniform_real_distribution<double> within(0.5, 1.0);
  int equal = 0;
  constexpr int kNumbers = 100'000;
  for (int i = 0; i < kNumbers; ++i) {
    const double x = std::ldexp(within(random), binade(random));
    const double ours = decay(x), theirs = std::exp(-x);
    EXPECT_LE(std::abs(ours - theirs), std::nextafter(theirs, 1.0) - theirs) << x;
    if (ours == theirs) ++equal;
  }
  EXPECT_GT(equal, kNumbers * 98 / 100);
}

}  // namespace
}  // namespace tandem
