#include "hal/sim/hoist.hpp"

#include <gtest/gtest.h>

namespace tandem::sim {
namespace {

TEST(Hoist, CarriesItsLoadWhereItHolds) {
  Hoist hoist;
  const double pose[7] = {0.1, -0.2, 0.9, 0.1, -0.5, 0.7, 0.5};  // turned about no axis of its own
  const double load[6] = {1.0, -2.0, 300.0, 4.0, -5.0, 6.0};
  hoist.hold(30.0, 2.0, pose, load);
  const double rest[6] = {};
  double wrench[6] = {};
  hoist.add_wrench(pose, rest, wrench);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(wrench[i], load[i], 1e-9) << i;
}

}  // namespace
}  // namespace tandem::sim
