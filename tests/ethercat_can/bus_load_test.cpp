#include "hal/ethercat-can/bus_load.hpp"

#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using test::classic_config;
using test::Rig;
using test::robot_config;

constexpr std::int64_t kMs = 1'000'000;

const BusLoadRow& row(const BusLoad& load, const std::string& what) {
  for (const BusLoadRow& one : load.rows) {
    if (one.what == what) return one;
  }
  ADD_FAILURE() << "no row " << what;
  return load.rows.front();
}

/// Classic boards of one axis on one bus, without sensors.
RobotConfig classic_boards(int count) {
  RobotConfig robot = classic_config();
  robot.sensors.clear();
  robot.buses.resize(1);
  const BoardConfig board = robot.boards[0];
  const JointConfig joint = robot.joints[0];
  robot.boards.clear();
  robot.joints.clear();
  for (int i = 0; i < count; ++i) {
    robot.boards.push_back(board);
    robot.boards.back().name = "b" + std::to_string(i);
    robot.boards.back().node_id = 1 + i;
    robot.joints.push_back(joint);
    robot.joints.back().name = "j" + std::to_string(i);
    robot.joints.back().board = robot.boards.back().name;
  }
  return robot;
}

TEST(BusLoad, OfAClassicBusByHand) {
  // SYNC 55; commands 135 + 115; feedback 2 * 135; slow feedback (135 + 115) / 4; slow commands
  // 135 + 95 on change; heartbeats 65 twice in 50 ms; SDO 2 * 135 in 100 ms.
  const auto loads = bus_loads(classic_boards(1), kMs);
  ASSERT_TRUE(loads) << loads.error().to_string();
  const BusLoad& load = (*loads)[0];
  EXPECT_DOUBLE_EQ(row(load, "SYNC").time_us, 55.0);
  EXPECT_DOUBLE_EQ(row(load, "commands").time_us, 250.0);
  EXPECT_DOUBLE_EQ(row(load, "commands").frames, 2.0);
  EXPECT_DOUBLE_EQ(row(load, "feedback").time_us, 270.0);
  EXPECT_DOUBLE_EQ(row(load, "slow feedback").time_us, 62.5);
  EXPECT_DOUBLE_EQ(row(load, "slow feedback").frames, 0.5);
  EXPECT_DOUBLE_EQ(row(load, "slow commands").time_us, 230.0);
  EXPECT_DOUBLE_EQ(row(load, "heartbeats").time_us, 2 * 65.0 / 50);
  EXPECT_DOUBLE_EQ(row(load, "SDO, reserved").time_us, 2.7);
  EXPECT_DOUBLE_EQ(load.urgent_us, 575.0);
  EXPECT_DOUBLE_EQ(load.load, (575.0 + 62.5 + 2.6 + 2.7) / 1000.0);
  EXPECT_DOUBLE_EQ(load.most_load, load.load + 0.23);
  EXPECT_TRUE(load.fits());
  EXPECT_TRUE(load.remedy.empty());
}

TEST(BusLoad, OfAnFdBusByHand) {
  // 27 bytes travel as 32: 34 bits at 1 Mbit/s and 358 at 8 Mbit/s, 78.75 us.
  const auto loads = bus_loads(robot_config(), kMs);
  ASSERT_TRUE(loads);
  EXPECT_DOUBLE_EQ(row((*loads)[0], "commands").time_us, 3 * 78.75);
  EXPECT_DOUBLE_EQ(row((*loads)[0], "feedback").time_us, 3 * 78.75);
  EXPECT_DOUBLE_EQ(row((*loads)[0], "slow feedback").time_us, 3 * 78.75 / 4);
  EXPECT_DOUBLE_EQ(row((*loads)[1], "sensors").time_us, 34.0 + 278.0 / 8);
}

TEST(BusLoad, HalfTheRateIsHalfTheLoad) {
  const auto fast = bus_loads(robot_config(), kMs);
  const auto slow = bus_loads(robot_config(), 2 * kMs);
  ASSERT_TRUE(fast && slow);
  EXPECT_NEAR((*slow)[0].urgent_us, (*fast)[0].urgent_us, 1e-9);
  EXPECT_LT((*slow)[0].load, 0.52 * (*fast)[0].load);
}

TEST(BusLoad, RefusesWhatACycleCannotCarryWithTheArithmetic) {
  RobotConfig robot = classic_boards(2);
  robot.file = "robot.toml";
  robot.buses[0].line = 12;
  const Diagnostics errors = check_bus_load(robot, kMs);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].line, 12);
  EXPECT_EQ(errors[0].key, "bus 'legs'");
  EXPECT_EQ(errors[0].message,
            "classic CAN 1 Mbit/s cannot carry what every cycle needs: SYNC 55.0 + commands 500.0 "
            "+ feedback 540.0 = 1095.0 us of 1000 us");
  EXPECT_EQ(errors[0].hint,
            "any of these fits: period_ns = 2000000 or a longer multiple of 1000000; fd = true; "
            "2 buses: (b0) (b1)")
      << "a loop's period goes with the boards' control periods";
}

TEST(BusLoad, RefusesAMeanAboveTheLimit) {
  RobotConfig robot = classic_boards(1);
  robot.buses[0].max_load = 0.6;
  const Diagnostics errors = check_bus_load(robot, kMs);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].message.find("its mean load: SYNC 55.0"), std::string::npos)
      << errors[0].message;
  EXPECT_NE(errors[0].message.find("64.3 % with at most 60 %"), std::string::npos)
      << errors[0].message;
}

TEST(BusLoad, EveryRemedyFits) {
  RobotConfig robot = robot_config();
  for (BoardConfig& board : robot.boards) board.control_period_ns = 100'000;
  robot.buses[0].data_bitrate = 2'000'000;
  const auto loads = bus_loads(robot, kMs);
  ASSERT_TRUE(loads);
  EXPECT_FALSE((*loads)[0].fits());
  EXPECT_EQ((*loads)[0].remedy,
            "any of these fits: period_ns = 1700000 or a longer multiple of 100000; "
            "data_bitrate = 5000000; 3 buses: (board_0) (board_1) (board_2)");
  robot.buses[0].data_bitrate = 5'000'000;
  EXPECT_TRUE(check_bus_load(robot, kMs).empty());
  robot.buses[0].data_bitrate = 2'000'000;
  EXPECT_TRUE(check_bus_load(robot, 1'700'000).empty());
  EXPECT_FALSE(check_bus_load(robot, 1'650'000).empty());
}

/// The table counts what the master and the boards really send.
TEST(BusLoad, CountsTheFramesOfARun) {
  constexpr int kCycles = 2000;
  Rig rig;
  rig.bring_up();
  const std::uint64_t before = rig.legs.passed();
  rig.steps(kCycles);
  const double per_cycle = static_cast<double>(rig.legs.passed() - before) / kCycles;
  const auto loads = bus_loads(rig.robot, kMs);
  ASSERT_TRUE(loads);
  double counted = 0.0;
  for (const BusLoadRow& one : (*loads)[0].rows) {
    const bool sent = one.kind != BusLoadRow::Kind::kOnChange && one.what != "SDO, reserved";
    counted += sent ? one.frames : 0.0;
  }
  EXPECT_NEAR(per_cycle, counted, 0.02);
}

}  // namespace
}  // namespace tandem::hal::can
