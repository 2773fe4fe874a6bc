#include "hal/sim/sim_robot.hpp"

#include <algorithm>
#include <cmath>

#include "canopen/messages.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/sim/emulator.hpp"
#include "tests/sim/swing_loop.hpp"

namespace tandem::sim {
namespace {

using test::swing_kernels;
using test::swing_robot;
using Loop = test::SwingLoop;

TEST(SimRobot, PowersOnHeldAndThenHoldsByItself) {
  for (const int order : {0, 1, 2, 3}) {
    Loop loop(swing_robot(order), {.posture = "up"}, order);
    double lowest = 1.0;
    for (int i = 0; i < 5000 && loop.sim_robot->phase() != hal::Phase::kOperational; ++i) {
      loop.step();
      lowest = std::min(lowest, loop.sim_robot->truth().position_rad()[0]);
    }
    ASSERT_EQ(loop.sim_robot->phase(), hal::Phase::kOperational) << loop.sim_robot->status_text();
    EXPECT_GT(lowest, 0.47) << "order " << order;
    loop.run(5000);
    EXPECT_EQ(loop.read, Code::kOk) << "order " << order << loop.sim_robot->status_text();
    EXPECT_NEAR(loop.state.position_rad()[0], loop.command.position_rad()[0], 1e-3)
        << "order " << order;
  }
}

TEST(SimRobot, MeasuresWhatIsTrueWithinQuantisationAndNoise) {
  Loop loop(swing_robot());
  loop.bring_up();
  loop.command.position_rad()[0] += 0.1;
  for (int i = 0; i < 1000; ++i) {
    loop.step();
    const hal::TruthImage& truth = loop.sim_robot->truth();
    ASSERT_EQ(truth.cycle()[0], loop.state.cycle()[0]);
    ASSERT_NEAR(loop.state.position_rad()[0], truth.position_rad()[0], 2.5e-5);
    // 2 Nm of noise's bound 0.06, and a per mille of 50 Nm on the wire
    ASSERT_NEAR(loop.state.torque_Nm()[0], truth.torque_Nm()[0], 0.06 + 0.05);
  }
  EXPECT_GT(loop.sim_robot->truth().position_rad()[0], 0.55);
}

TEST(SimRobot, StateFieldsAreEachTheirOwn) {
  // Against a velocity in the position's place, an acceleration in the velocity's, and the like.
  Loop loop(swing_robot());
  loop.bring_up();
  loop.run(1000);
  double way = 0.0, change = 0.0;
  const double from = loop.state.position_rad()[0];
  const double start_rate = loop.state.velocity_rad_s()[0];
  for (int i = 0; i < 400; ++i) {
    loop.command.position_rad()[0] += 0.0005;
    loop.step();
    way += loop.state.velocity_rad_s()[0] * 1e-3;
    change += loop.state.acceleration_rad_s2()[0] * 1e-3;
    const JointReading joint = loop.sim_robot->plant().joint(0);
    ASSERT_NEAR(loop.state.motor_position_rad()[0], joint.motor_position_rad, 1e-5);
    ASSERT_NEAR(loop.state.current_A()[0], joint.current_A, 0.2);
    ASSERT_NEAR(loop.state.temperature_C()[0], joint.temperature_C, 0.11);
  }
  const double moved = loop.state.position_rad()[0] - from;
  EXPECT_GT(moved, 0.1);
  EXPECT_NEAR(way, moved, 0.02 * moved);
  EXPECT_NEAR(change, loop.state.velocity_rad_s()[0] - start_rate, 0.05);
}

TEST(SimRobot, SensorsTravelThroughTheirNodes) {
  Loop loop(swing_robot());
  loop.bring_up();
  loop.run(3000);
  const auto imu = loop.state.sensor_values(0);
  const double angle = loop.sim_robot->truth().position_rad()[0];
  EXPECT_NEAR(imu[1], std::sin(angle / 2.0), 1e-6);
  EXPECT_NEAR(imu[3], std::cos(angle / 2.0), 1e-6);
  EXPECT_NEAR(imu[7], -9.81 * std::sin(angle), 0.1);
  EXPECT_NEAR(imu[9], 9.81 * std::cos(angle), 0.1);
  const auto root = loop.state.sensor_values(1);
  EXPECT_NEAR(root[0], 2.0 * 9.81 * std::sin(angle), 0.01);
  EXPECT_NEAR(root[2], -2.0 * 9.81 * std::cos(angle), 0.01);
  EXPECT_NEAR(root[4], -0.5 * root[0], 1e-5);
}

TEST(SimRobot, SnapshotGivesTheSameBytesAgain) {
  for (const int at : {0, 3, 57, 400, 1500}) {  // bring-up, and in motion
    Loop loop(swing_robot());
    loop.run(at);
    const auto on = [&] {
      for (int i = 0; i < 700; ++i) {
        loop.command.position_rad()[0] += 1e-4;
        loop.step();
      }
      return loop.bytes();
    };
    const std::vector<std::byte> saved = loop.bytes();
    const std::vector<std::byte> first = on();
    Archive restore(saved);
    ASSERT_TRUE(loop.sim_robot->archive(restore));
    restore(loop.state, loop.command, loop.time);
    ASSERT_TRUE(restore.ok());
    ASSERT_TRUE(restore.at_end());
    ASSERT_EQ(loop.bytes(), saved) << "cycle " << at;
    EXPECT_EQ(on(), first) << "cycle " << at;
  }
}

TEST(SimRobot, SnapshotGoesOnInAnotherProcessesRobot) {
  Loop loop(swing_robot()), other(swing_robot());
  loop.run(900);
  other.run(17);
  Archive restore(loop.bytes());
  ASSERT_TRUE(other.sim_robot->archive(restore));
  restore(other.state, other.command, other.time);
  ASSERT_TRUE(restore.ok() && restore.at_end());
  loop.run(500);
  other.run(500);
  EXPECT_EQ(loop.bytes(), other.bytes());
}

TEST(SimRobot, RunsDependOnTheSeedAlone) {
  const auto run = [](std::uint64_t seed) {
    Loop loop(swing_robot(), {.posture = "up", .seed = seed});
    loop.run(800);
    return std::vector<std::byte>(loop.state.bytes().begin(), loop.state.bytes().end());
  };
  EXPECT_EQ(run(1), run(1));
  EXPECT_NE(run(1), run(2));
}

TEST(SimRobot, FasterBoardsRunBetweenTheCycles) {
  Loop loop(swing_robot(2, "250_000"));
  loop.bring_up();
  loop.command.position_rad()[0] += 0.05;
  loop.run(4000);
  EXPECT_EQ(loop.read, Code::kOk);
  EXPECT_NEAR(loop.sim_robot->truth().position_rad()[0], loop.command.position_rad()[0], 2e-3);
}

TEST(SimRobot, AnUnpluggedEncoderIsThatJointsFault) {
  Loop loop(swing_robot());
  loop.bring_up();
  ScenarioFault unplugged;
  unplugged.kind = hal::FaultKind::kEncoderUnplug;
  unplugged.joint = 0;
  unplugged.duration_ns = 5'000'000;
  ASSERT_EQ(loop.sim_robot->robot().inject(unplugged), Code::kOk);
  loop.run(20);
  EXPECT_NE(loop.state.fault()[0], 0U);
  EXPECT_EQ(loop.sim_robot->phase(), hal::Phase::kFault);
  EXPECT_NE(loop.sim_robot->status_text().find("swing"), std::string::npos)
      << loop.sim_robot->status_text();
}

TEST(SimRobot, ACutCableLeavesTheBoardInItsSafeState) {
  Loop loop(swing_robot());
  loop.bring_up();
  loop.sim_robot->robot().bus(0).set_connected(false);
  loop.run(2500);
  EXPECT_GT(loop.state.age_cycles()[0], 2400U);
  EXPECT_EQ(loop.sim_robot->phase(), hal::Phase::kFault);
  EXPECT_EQ(loop.sim_robot->plant().joint(0).voltage_V, 0.0);
}

TEST(SimRobot, DivergenceIsAFaultThatNamesJointAndTime) {
  Loop loop(swing_robot(), {.posture = "up", .rate_limit = 0.5});
  loop.bring_up();
  loop.command.position_rad()[0] += 0.5;
  for (int i = 0; i < 1000 && loop.read != Code::kDiverged; ++i) loop.step();
  ASSERT_EQ(loop.read, Code::kDiverged);
  EXPECT_EQ(loop.sim_robot->phase(), hal::Phase::kFault);
  const std::string text = loop.sim_robot->status_text();
  EXPECT_NE(text.find("joint swing at "), std::string::npos) << text;
}

TEST(SimRobot, AnUnstableSubStepIsRefusedWithTheJoint) {
  hal::RobotConfig robot = swing_robot();
  robot.actuators[0].spring_Nm_rad = 5e7;
  const auto made = SimRobot::create(robot, swing_kernels(2), {});
  ASSERT_FALSE(made.has_value());
  EXPECT_EQ(made.error().key, "sim.substep_ns");
  EXPECT_NE(made.error().message.find("joint swing"), std::string::npos) << made.error().message;
}

TEST(SimRobot, StagesAreReportedInOrder) {
  Loop loop(swing_robot());
  std::vector<SimStage> stages;
  stages.reserve(kSimStages);  // the hook runs in the cycle
  loop.sim_robot->set_stage_hook({[](void* context, SimStage stage) {
                                    static_cast<std::vector<SimStage>*>(context)->push_back(stage);
                                  },
                                  &stages});
  loop.run(1);
  EXPECT_EQ(stages,
            (std::vector<SimStage>{SimStage::kMasterSync, SimStage::kPlant, SimStage::kSense,
                                   SimStage::kBoards, SimStage::kMasterDecode, SimStage::kTruth}));
}

TEST(EmulatedRobot, FramesAfterSyncWaitForTheNextStep) {
  const hal::RobotConfig config = swing_robot();
  auto made = EmulatedRobot::create(config, swing_kernels(2), {.posture = "up"});
  ASSERT_TRUE(made.has_value());
  EmulatedRobot& robot = **made;
  const auto reset = canopen::make_nmt(canopen::NmtCommand::kResetNode, 0);
  const std::array frames{canopen::make_sync(), reset};
  std::array<canopen::Frame, 8> answers;
  robot.bus(0).master().send(frames);
  EXPECT_EQ(robot.step(0), Code::kOk);
  EXPECT_EQ(robot.bus(0).to_boards().size(), 1U);
  const std::size_t first = robot.bus(0).master().receive(answers);
  robot.bus(0).master().send(std::span(frames).first(1));
  EXPECT_EQ(robot.step(1'000'000), Code::kOk);
  EXPECT_TRUE(robot.bus(0).to_boards().empty());
  const std::size_t second = robot.bus(0).master().receive(answers);
  EXPECT_EQ(first, second) << "each step answers one boot-up per node, after a power-on or a reset";
  EXPECT_GT(second, 0U);
}

TEST(SimRobot, AnUnknownPostureSuggestsTheNearest) {
  const auto made =
      SimRobot::create(swing_robot(), swing_kernels(2), SimRobotConfig{.posture = "upp"});
  ASSERT_FALSE(made.has_value());
  EXPECT_NE(made.error().to_string().find("up"), std::string::npos);
}

/// The robot alone, and what it says to whom writes to it byte by byte.
struct BareRobot {
  explicit BareRobot(bool bus_timing = false) {
    SimRobotConfig config{.posture = "up"};
    config.bus_timing = bus_timing;
    auto made = EmulatedRobot::create(swing_robot(), swing_kernels(2), config);
    EXPECT_TRUE(made.has_value());
    robot = std::move(*made);
    step(3);
  }
  void send(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
    const std::array frames{canopen::make_frame(id, bytes)};
    (void)robot->bus(0).master().send(frames);
    step(2);
  }
  void step(int steps) {
    for (int i = 0; i < steps; ++i) {
      EXPECT_EQ(robot->step(time_ns), Code::kOk);
      time_ns += 1'000'000;
      std::array<canopen::Frame, 64> batch;
      const std::size_t count = robot->bus(0).master().receive(batch);
      seen.insert(seen.end(), batch.begin(), batch.begin() + count);
    }
  }
  [[nodiscard]] auto count(std::uint32_t id) const {
    return std::ranges::count(seen, id, &canopen::Frame::id);
  }
  std::unique_ptr<EmulatedRobot> robot;
  std::vector<canopen::Frame> seen;
  std::int64_t time_ns = 0;
};

TEST(SimRobot, ABoardHearsTheHeartbeatOfAnotherNodeThat1016Names) {
  for (const bool timed : {false, true}) {
    BareRobot bare(timed);
    bare.send(0x614, {0x2B, 0x17, 0x10, 0, 20, 0, 0, 0});      // node 20: a heartbeat every 20 ms
    bare.send(0x601, {0x23, 0x16, 0x10, 1, 100, 0, 0x14, 0});  // node 1: node 20's, 100 ms
    bare.step(300);
    EXPECT_GE(bare.count(0x714), 10) << "timed: " << timed;
    EXPECT_EQ(bare.count(0x081), 0) << "timed: " << timed;
    bare.send(0x000, {0x82, 20});  // node 20 forgets its heartbeat
    bare.step(150);
    ASSERT_EQ(bare.count(0x081), 1) << "timed: " << timed;
    const auto emergency = std::ranges::find(bare.seen, 0x081u, &canopen::Frame::id);
    EXPECT_EQ(emergency->data[0] | emergency->data[1] << 8, 0x8130);
  }
}

/// A clock that waiting moves on.
struct PlayedWait final : hal::can::FrameWait {
  std::int64_t now_ns() noexcept override { return time_ns; }
  void wait(std::int64_t at_most_ns, int) noexcept override { time_ns += at_most_ns; }
  std::int64_t time_ns = 1;
};

TEST(Emulator, WithoutSyncTheBoardsTimeIsThatOfTheClock) {
  BareRobot bare;
  hal::can::LoopbackBus wire;
  std::array<hal::can::Bus*, 1> far{&wire.boards()};
  PlayedWait clock;
  Emulator emulator(*bare.robot, far, clock, {.period_ns = 1'000'000});
  while (clock.time_ns < 1'000'000'000) (void)emulator.poll(100'000);
  EXPECT_NEAR(static_cast<double>(emulator.statistics().steps), 1000.0, 1.0);
  EXPECT_EQ(emulator.statistics().slipped, 0u);
  const std::array sync{canopen::make_sync()};
  for (int cycle = 0; cycle < 1000; ++cycle) {
    (void)wire.master().send(sync);
    const std::int64_t until_ns = clock.time_ns + 1'000'000;
    while (clock.time_ns < until_ns) (void)emulator.poll(until_ns - clock.time_ns);
  }
  EXPECT_NEAR(static_cast<double>(emulator.statistics().steps), 2000.0, 2.0);
}

}  // namespace
}  // namespace tandem::sim
