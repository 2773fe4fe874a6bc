#include "hal/ethercat-can/sdo_sequence.hpp"

#include "hal/ethercat-can/node_master.hpp"
#include "tests/canopen/wire.hpp"
#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using canopen::wire;
using test::robot_config;

const SdoStep* find(const std::vector<SdoStep>& steps, int index, int sub, bool last = false) {
  const SdoStep* found = nullptr;
  for (const SdoStep& step : steps) {
    if (step.index != index || step.sub != sub) continue;
    if (found == nullptr || last) found = &step;
  }
  return found;
}

TEST(SdoSequence, MapsAPdoByTheStandardsProcedure) {
  const RobotConfig robot = robot_config();
  const auto layout = make_pdo_layout(robot);
  ASSERT_TRUE(layout);
  const auto steps = make_configuration(robot, layout->nodes[0]);
  std::vector<std::pair<int, int>> order;
  std::vector<std::uint32_t> cob_ids;
  for (const SdoStep& step : steps) {
    if (step.index != 0x1400 && step.index != 0x1600) continue;
    order.emplace_back(step.index, step.sub);
    if (step.index == 0x1400 && step.sub == 1) {
      cob_ids.push_back(canopen::get<std::uint32_t>(step.bytes.data()));
    }
  }
  ASSERT_EQ(order.size(), 16u);
  EXPECT_EQ(order[0], (std::pair{0x1400, 1}));
  EXPECT_EQ(order[1], (std::pair{0x1600, 0}));
  EXPECT_EQ(order[2], (std::pair{0x1600, 1}));
  EXPECT_EQ(order[13], (std::pair{0x1600, 0}));
  EXPECT_EQ(order[14], (std::pair{0x1400, 2}));
  EXPECT_EQ(order[15], (std::pair{0x1400, 1}));
  EXPECT_EQ(cob_ids, (std::vector<std::uint32_t>{0x8000020A, 0x0000020A}));
  EXPECT_EQ(find(steps, 0x1600, 3)->bytes, (std::array<std::uint8_t, 4>{0x20, 0x00, 0x7A, 0x60}));
}

/// KickCAT's ESI of a drive has product 03B11002, and 32 in the dictionary's 1018.
TEST(SdoSequence, AnIdentityThatTheSheetContradictsIsTheInformationMemorysOnALine) {
  RobotConfig robot = robot_config();
  canopen::DataSheet sheet = *robot.boards[0].sheet;
  sheet.product = 0x03B11002;
  const auto layout = make_pdo_layout(robot);
  ASSERT_TRUE(layout);
  NodePlan node = layout->nodes[0];
  for (const bool line : {false, true}) {
    for (const std::uint32_t told : {0x32u, 0x03B11002u}) {
      for (canopen::SheetEntry& entry : sheet.entries) {
        if (entry.index == 0x1018 && entry.sub == 2) entry.value = canopen::SheetValue{told};
      }
      robot.boards[0].sheet = std::make_shared<const canopen::DataSheet>(sheet);
      node.ethercat = line;
      const SdoStep* check = find(make_configuration(robot, node), 0x1018, 2);
      EXPECT_EQ(check == nullptr, line && told == 0x32) << line << told;
    }
  }
}

TEST(SdoSequence, WritesTheProtections) {
  RobotConfig robot = robot_config();
  robot.actuators[0].continuous_current_A = 12.0;
  robot.actuators[0].thermal_time_s = 60.0;
  robot.actuators[0].temperature_limit_C = 110.0;
  robot.joints[1].following_error_rad = 0.25 * test::kPi;
  robot.joints[1].following_timeout_s = 0.05;
  robot.joints[1].oscillation_time_s = 0.5;
  robot.joints[1].max_excess = 0.5;
  robot.joints[1].excess_time_s = 0.25;
  robot.joints[1].max_swing = 0.125;
  robot.joints[1].max_velocity_rad_s = 8.0;
  robot.joints[1].max_torque_rate_Nm_s = 2.0 * robot.joints[1].rated_torque_Nm;
  robot.joints[1].brake = BrakeConfig{.torque_Nm = 9.0, .release_ms = 40, .engage_ms = 10};
  const auto layout = make_pdo_layout(robot);
  ASSERT_TRUE(layout);
  const auto steps = make_configuration(robot, layout->nodes[0]);
  const auto value = [&](std::uint16_t index, std::uint8_t sub) {
    return canopen::get<std::uint32_t>(find(steps, index, sub)->bytes.data());
  };
  EXPECT_EQ(value(0x2031, 1), 0x41400000u) << "12.0";
  EXPECT_EQ(value(0x2031, 2), 0x42700000u) << "60.0";
  EXPECT_EQ(value(0x2034, 0), 1100u);
  EXPECT_EQ(value(0x6865, 0), 4500u) << "45 degrees of 36000 counts";
  EXPECT_EQ(value(0x6866, 0), 50u);
  EXPECT_EQ(value(0x2839, 2), 0x3F000000u) << "0.5";
  EXPECT_EQ(value(0x283B, 1), 0x3F000000u) << "0.5";
  EXPECT_EQ(value(0x283B, 2), 0x3E800000u) << "0.25";
  EXPECT_EQ(value(0x283C, 0), 0x3F800000u) << "1.0";
  EXPECT_EQ(value(0x6887, 0), 2000u) << "per mille of rated torque and second";
  EXPECT_EQ(value(0x283A, 1), 1u);
  EXPECT_EQ(value(0x283A, 2), 40u);
  EXPECT_EQ(value(0x283A, 3), 10u);
  EXPECT_EQ(find(steps, 0x203A, 1), nullptr) << "axis 0 has no brake: nothing is written";
}

/// 2 pi rad/s^2 of 36000 counts a revolution: on our boards, and on a drive by its sheet.
TEST(SdoSequence, WritesTheDecelerationOfAQuickStopWhereItIsGiven) {
  for (const bool ours : {true, false}) {
    RobotConfig robot = robot_config();
    canopen::DataSheet sheet = *robot.boards[0].sheet;
    if (!ours)
      std::erase_if(sheet.entries, [](const auto& e) { return (e.index & 0x7FF) == 0x33; });
    robot.boards[0].sheet = std::make_shared<const canopen::DataSheet>(sheet);
    robot.joints[1].drive.stop_deceleration_rad_s2 = 2.0 * test::kPi;
    const auto layout = make_pdo_layout(robot);
    ASSERT_TRUE(layout);
    ASSERT_EQ(layout->nodes[0].abilities[1].settings, ours);
    const auto steps = make_configuration(robot, layout->nodes[0]);
    const SdoStep* step = find(steps, 0x6885, 0);
    ASSERT_NE(step, nullptr) << ours;
    EXPECT_EQ(step->size, 4);
    EXPECT_EQ(step->bytes, (std::array<std::uint8_t, 4>{0xA0, 0x8C, 0x00, 0x00}));
    EXPECT_EQ(find(steps, 0x6085, 0), nullptr) << "axis 0 keeps its own";
  }
}

TEST(SdoSequence, WritesTheSecondAxis800Higher) {
  const RobotConfig robot = robot_config();
  const auto layout = make_pdo_layout(robot);
  ASSERT_TRUE(layout);
  const auto steps = make_configuration(robot, layout->nodes[0]);
  const SdoStep* rated = find(steps, 0x6876, 0);
  ASSERT_NE(rated, nullptr);
  EXPECT_EQ(rated->bytes, (std::array<std::uint8_t, 4>{0x50, 0xC3, 0x00, 0x00}));  // 50000 mNm
  EXPECT_EQ(rated->axis, 1);
  const SdoStep* kp = find(steps, 0x2820, 1);
  ASSERT_NE(kp, nullptr);
  EXPECT_EQ(kp->bytes, (std::array<std::uint8_t, 4>{0x00, 0x00, 0xC8, 0x43}));  // 400.0
}

/// A node that is played by the test, frame by frame.
struct ScriptedNode : ::testing::Test {
  std::vector<SdoStep> steps = {[] {
                                  SdoStep step = write_step(0x1018, 2, std::uint32_t{0x402});
                                  step.use = SdoUse::kCheck;
                                  return step;
                                }(),
                                write_step(0x1017, 0, std::uint16_t{50})};
  NodeMaster node{5, 50, 500'000'000, NodeWatch::kHeartbeat, steps};
  std::array<Frame, 8> storage{};
  canopen::FrameSink sink{storage};
  std::int64_t now_ns = 0;

  void SetUp() override { node.restart(0); }
  std::vector<Frame> wait(int ms) {
    sink.clear();
    now_ns += ms * 1'000'000LL;
    node.process(now_ns, ms * 1'000'000LL, sink);
    return {sink.frames().begin(), sink.frames().end()};
  }
  void boot() { node.on_heartbeat(canopen::NmtState::kBootUp, now_ns); }
  void answer(std::initializer_list<int> bytes) { node.on_sdo(wire(0x585, bytes), sink); }
  void configure() {
    boot();
    (void)wait(1);
    answer({0x43, 0x18, 0x10, 0x02, 0x02, 0x04, 0, 0});
    (void)wait(1);
    answer({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    (void)wait(1);
  }
};

TEST_F(ScriptedNode, IsResetReadWrittenAndStarted) {
  EXPECT_EQ(wait(0), std::vector<Frame>{wire(0x000, {0x81, 0x05})});
  boot();
  EXPECT_EQ(wait(1), std::vector<Frame>{wire(0x605, {0x40, 0x18, 0x10, 0x02, 0, 0, 0, 0})});
  EXPECT_TRUE(wait(1).empty()) << "no answer yet";
  answer({0x43, 0x18, 0x10, 0x02, 0x02, 0x04, 0, 0});
  EXPECT_EQ(wait(1), std::vector<Frame>{wire(0x605, {0x2B, 0x17, 0x10, 0x00, 50, 0, 0, 0})});
  answer({0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_TRUE(wait(1).empty());
  EXPECT_EQ(node.stage(), NodeStage::kReady);
  node.start(now_ns, sink);
  EXPECT_EQ(sink.frames().back(), wire(0x000, {0x01, 0x05}));
  node.on_heartbeat(canopen::NmtState::kOperational, now_ns);
  EXPECT_TRUE(node.running());
}

TEST_F(ScriptedNode, IsResetOnceMoreWhenItDoesNotBootInItsTimeAndThenGivenUp) {
  (void)wait(0);
  EXPECT_TRUE(wait(499).empty());
  EXPECT_EQ(wait(1).size(), 1u);
  (void)wait(499);
  EXPECT_EQ(node.error(), FaultCause::kNone);
  (void)wait(1);
  EXPECT_EQ(node.error(), FaultCause::kNoBootUp);
}

TEST_F(ScriptedNode, IsAskedThreeTimesBeforeTheSdoTimesOut) {
  boot();
  (void)wait(1);
  int requests = 0;
  for (int ms = 0; ms < 1600; ++ms) {
    for (const Frame& frame : wait(1)) requests += frame.data[0] == 0x40 ? 1 : 0;
  }
  EXPECT_EQ(requests, 2) << "besides the first";
  EXPECT_EQ(node.error(), FaultCause::kBoardRefused);
  EXPECT_EQ(node.abort_code(), canopen::AbortCode::kTimeout);
}

TEST_F(ScriptedNode, IsRefusedWithAnotherIdentity) {
  boot();
  (void)wait(1);
  answer({0x43, 0x18, 0x10, 0x02, 0x03, 0x04, 0, 0});
  (void)wait(1);
  EXPECT_EQ(node.error(), FaultCause::kWrongIdentity);
  EXPECT_EQ(node.read_value(), 0x403u);
}

TEST_F(ScriptedNode, ThatDoesNotStartIsReported) {
  configure();
  ASSERT_EQ(node.stage(), NodeStage::kReady);
  node.start(now_ns, sink);
  for (int ms = 0; ms < 1100; ms += 50) {
    node.on_heartbeat(canopen::NmtState::kPreOperational, now_ns);
    (void)wait(50);
  }
  EXPECT_EQ(node.error(), FaultCause::kNotOperational);
}

TEST_F(ScriptedNode, ThatLeavesOperationalByItselfIsReported) {
  configure();
  node.start(now_ns, sink);
  node.on_heartbeat(canopen::NmtState::kOperational, now_ns);
  node.on_heartbeat(canopen::NmtState::kPreOperational, now_ns);
  EXPECT_EQ(node.error(), FaultCause::kBoardStopped);
}

TEST_F(ScriptedNode, ThatRebootsAgainAndAgainIsGivenUp) {
  boot();
  for (int i = 0; i < 3; ++i) {
    now_ns += 1'000'000;
    boot();
    EXPECT_EQ(node.stage(), NodeStage::kConfigure);
  }
  now_ns += 1'000'000;
  boot();
  EXPECT_EQ(node.error(), FaultCause::kBoardRebooted);
}

TEST_F(ScriptedNode, ThatBootsTwiceInACycleIsTwoNodes) {
  boot();
  boot();
  EXPECT_EQ(node.error(), FaultCause::kTwoBoards);
}

}  // namespace
}  // namespace tandem::hal::can
