// Falls as docs/safety.md defines them, of a robot that stands 1 m high on two feet.
#include "runtime/fall_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tandem::runtime {
namespace {

struct Falls : testing::Test {
  Falls() {
    truth.base_quaternion()[3] = 1.0;
    truth.base_position_m()[2] = limits.ground_m + limits.standing_m;
    for (std::size_t foot : {0U, 1U}) truth.foot_position_m()[3 * foot + 2] = limits.ground_m;
    carry(200.0, 200.0);
  }
  void carry(double left_N, double right_N) {
    truth.foot_force_N()[2] = left_N;
    truth.foot_force_N()[5] = right_N;
  }
  void tilt(double degrees) {
    const double half = 0.5 * degrees / 180.0 * std::numbers::pi;
    truth.base_quaternion()[0] = std::sin(half);
    truth.base_quaternion()[3] = std::cos(half);
  }
  /// What is found at `time_ms`; empty: nothing.
  std::string look(std::int64_t time_ms) {
    truth.time_ns()[0] = time_ms * 1'000'000;
    return fall_text(watch.look(truth), limits);
  }
  /// With the base at a height above the ground.
  std::string at_height(double height_m) {
    truth.base_position_m()[2] = limits.ground_m + height_m;
    return look(0);
  }

  FallLimits limits{.watched = true, .ground_m = -0.25, .standing_m = 1.0, .highest_m = 1.1};
  hal::TruthImage truth{3, 2};
  FallWatch watch{limits};
};

TEST_F(Falls, AreFlightsOfASecondWithoutAFootOnTheGround) {
  EXPECT_EQ(look(500), "");
  carry(0.0, 1.0);
  EXPECT_EQ(look(750), "") << "one foot is enough";
  carry(0.0, 0.0);
  EXPECT_EQ(look(1749), "");
  EXPECT_EQ(look(1750), "the robot fell: no foot touches the ground since 1.000 s");
  EXPECT_EQ(look(2000), "the robot fell: no foot touches the ground since 1.250 s");
  carry(300.0, 0.0);
  EXPECT_EQ(look(2001), "");
}

TEST_F(Falls, CountAFlightFromTheControllersStart) {
  carry(0.0, 0.0);
  EXPECT_EQ(look(0), "");
  watch.begin();
  EXPECT_EQ(look(1500), "");
  EXPECT_EQ(look(2499), "");
  EXPECT_NE(look(2500), "");
}

TEST_F(Falls, AreTiltsBeyondSixtyDegrees) {
  tilt(59.5);
  EXPECT_EQ(look(0), "");
  tilt(61.33);
  EXPECT_EQ(look(0), "the robot fell: its base is tilted by 61.3 degrees");
}

TEST_F(Falls, AreHeightsThatNoStandingRobotHas) {
  EXPECT_EQ(at_height(0.31), "");
  EXPECT_EQ(at_height(0.25),
            "the robot fell: its base is 0.250 m above the ground, and stands at 1.000 m");
  EXPECT_EQ(at_height(3.25), "");
  EXPECT_EQ(at_height(3.5),
            "the robot flew away: its base is 3.500 m above the ground, and started at 1.100 m");
}

TEST_F(Falls, AreFeetDeepInTheGround) {
  truth.foot_position_m()[5] = limits.ground_m - 0.09;
  EXPECT_EQ(look(0), "");
  truth.foot_position_m()[5] = limits.ground_m - 0.125;
  EXPECT_EQ(look(0),
            "the robot sank: a foot is 0.125 m inside the ground (is [contact] too soft?)");
}

TEST_F(Falls, AreNoneWhileTheHoistHoldsTheBaseOrNobodyWatches) {
  tilt(90.0);
  truth.hoist_share()[0] = 0.01;
  EXPECT_EQ(look(0), "");
  truth.hoist_share()[0] = 0.0;
  EXPECT_NE(look(0), "");
  limits.watched = false;
  watch = FallWatch(limits);
  EXPECT_EQ(look(0), "");
}

}  // namespace
}  // namespace tandem::runtime
