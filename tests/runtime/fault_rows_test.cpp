// The rows of docs/faults.md, one test each: what goes wrong, how it is noticed, what follows, and
// after how many cycles. The page's numbers are what is expected here.
// Master, loop, controllers, boards, sensor nodes and joints.
#include <csignal>

#include "rt/stop_signal.hpp"
#include "tests/runtime/fault_row.hpp"

namespace tandem::runtime {
namespace {

using namespace test;
using sim::Fault;

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

// --- the master and its loop ---

TEST(FaultRow, MasterDies) {
  ArmRig rig;
  rig.run();
  expect_row(watch_without_master(rig));
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(rig.axis(b).objects().error_code, 0x8700);
}

TEST(FaultRow, LoopStallsForTenCycles) {
  ArmRig rig;
  rig.run();
  for (int i = 0; i < 10; ++i) rig.backend->without_master();
  for (int i = 0; i < 100; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, LoopStallsForLonger) {
  ArmRig rig;
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

// --- emergency stop ---

TEST(FaultRow, EmergencyStopByABoardsInput) {
  ArmRig rig;
  rig.run();
  rig.inject(of(FaultKind::kEmergencyStop));
  expect_row(rig.watch());
  expect_stopped(rig, "emergency stop");
}

TEST(FaultRow, EmergencyStopByRequest) {
  ArmRig rig;
  rig.run();
  rig.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("emergency stop on request"), std::string::npos) << rig.causes();
}

TEST(FaultRow, EmergencyStopWhileHeldAfterAReset) {
  ArmRig rig({}, hal::StopCategory::kHold);
  rig.run();
  Fault unplugged = of(FaultKind::kEncoderUnplug);
  unplugged.duration_ns = 5'000'000;
  rig.inject(unplugged);
  for (int i = 0; i < 100; ++i) rig.step();
  ASSERT_EQ(rig.cycle->phase(), RunPhase::kFaulted);
  rig.cycle->inbox().reset_faults();
  for (int i = 0; i < 5000 && rig.cycle->phase() != RunPhase::kHeld; ++i) rig.step();
  ASSERT_EQ(rig.cycle->phase(), RunPhase::kHeld) << rig.causes();
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_EQ(rig.axis(b).machine().motion(), DriveMotion::kFollow) << "enabled, and at rest";
  }
  const std::uint64_t ran = rig.cycle->running_cycles();
  for (int i = 0; i < 500; ++i) rig.step();
  EXPECT_EQ(rig.cycle->running_cycles(), ran) << "a reset is no start";
  rig.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  expect_row(rig.watch());
  EXPECT_EQ(rig.cycle->faults().at(1).text, "emergency stop on request");
}

TEST(FaultRow, EmergencyStopOfCategory0) {
  ArmRig rig;
  rig.run();
  rig.cycle->inbox().emergency_stop(hal::StopCategory::kCategory0);
  const Outcome found = rig.watch();
  expect_row(found);
  EXPECT_EQ(found.open, found.safe) << "no braking";
}

TEST(FaultRow, EmergencyStopBySignal) {
  rt::install_emergency_signal();
  ArmRig rig;
  rig.run();
  ASSERT_EQ(::raise(SIGUSR1), 0);
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("emergency stop by a signal"), std::string::npos) << rig.causes();
}

// --- boards and sensor nodes ---

TEST(FaultRow, BoardResets) {
  ArmRig rig;
  rig.run();
  rig.inject(of(FaultKind::kBoardReset));
  expect_row(rig.watch());
  expect_stopped(rig, "booted again by itself");
}

TEST(FaultRow, BoardDies) {
  ArmRig rig;
  rig.run();
  rig.inject(of(FaultKind::kBoardKill));
  expect_row(rig.watch());
  EXPECT_EQ(rig.backend->emulated->plant().joint(0).current_A, 0.0);
  expect_stopped(rig, "no complete TPDO for 10 cycles");
}

TEST(FaultRow, TwoBoardsShareANodeId) {
  ArmRig rig({of(FaultKind::kBoardDuplicate)});
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("two nodes answer under this id"), std::string::npos) << rig.causes();
}

TEST(FaultRow, AnswersComeTwice) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kFeedbackOfBoard0, 0);
  fault.kind = FaultKind::kFrameDuplicate;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "two nodes answer under this id");
}

TEST(FaultRow, WrongIdentity) {
  Fault fault = of(FaultKind::kBoardIdentity);
  fault.number = 0x1234;
  ArmRig rig({fault});
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("wrong product code"), std::string::npos) << rig.causes();
}

TEST(FaultRow, WrongFirmwareVersion) {
  Fault fault = of(FaultKind::kBoardRevision);
  fault.number = 0x00020000;
  ArmRig rig({fault});
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("wrong revision"), std::string::npos) << rig.causes();
}

TEST(FaultRow, NodeMissingAtStart) {
  ArmRig rig({of(FaultKind::kBoardKill)});
  expect_row(rig.watch(6000));
  EXPECT_NE(rig.causes().find("no boot-up message within 3 s"), std::string::npos) << rig.causes();
}

TEST(FaultRow, SensorNodeDies) {
  ArmRig rig;
  rig.run();
  Fault fault = of(FaultKind::kBoardKill);
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
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_EQ(rig.axis(b).machine().motion(), DriveMotion::kFollow);
  }
}

// --- joints ---

TEST(FaultRow, EncoderFreezes) {
  ArmRig rig;
  rig.run();
  rig.inject(of(FaultKind::kEncoderFreeze));
  expect_row(rig.watch());
  expect_stopped(rig, "0x7320");
}

TEST(FaultRow, EncoderFreezesAtRest) {
  ArmRig rig;
  rig.run();
  Fault fault = of(FaultKind::kEncoderFreeze);
  fault.joint = 2;  // is held
  rig.inject(fault);
  for (int i = 0; i < 500; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, EncoderJumps) {
  ArmRig rig;
  rig.run();
  Fault fault = of(FaultKind::kEncoderJump);
  fault.value = 0.05;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "0x7320");
}

TEST(FaultRow, EncoderUnplugged) {
  ArmRig rig;
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

TEST(FaultRow, MotorOverheats) {
  ArmRig rig;
  rig.run();
  Fault fault = of(FaultKind::kMotorOverheat);
  fault.value = 130.0;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "0x4310");
}

TEST(FaultRow, SupplySags) {
  ArmRig rig;
  rig.run();
  Fault fault = of(FaultKind::kSupplySag);
  fault.value = 20.0;  // of 48 V
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "0x3100");
}

TEST(FaultRow, JointRings) {
  ArmRig rig;
  rig.run();
  ASSERT_TRUE(rig.cycle->services().set_gains("shoulder_pan_joint", hal::PidLoop::kPosition,
                                              {.kp = 1.4e6, .kd = 14'000.0},
                                              RunServices::Patience{0}));
  expect_row(rig.watch());
  expect_stopped(rig, "0xFF03");
  EXPECT_NE(rig.causes().find("the joint oscillates"), std::string::npos) << rig.causes();
}

// --- controllers ---

TEST(FaultRow, ControllerGivesNaN) {
  ArmRig rig;
  rig.run();
  rig.sine->not_finite = true;
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("not a finite number"), std::string::npos) << rig.causes();
}

TEST(FaultRow, ControllerGivesUp) {
  ArmRig rig;
  rig.run();
  rig.sine->answer = Code::kOutOfRange;
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("the controller gave up"), std::string::npos) << rig.causes();
}

}  // namespace
}  // namespace tandem::runtime
