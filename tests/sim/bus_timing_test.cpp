// The simulated robot on buses that take their time.
#include <algorithm>
#include <numeric>

#include "tests/sim/swing_loop.hpp"

namespace tandem::sim {
namespace {

using tandem::test::classic_swing_robot;
using tandem::test::swing_robot;
using tandem::test::SwingLoop;

SimRobotConfig timed(std::int64_t latency_ns = 0) {
  SimRobotConfig config{.posture = "up"};
  config.bus_timing = true;
  config.bus_latency_ns = latency_ns;
  config.answer_window_ns = 600'000;  // the classic board's last slow frame ends at some 520 us
  return config;
}

/// Cycles of the next `cycles` in which the joint's sample is an old one.
int stale_cycles(SwingLoop& loop, int cycles) {
  int stale = 0;
  for (int i = 0; i < cycles; ++i) {
    loop.step();
    stale += loop.state.age_cycles()[0] > 0 ? 1 : 0;
  }
  return stale;
}

/// Echoes that came later than the cycle after their command.
std::uint64_t late_commands(const SwingLoop& loop) {
  const auto trips = loop.sim_robot->master().round_trips();
  return std::accumulate(trips[0].cycles.begin() + 2, trips[0].cycles.end(), std::uint64_t{0});
}

TEST(BusTiming, ABusThatCarriesItsTrafficAnswersInTheCycle) {
  for (const hal::RobotConfig& robot : {swing_robot(), classic_swing_robot()}) {
    SwingLoop loop(robot, timed());
    loop.bring_up();
    EXPECT_EQ(stale_cycles(loop, 500), 0) << robot.buses[0].fd;
    EXPECT_EQ(loop.state.sensor_age_cycles()[0], 0u);
    EXPECT_EQ(loop.state.sensor_age_cycles()[1], 0u);
    EXPECT_EQ(late_commands(loop), 0u);
    EXPECT_NEAR(loop.state.position_rad()[0], 0.5, 0.01);
  }
}

TEST(BusTiming, AnOverloadedBusShowsOldSamplesAndLateCommands) {
  hal::RobotConfig robot = classic_swing_robot();
  robot.buses[0].bitrate = 560'000;  // 1.03 ms of urgent frames at worst in 1 ms
  SwingLoop loop(robot, timed());
  int stale = 0;
  for (int i = 0; i < 3000; ++i) {
    loop.step();
    stale += loop.state.age_cycles()[0] > 0 && loop.state.drive_state()[0] != 0 ? 1 : 0;
  }
  EXPECT_GT(stale, 0);
  EXPECT_GT(late_commands(loop), 0u);
}

TEST(BusTiming, LatencyOfTheNodesMakesAnswersLate) {
  SwingLoop loop(classic_swing_robot(), timed(400'000));
  // From 1580 on the answers are in time for a while; where, depends on how long bring-up took.
  for (int i = 0; i < 1000; ++i) loop.step();
  const std::uint64_t before = late_commands(loop);
  for (int i = 0; i < 100; ++i) loop.step();
  EXPECT_GT(late_commands(loop), before + 90) << "SYNC and the answers are 400 us late each";
}

TEST(BusTiming, TheSameRunGivesTheSameBytesAndASnapshotGoesOn) {
  const auto run = [](SwingLoop& loop) {
    loop.bring_up();
    loop.run(200);
    return loop.bytes();
  };
  SwingLoop first(classic_swing_robot(), timed());
  SwingLoop second(classic_swing_robot(), timed());
  const auto at_200 = run(first);
  EXPECT_EQ(at_200, run(second));
  first.run(100);
  second.run(37);  // somewhere else, and back
  Archive in(at_200);
  EXPECT_TRUE(second.sim_robot->archive(in));
  in(second.state, second.command, second.time);
  EXPECT_TRUE(in.at_end());
  second.run(100);
  EXPECT_EQ(first.bytes(), second.bytes());
}

TEST(BusTiming, ChangesNothingWhenItIsOff) {
  SimRobotConfig off{.posture = "up"};
  off.answer_window_ns = 100'000;
  SwingLoop one(swing_robot(), off);
  SwingLoop other(swing_robot(), {.posture = "up"});
  one.run(300);
  other.run(300);
  EXPECT_EQ(one.bytes(), other.bytes());
}

}  // namespace
}  // namespace tandem::sim
