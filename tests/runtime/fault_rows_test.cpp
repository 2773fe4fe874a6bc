// The rows of docs/faults.md, one test each: what goes wrong, how it is noticed, what follows, and
// after how many cycles. The page's numbers are what is expected here.
#include <filesystem>
#include <fstream>
#include <regex>

#include "tests/runtime/fault_robot.hpp"
#include "tests/sim/swing_robot.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::runtime {
namespace {

using canopen::DriveMotion;
using hal::FaultKind;
using sim::Fault;
using test::FaultRig;
using test::Outcome;

/// The page's line of the running test, cell by cell: what | noticed by | reaction | noticed |
/// safe | test.
std::vector<std::string> row_of_this_test() {
  const std::string name =
      std::string("`FaultRow.") +
      testing::UnitTest::GetInstance()->current_test_info()->name() + "`";
  std::ifstream page(std::filesystem::path(TANDEM_SOURCE_DIR) / "docs/faults.md");
  for (std::string line; std::getline(page, line);) {
    if (line.find(name) == std::string::npos) continue;
    std::vector<std::string> cells;
    std::istringstream in(line);
    for (std::string cell; std::getline(in, cell, '|');) cells.push_back(cell);
    return cells;
  }
  ADD_FAILURE() << "docs/faults.md has no row with the test " << name;
  return {};
}

/// Object 2036, 1 s, and a cycle for the master's reaction.
constexpr int kLongestStop = 1002;

int number_in(const std::string& cell) {
  const std::size_t digit = cell.find_first_of("0123456789");
  return digit == std::string::npos ? -1 : std::stoi(cell.substr(digit));
}

/// The outcome is the one that the page declares.
void expect_row(const Outcome& outcome) {
  const std::vector<std::string> row = row_of_this_test();
  ASSERT_EQ(row.size(), 7U);
  EXPECT_EQ(outcome.noticed, number_in(row[4])) << "noticed after so many cycles";
  EXPECT_EQ(outcome.safe, number_in(row[5])) << "safe after so many cycles";
  if (outcome.safe < 0) return;
  EXPECT_GE(outcome.open, outcome.safe) << "every bridge opens in the end";
  EXPECT_LE(outcome.open, outcome.safe + kLongestStop);
}

/// UR5e: six joints on three boards, a force/torque sensor, one bus. Joint 0, on board 0, moves.
struct Ur5e {
  tandem::test::TestRobot loaded = tandem::test::load_test_robot("ur5e");
};
struct ArmRig : private Ur5e, FaultRig {
  explicit ArmRig(std::vector<Fault> scenario = {},
                  hal::StopCategory on_fault = hal::StopCategory::kCategory1)
      : FaultRig(with(loaded.robot, on_fault), loaded.kernels.get(), "ready", std::move(scenario)) {}
  static hal::RobotConfig with(hal::RobotConfig config, hal::StopCategory on_fault) {
    for (hal::JointConfig& joint : config.joints) joint.on_fault = on_fault;
    return config;
  }
};

Fault of(FaultKind kind) {
  Fault fault;
  fault.kind = kind;
  const bool joint = kind >= FaultKind::kEncoderFreeze && kind <= FaultKind::kSpringBreak;
  const bool board = kind >= FaultKind::kBoardKill && kind <= FaultKind::kSupplySag;
  if (joint) fault.joint = 0;
  if (board) fault.board = 0;
  if (kind == FaultKind::kBusDown || sim::is_frame_fault(kind)) fault.bus = 0;
  return fault;
}

/// `count` frames of one identifier are lost; 0: all from now on.
Fault lose(std::uint32_t cob_id, std::uint32_t count) {
  Fault fault = of(FaultKind::kFrameDrop);
  fault.cob_id = cob_id;
  fault.cob_mask = 0x7FF;
  fault.count = count;
  return fault;
}

constexpr std::uint32_t kFeedbackOfBoard0 = 0x181, kCommandOfBoard0 = 0x201;
constexpr std::uint32_t kFeedbackOfSensor = 0x180 + 20, kSync = 0x080;

/// The joints of the other boards stop by the declared category, and all of it stays latched with
/// cause and time.
void expect_stopped(FaultRig& rig, const std::string& cause) {
  for (std::size_t b = 1; b < 3; ++b) {
    for (std::size_t a = 0; a < 2; ++a) {
      EXPECT_EQ(rig.axis(b, a).machine().motion(), DriveMotion::kNone) << b << "." << a;
      EXPECT_EQ(rig.axis(b, a).objects().error_code, 0) << "it stopped in order";
    }
  }
  EXPECT_EQ(rig.backend->phase(), hal::Phase::kFault) << "latched";
  EXPECT_NE(rig.causes().find(cause), std::string::npos) << rig.causes();
  EXPECT_NE(rig.backend->status_text().find(" s"), std::string::npos) << "with its time";
}

void expect_running(FaultRig& rig) {
  EXPECT_FALSE(rig.noticed()) << rig.causes();
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kRunning);
  for (std::size_t b = 0; b < 3; ++b) {
    EXPECT_EQ(rig.axis(b).machine().motion(), DriveMotion::kFollow);
  }
}

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

/// Every mode of operation is watched alike.
struct ModeCase {
  const char* name;
  hal::ControlMode mode;
  hal::InteractionMode interaction;
  std::int8_t on_wire;
};

class EveryMode : public testing::TestWithParam<ModeCase> {};

TEST_P(EveryMode, BoardsReachTheirSafeStateWithoutCommandsSyncOrHeartbeat) {
  for (const bool with_sync : {false, true}) {
    hal::RobotConfig config = tandem::test::swing_robot();
    auto made = std::make_unique<test::FaultRobot>(config, tandem::test::swing_kernels(2),
                                                   sim::SimRobotConfig{.posture = "up"});
    hal::StateImage state(config.shape());
    hal::CommandImage command(config.shape());
    const hal::ParameterImage parameters = hal::initial_parameters(config);
    hal::CycleTime time;
    for (; time.cycle < 2500; ++time.cycle) {
      time.time_ns = static_cast<std::int64_t>(time.cycle) * 1'000'000;
      (void)made->read(time, state);
      command.mode()[0] = static_cast<std::int8_t>(GetParam().mode);
      command.interaction()[0] = static_cast<std::uint8_t>(GetParam().interaction);
      command.position_rad()[0] = state.position_rad()[0];
      if (GetParam().mode == hal::ControlMode::kOpenLoop) command.voltage_V()[0] = 1.0;
      if (GetParam().mode == hal::ControlMode::kCurrent) command.current_A()[0] = 1.0;
      (void)made->write(command, parameters);
    }
    const firmware::Axis& axis = made->emulated->board(0).axis(0);
    ASSERT_EQ(axis.objects().mode_display, GetParam().on_wire);
    ASSERT_EQ(axis.machine().motion(), DriveMotion::kFollow) << made->status_text();
    Fault silent = of(FaultKind::kFrameDrop);  // all of the master's frames, SYNC perhaps not
    silent.direction = sim::Direction::kToBoards;
    if (with_sync) silent.node_id = 1;
    ASSERT_EQ(made->emulated->inject(silent), Code::kOk);
    int noticed = -1, open = -1;
    for (int i = 1; i < 3000 && open < 0; ++i, ++time.cycle) {
      time.time_ns = static_cast<std::int64_t>(time.cycle) * 1'000'000;
      (void)made->read(time, state);
      (void)made->write(command, parameters);
      if (noticed < 0 && axis.objects().error_code != 0) {
        noticed = i;
        EXPECT_EQ(axis.machine().motion(), DriveMotion::kQuickStop) << "safe in the same cycle";
      }
      const sim::JointReading joint = made->emulated->plant().joint(0);
      if (noticed >= 0 && joint.current_A == 0.0 && joint.voltage_V == 0.0) open = i;
    }
    EXPECT_EQ(axis.objects().error_code, with_sync ? 0xFF01 : 0x8700);
    EXPECT_EQ(noticed, with_sync ? 11 : 12);
    EXPECT_GE(open, noticed);
    EXPECT_LE(open, noticed + kLongestStop);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Fault, EveryMode,
    testing::Values(
        ModeCase{"csp", hal::ControlMode::kPosition, hal::InteractionMode::kStiff, 8},
        ModeCase{"csv", hal::ControlMode::kVelocity, hal::InteractionMode::kStiff, 9},
        ModeCase{"cst", hal::ControlMode::kTorque, hal::InteractionMode::kStiff, 10},
        ModeCase{"impedance", hal::ControlMode::kPosition, hal::InteractionMode::kCompliant, -1},
        ModeCase{"open_loop", hal::ControlMode::kOpenLoop, hal::InteractionMode::kStiff, -2},
        ModeCase{"current", hal::ControlMode::kCurrent, hal::InteractionMode::kStiff, -3},
        ModeCase{"velocity_impedance", hal::ControlMode::kVelocity,
                 hal::InteractionMode::kCompliant, -4}),
    [](const auto& one) { return std::string(one.param.name); });

// --- frames ---

TEST(FaultRow, FeedbackLostOnce) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kFeedbackOfBoard0, 1));
  rig.step();
  EXPECT_EQ(rig.cycle->state().age_cycles()[0], 1U) << "the sample's age tells";
  EXPECT_EQ(rig.cycle->state().age_cycles()[2], 0U);
  for (int i = 0; i < 200; ++i) rig.step();
  EXPECT_EQ(rig.cycle->state().age_cycles()[0], 0U);
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, FeedbackLostTenTimes) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kFeedbackOfBoard0, 10));
  for (int i = 0; i < 10; ++i) rig.step();
  EXPECT_EQ(rig.cycle->state().age_cycles()[0], 10U);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, FeedbackLostForEver) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kFeedbackOfBoard0, 0));
  expect_row(rig.watch());
  expect_stopped(rig, "no complete TPDO for 10 cycles");
}

TEST(FaultRow, CommandLostOnce) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 1));
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, CommandLostTenTimes) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 10));
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, CommandLostForEver) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 0));
  expect_row(rig.watch());
  EXPECT_EQ(rig.axis(0).objects().error_code, 0xFF01);
  expect_stopped(rig, "0xFF01");
}

TEST(FaultRow, SyncLostOnce) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kSync, 1));
  rig.step();
  for (std::size_t j = 0; j < 6; ++j) EXPECT_EQ(rig.cycle->state().age_cycles()[j], 1U);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, SyncLostForEver) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kSync, 0));
  expect_row(rig.watch());
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(rig.axis(b).objects().error_code, 0x8700);
}

TEST(FaultRow, FrameCorruptedOnce) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kFeedbackOfBoard0, 1);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.seed = 3;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, FrameTooShort) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kCommandOfBoard0, 0);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.length = 4;
  rig.inject(fault);
  expect_row(rig.watch());
  const std::uint32_t latest = rig.board(0).dictionary().value<std::uint32_t>(0x1003, 1);
  EXPECT_TRUE(latest == 0xFF01 || (latest & 0xFFFF) == 0xFF01 || latest == 0x8210) << latest;
  expect_stopped(rig, "0xFF01");
}

TEST(FaultRow, FeedbackTooShort) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kFeedbackOfBoard0, 0);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.length = 4;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "no complete TPDO for 10 cycles");
}

TEST(FaultRow, FrameTwice) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kCommandOfBoard0, 100);
  fault.kind = FaultKind::kFrameDuplicate;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, FramesReordered) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kFeedbackOfBoard0, 10);
  fault.kind = FaultKind::kFrameReorder;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
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

TEST(FaultRow, WrongIdentity) {
  Fault fault = of(FaultKind::kBoardIdentity);
  fault.number = 0x1234;
  ArmRig rig({fault});
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("wrong product code"), std::string::npos) << rig.causes();
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

// --- buses ---

TEST(FaultRow, BusDown) {
  ArmRig rig;
  rig.run();
  rig.inject(of(FaultKind::kBusDown));
  expect_row(rig.watch());
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(rig.axis(b).objects().error_code, 0x8700);
  EXPECT_EQ(rig.backend->phase(), hal::Phase::kFault);
}

TEST(FaultRow, BusDownForFiveCycles) {
  ArmRig rig;
  rig.run();
  Fault fault = of(FaultKind::kBusDown);
  fault.duration_ns = 5'000'000;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, BusOff) {
  ArmRig rig;
  rig.run();
  rig.backend->buses[0]->state_now = hal::can::BusState::kBusOff;
  expect_row(rig.watch());
  EXPECT_FALSE(rig.cycle->faults().empty());
}

TEST(FaultRow, TransmitQueueFull) {
  ArmRig rig;
  rig.run();
  rig.backend->buses[0]->queue = 1;  // SYNC, and no command
  expect_row(rig.watch());
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(rig.axis(b).objects().error_code, 0xFF01);
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

// --- other categories ---

class Category : public testing::TestWithParam<hal::StopCategory> {};

TEST_P(Category, IsWhatTheOtherJointsDoWhenABoardDies) {
  ArmRig rig({}, GetParam());
  rig.run();
  rig.inject(of(FaultKind::kBoardKill));
  for (int i = 0; i < 40; ++i) rig.step();
  const DriveMotion others = rig.axis(1).machine().motion();
  switch (GetParam()) {
    case hal::StopCategory::kCategory0:
      EXPECT_EQ(others, DriveMotion::kNone);
      break;
    case hal::StopCategory::kCategory1:
      EXPECT_NE(others, DriveMotion::kFollow);
      break;
    case hal::StopCategory::kHold:
      EXPECT_EQ(others, DriveMotion::kFollow);
      EXPECT_EQ(rig.backend->phase(), hal::Phase::kFault);
      break;
    case hal::StopCategory::kWarn:
      EXPECT_EQ(others, DriveMotion::kFollow);
      EXPECT_EQ(rig.backend->phase(), hal::Phase::kOperational);
      break;
  }
  EXPECT_FALSE(rig.cycle->faults().empty()) << "told in every category";
}

INSTANTIATE_TEST_SUITE_P(Fault, Category,
                         testing::Values(hal::StopCategory::kCategory0,
                                         hal::StopCategory::kCategory1, hal::StopCategory::kHold,
                                         hal::StopCategory::kWarn),
                         [](const auto& one) { return "category" + std::to_string(one.index); });

}  // namespace
}  // namespace tandem::runtime
