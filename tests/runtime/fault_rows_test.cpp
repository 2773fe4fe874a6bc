// The rows of docs/faults.md, one test each: what goes wrong, how it is noticed, what follows, and
// after how many cycles. The page's numbers are what is expected here.
// Master, loop, controllers, boards, sensor nodes and joints.
#include <csignal>

#include "rt/stop_signal.hpp"
#include "tests/runtime/fault_row.hpp"

namespace tandem::runtime {
namespace {

using namespace test;
using sim::ScenarioFault;

/// Notices by the boards: an axis that is in a fault, or on its way into one.
bool board_noticed(const FaultRig& rig) {
  for (std::size_t b = 0; b < rig.robot.boards.size(); ++b) {
    if (rig.axis(b).objects().error_code != 0) return true;
  }
  return false;
}

/// The boards by themselves, as `rig` has no master any more.
Outcome watch_without_master(FaultRig& rig) {
  Outcome found;
  for (int i = 1; i <= 4000 && found.open < 0; ++i) {
    rig.backend->without_master();
    rig.note(found, i, board_noticed(rig));
  }
  return found;
}

INSTANTIATE_TEST_SUITE_P(Robots, FaultRow, testing::Values("ur5e", "coman"),
                         [](const auto& one) { return std::string(one.param); });

// --- the master and its loop ---

TEST_P(FaultRow, MasterDies) {
  RowRig rig(GetParam());
  rig.run();
  expect_row(watch_without_master(rig));
  for (std::size_t b = 0; b < rig.robot.boards.size(); ++b)
    EXPECT_EQ(rig.axis(b).objects().error_code, 0x8700);
}

TEST_P(FaultRow, LoopStallsForTenCycles) {
  RowRig rig(GetParam());
  rig.run();
  for (int i = 0; i < 10; ++i) rig.backend->without_master();
  for (int i = 0; i < 100; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST_P(FaultRow, LoopStallsForLonger) {
  RowRig rig(GetParam());
  rig.run();
  Outcome found;
  for (int i = 1; i <= 2000 && found.open < 0; ++i) {
    if (i <= 25) {
      rig.backend->without_master();
    } else {
      rig.step();
    }
    rig.note(found, i, board_noticed(rig));
  }
  expect_row(found);
  EXPECT_NE(rig.causes().find("0x8700"), std::string::npos) << rig.causes();
}

// What [overrun] does about it: RobotCycle.StopsWhenTooManyCyclesAreLate, CyclicLoop.
TEST_P(FaultRow, ControllerIsTooSlow) {
  RowRig rig(GetParam());
  rig.run();
  for (int i = 0; i < 200; ++i) {
    rig.step();
    rig.backend->without_master();
    rig.backend->without_master();
  }
  expect_running(rig);
  expect_row({});
}

// --- emergency stop ---

TEST_P(FaultRow, EmergencyStopByABoardsInput) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(of(FaultKind::kEmergencyStop));
  expect_row(rig.watch());
  expect_stopped(rig, "emergency stop");
}

TEST_P(FaultRow, EmergencyStopByRequest) {
  RowRig rig(GetParam());
  rig.run();
  rig.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("emergency stop on request"), std::string::npos) << rig.causes();
}

TEST_P(FaultRow, EmergencyStopWhileHeldAfterAReset) {
  RowRig rig(GetParam(), {}, hal::StopCategory::kHold);
  rig.run();
  ScenarioFault unplugged = of(FaultKind::kEncoderUnplug);
  unplugged.duration_ns = 5'000'000;
  rig.inject(unplugged);
  for (int i = 0; i < 100; ++i) rig.step();
  ASSERT_EQ(rig.cycle->phase(), RunPhase::kFaulted);
  rig.cycle->inbox().reset_faults();
  for (int i = 0; i < 5000 && rig.cycle->phase() != RunPhase::kHeld; ++i) rig.step();
  ASSERT_EQ(rig.cycle->phase(), RunPhase::kHeld) << rig.causes();
  for (std::size_t b = 0; b < rig.robot.boards.size(); ++b) {
    EXPECT_EQ(rig.axis(b).machine().motion(), DriveMotion::kFollow) << "enabled, and at rest";
  }
  const std::uint64_t ran = rig.cycle->running_cycles();
  for (int i = 0; i < 500; ++i) rig.step();
  EXPECT_EQ(rig.cycle->running_cycles(), ran) << "a reset is no start";
  rig.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  expect_row(rig.watch());
  EXPECT_EQ(rig.cycle->faults().at(1).text, "emergency stop on request");
}

TEST_P(FaultRow, EmergencyStopOfCategory0) {
  RowRig rig(GetParam());
  rig.run();
  rig.cycle->inbox().emergency_stop(hal::StopCategory::kCategory0);
  const Outcome found = rig.watch();
  expect_row(found);
  EXPECT_EQ(found.open, found.safe) << "no braking";
}

TEST_P(FaultRow, EmergencyStopBySignal) {
  rt::install_emergency_signal();
  RowRig rig(GetParam());
  rig.run();
  ASSERT_EQ(::raise(SIGUSR1), 0);
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("emergency stop by a signal"), std::string::npos) << rig.causes();
}

// --- boards and sensor nodes ---

TEST_P(FaultRow, BoardResets) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(of(FaultKind::kBoardReset));
  expect_row(rig.watch());
  expect_stopped(rig, "booted again by itself");
}

TEST_P(FaultRow, BoardDies) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(of(FaultKind::kBoardKill));
  expect_row(rig.watch());
  EXPECT_EQ(rig.backend->emulated->plant().joint(0).current_A, 0.0);
  expect_stopped(rig, "no complete TPDO for 10 cycles");
}

TEST_P(FaultRow, TwoBoardsShareANodeId) {
  RowRig rig(GetParam(), {of(FaultKind::kBoardDuplicate)});
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("two nodes answer under this id"), std::string::npos) << rig.causes();
}

TEST_P(FaultRow, AnswersComeTwice) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = lose(kFeedbackOfBoard0, 0);
  fault.kind = FaultKind::kFrameDuplicate;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "two nodes answer under this id");
}

TEST_P(FaultRow, WrongIdentity) {
  ScenarioFault fault = of(FaultKind::kBoardIdentity);
  fault.number = 0x1234;
  RowRig rig(GetParam(), {fault});
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("wrong product code"), std::string::npos) << rig.causes();
}

TEST_P(FaultRow, WrongFirmwareVersion) {
  ScenarioFault fault = of(FaultKind::kBoardRevision);
  fault.number = 0x00020000;
  RowRig rig(GetParam(), {fault});
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("wrong revision"), std::string::npos) << rig.causes();
}

TEST_P(FaultRow, NodeMissingAtStart) {
  RowRig rig(GetParam(), {of(FaultKind::kBoardKill)});
  expect_row(rig.watch(6000));
  EXPECT_NE(rig.causes().find("no boot-up message within 3 s"), std::string::npos) << rig.causes();
}

TEST_P(FaultRow, SensorNodeDies) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = of(FaultKind::kBoardKill);
  fault.board = -1;
  fault.sensor = 0;
  rig.inject(fault);
  Outcome found;
  for (int i = 1; i <= 200; ++i) {
    rig.step();
    if (found.noticed < 0 && !rig.cycle->faults().empty()) found.noticed = i;
  }
  expect_row(found);
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kRunning) << "it moves nothing";
  EXPECT_EQ(rig.cycle->faults()[0].joint, rig.robot.sensors[0].name);
  for (std::size_t b = 0; b < rig.robot.boards.size(); ++b) {
    EXPECT_EQ(rig.axis(b).machine().motion(), DriveMotion::kFollow);
  }
}

// --- joints ---

TEST_P(FaultRow, EncoderFreezes) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(of(FaultKind::kEncoderFreeze));
  expect_row(rig.watch());
  expect_stopped(rig, "0x7320");
}

TEST_P(FaultRow, EncoderFreezesAtRest) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = of(FaultKind::kEncoderFreeze);
  fault.joint = 2;  // is held
  rig.inject(fault);
  for (int i = 0; i < 500; ++i) rig.step();
  expect_running(rig);
  expect_row({});
  const double from_rad = rig.cycle->command().position_rad()[2];
  ASSERT_TRUE(rig.cycle->services().move_joint(rig.robot.joints[2].name,
                                               {.target_rad = from_rad + 0.05}, kNow));
  EXPECT_GT(rig.watch().safe, 0) << "it did freeze";
  EXPECT_NE(rig.causes().find("0x7320"), std::string::npos) << rig.causes();
}

TEST_P(FaultRow, EncoderJumps) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = of(FaultKind::kEncoderJump);
  fault.value = 0.05;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "0x7320");
}

TEST_P(FaultRow, EncoderUnplugged) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(of(FaultKind::kEncoderUnplug));
  expect_row(rig.watch());
  expect_stopped(rig, "0x7300");
}

TEST(FaultRow, SpringBreaks) {
  FaultRig rig(tandem::test::swing_robot(), tandem::test::swing_kernels(2), "up");
  rig.run();
  rig.inject(of(FaultKind::kSpringBreak));
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("0x7320"), std::string::npos) << rig.causes();
}

TEST(FaultRow, SpringOfComanBreaks) {
  RowRig rig("coman");
  rig.run();
  rig.inject(of(FaultKind::kSpringBreak));
  expect_row(rig.watch());
  expect_stopped(rig, "0x7320");
}

TEST_P(FaultRow, MotorOverheats) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = of(FaultKind::kMotorOverheat);
  fault.value = 130.0;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "0x4310");
}

TEST_P(FaultRow, MotorGetsHot) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = of(FaultKind::kMotorOverheat);
  fault.value = 110.0;
  rig.inject(fault);
  expect_row(rig.watch(200));
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kRunning) << "the run continues";
  const std::vector<runtime::FaultReport> told = rig.cycle->faults();
  ASSERT_EQ(told.size(), 1U) << "once";
  EXPECT_EQ(told[0].joint, rig.robot.joints[0].name);
  EXPECT_EQ(told[0].category, hal::StopCategory::kWarn);
  EXPECT_TRUE(told[0].text.starts_with("its motor's winding is hot, 110 degC: ")) << told[0].text;
}

TEST_P(FaultRow, SupplySags) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = of(FaultKind::kSupplySag);
  fault.value = 20.0;  // of 48 V
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "0x3100");
}

TEST_P(FaultRow, JointRings) {
  RowRig rig(GetParam());
  rig.run();
  const hal::JointConfig& joint = rig.robot.joints[0];
  const auto gains = std::ranges::find(rig.robot.gains, joint.gains, &hal::GainsConfig::name);
  ASSERT_NE(gains, rig.robot.gains.end());
  ASSERT_TRUE(rig.cycle->services().set_gains(
      joint.name, hal::PidLoop::kPosition,
      {.kp = 175.0 * gains->position.gains.kp, .kd = 50.0 * gains->position.gains.kd}, kNow));
  expect_row(rig.watch());
  expect_stopped(rig, "0xFF03");
  EXPECT_NE(rig.causes().find("the joint oscillates"), std::string::npos) << rig.causes();
}

TEST(FaultRow, JointSwings) {
  RowRig rig("ur5e");
  rig.run();
  ASSERT_TRUE(rig.cycle->services().set_gains(rig.robot.joints[1].name, hal::PidLoop::kPosition,
                                              {.kp = 1000.0, .ki = 8000.0, .kd = 0.0}, kNow));
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("the joint oscillates"), std::string::npos) << rig.causes();
}

TEST(FaultRow, JointSwingsOfPanda) {
  RowRig rig("panda");
  rig.run();
  ASSERT_TRUE(rig.cycle->services().set_gains(rig.robot.joints[2].name, hal::PidLoop::kPosition,
                                              {.kp = 400.0, .ki = 8000.0, .kd = 0.0}, kNow));
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("the joint oscillates"), std::string::npos) << rig.causes();
}

// --- controllers ---

TEST_P(FaultRow, ControllerGivesNaN) {
  RowRig rig(GetParam());
  rig.run();
  rig.sine->not_finite = true;
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("not a finite number"), std::string::npos) << rig.causes();
}

TEST_P(FaultRow, ControllerGivesUp) {
  RowRig rig(GetParam());
  rig.run();
  rig.sine->answer = Code::kOutOfRange;
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("the controller gave up"), std::string::npos) << rig.causes();
}

}  // namespace
}  // namespace tandem::runtime
