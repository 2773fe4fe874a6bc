// The swing with its board and sensors on an EtherCAT line, in process.
#include "base/archive.hpp"
#include "tests/sim/swing_loop.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::sim {
namespace {

using tandem::test::line_swing_robot;
using tandem::test::SwingLoop;

TEST(Line, TheSameRunGivesTheSameBytesAndASnapshotGoesOn) {
  const auto run = [](SwingLoop& loop) {
    loop.bring_up();
    loop.run(200);
    return loop.bytes();
  };
  SwingLoop first(line_swing_robot());
  SwingLoop second(line_swing_robot());
  const auto at_200 = run(first);
  EXPECT_TRUE(at_200 == run(second));
  first.run(100);
  second.run(37);  // somewhere else, and back
  Archive in(at_200);
  EXPECT_TRUE(second.sim_robot->archive(in));
  in(second.state, second.command, second.time);
  EXPECT_TRUE(in.at_end());
  second.run(100);
  EXPECT_TRUE(first.bytes() == second.bytes());
}

/// A snapshot in the middle of the start goes on, too.
TEST(Line, ASnapshotOfTheStartGoesOn) {
  SwingLoop first(line_swing_robot());
  SwingLoop second(line_swing_robot());
  for (const int cycles : {7, 60, 200}) {
    first.run(cycles);
    const auto there = first.bytes();
    Archive in(there);
    EXPECT_TRUE(second.sim_robot->archive(in));
    in(second.state, second.command, second.time);
    EXPECT_TRUE(there == second.bytes()) << cycles;
  }
  first.bring_up();
  second.bring_up();
  EXPECT_TRUE(first.bytes() == second.bytes());
}

/// The boards' firmware hears the same commands in the same cycles, and is asked for the same.
TEST(Line, MovesAsTheSameBoardDoesOnCan) {
  hal::RobotConfig quiet = line_swing_robot();
  quiet.joints[0].torque_noise_Nm = 0.0;
  hal::RobotConfig can = tandem::test::swing_robot(2);
  can.joints[0].torque_noise_Nm = 0.0;
  SwingLoop line(quiet);
  SwingLoop bus(can);
  const auto path = [](SwingLoop& loop) {
    loop.bring_up();
    loop.run(1500);  // at rest, off the hoist
    const double from = loop.state.position_rad()[0];
    std::vector<double> positions;
    for (int i = 0; i < 400; ++i) {
      loop.command.position_rad()[0] = from - 0.1 * std::sin(0.01 * i);
      loop.step();
      positions.push_back(loop.state.position_rad()[0] - from);
    }
    return positions;
  };
  const std::vector<double> on_line = path(line);
  const std::vector<double> on_can = path(bus);
  double worst = 0.0;
  for (std::size_t i = 0; i < on_can.size(); ++i) {
    worst = std::max(worst, std::abs(on_line[i] - on_can[i]));
  }
  EXPECT_LT(worst, 1e-4) << "a cycle later it would be 1e-3";
  EXPECT_EQ(line.state.age_cycles()[0], 0U);
}

TEST(Line, HasNoBusTiming) {
  SimRobotConfig config{.posture = "up"};
  config.bus_timing = true;
  const auto made = SimRobot::create(line_swing_robot(), tandem::test::swing_kernels(2), config);
  ASSERT_FALSE(made.has_value());
  EXPECT_NE(made.error().to_string().find("sim.bus_timing: a robot on EtherCAT"), std::string::npos)
      << made.error().to_string();
}

}  // namespace
}  // namespace tandem::sim
