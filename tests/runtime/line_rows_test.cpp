// The rows of docs/faults.md about an EtherCAT line.
#include "canopen/bytes.hpp"
#include "tests/runtime/fault_row.hpp"

namespace tandem::runtime {
namespace {

using namespace test;
using sim::ScenarioFault;

class LineRow : public testing::Test {};

/// UR5e with its three boards in one line.
struct LineRig : private LoadedRobot, FaultRig {
  explicit LineRig(std::vector<ScenarioFault> scenario = {})
      : LoadedRobot("ur5e"),
        FaultRig(line(loaded.robot), loaded.kernels.get(), "ready", std::move(scenario),
                 RowRig::kHanging_ns) {}
  static hal::RobotConfig line(hal::RobotConfig config) {
    config.buses[0].kind = hal::BusKind::kEthercat;
    int place = static_cast<int>(config.boards.size());
    for (hal::SensorConfig& sensor : config.sensors) sensor.node_id = ++place;
    return RowRig::with(std::move(config), hal::StopCategory::kCategory1);
  }
  /// Cycles of the robot alone, every joint held.
  void drive(int cycles) {
    for (int i = 0; i < cycles; ++i) {
      (void)backend->read(next(), state);
      (void)backend->write(hold, parameters);
    }
  }
  /// With this fault, and 0.5 s after its end: nothing has moved by itself, and after a reset the
  /// robot moves again.
  void expect_recovery(const ScenarioFault& fault) {
    run();
    inject(fault);
    drive(1000);
    EXPECT_EQ(backend->phase(), hal::Phase::kFault) << causes();
    backend->reset();
    for (int i = 0; i < 8 && backend->phase() != hal::Phase::kOperational; ++i) drive(500);
    EXPECT_EQ(backend->phase(), hal::Phase::kOperational) << causes();
    EXPECT_EQ(backend->status_text().find("slave"), std::string::npos) << causes();
  }
  hal::CycleTime next() {
    if (time.cycle == 0) time.time_ns = cycle->state().time_ns()[0];
    ++time.cycle;
    time.time_ns += 1'000'000;
    time.period_ns = 1'000'000;
    return time;
  }
  hal::CycleTime time;
  hal::StateImage state{robot.shape()};
  hal::CommandImage hold{robot.shape()};
  hal::ParameterImage parameters = hal::initial_parameters(robot);
};

ScenarioFault frames(FaultKind kind, std::uint32_t count, sim::FrameDirection direction) {
  ScenarioFault fault = of(kind);
  fault.count = count;
  fault.direction = direction;
  return fault;
}

ScenarioFault cable_to(std::int32_t board, std::int64_t duration_ns = -1) {
  ScenarioFault fault = of(FaultKind::kBusDown);
  fault.board = board;
  fault.duration_ns = duration_ns;
  return fault;
}

/// A cycle's frames are two: process data, and the outputs before them.
TEST_F(LineRow, FramesOfACycleLost) {
  LineRig rig;
  rig.run();
  rig.inject(frames(FaultKind::kFrameDrop, 2, sim::FrameDirection::kToMaster));
  std::uint32_t oldest = 0;
  for (int i = 0; i < 200; ++i) {
    rig.step();
    oldest = std::max(oldest, rig.cycle->state().age_cycles()[0]);
  }
  expect_struck(rig, 2);
  EXPECT_EQ(oldest, 1U);
  EXPECT_EQ(rig.cycle->state().age_cycles()[0], 0U);
  expect_running(rig);
  expect_row({});
}

TEST_F(LineRow, FramesLostForEver) {
  LineRig rig;
  rig.run();
  rig.inject(frames(FaultKind::kFrameDrop, 0, sim::FrameDirection::kBoth));
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("no frame comes back"), std::string::npos) << rig.causes();
}

TEST_F(LineRow, FramesLate) {
  LineRig rig;
  rig.run();
  rig.inject(frames(FaultKind::kFrameDelay, 1, sim::FrameDirection::kToMaster));
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 1);
  expect_running(rig);
  expect_row({});
}

TEST_F(LineRow, FramesTwice) {
  LineRig rig;
  rig.run();
  rig.inject(frames(FaultKind::kFrameDuplicate, 40, sim::FrameDirection::kToMaster));
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 40);
  expect_running(rig);
  expect_row({});
}

TEST_F(LineRow, CableCutBetweenSlaves) {
  LineRig rig;
  rig.run();
  rig.inject(cable_to(1, 500'000'000));
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("the cable from slave 0 (board_1) to slave 1 (board_2) is cut"),
            std::string::npos)
      << rig.causes();
  LineRig().expect_recovery(cable_to(1, 500'000'000));
}

TEST_F(LineRow, CableToTheFirstSlaveCut) {
  LineRig rig;
  rig.run();
  rig.inject(cable_to(-1, 500'000'000));
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("the cable from the master to slave 0"), std::string::npos)
      << rig.causes();
  LineRig().expect_recovery(cable_to(-1, 500'000'000));
}

TEST_F(LineRow, SlaveWithoutPower) {
  LineRig rig;
  rig.run();
  ScenarioFault fault = of(FaultKind::kBoardKill);
  fault.board = 2;  // the last one: the others are still reached
  fault.duration_ns = 500'000'000;
  rig.inject(fault);
  expect_row(rig.watch());
  LineRig().expect_recovery(fault);
}

TEST_F(LineRow, BoardResets) {
  LineRig rig;
  rig.run();
  ScenarioFault fault = of(FaultKind::kBoardReset);
  fault.board = 1;
  fault.duration_ns = 0;
  rig.inject(fault);
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("board_2"), std::string::npos) << rig.causes();
  LineRig().expect_recovery(fault);
}

/// The clock of the first slave is the reference: all of them start anew, and are reset once more.
TEST_F(LineRow, FirstBoardResets) {
  LineRig rig;
  rig.run();
  ScenarioFault fault = of(FaultKind::kBoardReset);
  fault.duration_ns = 0;
  rig.inject(fault);
  expect_row(rig.watch());
  LineRig again;
  again.run();
  again.inject(fault);
  again.drive(100);
  int resets = 0;
  for (; resets < 3 && again.backend->phase() != hal::Phase::kOperational; ++resets) {
    again.backend->reset();
    again.drive(3000);
  }
  EXPECT_EQ(again.backend->phase(), hal::Phase::kOperational) << again.causes();
  EXPECT_LE(resets, 2);
}

TEST_F(LineRow, WrongIdentity) {
  ScenarioFault fault = of(FaultKind::kBoardIdentity);
  fault.board = 1;
  fault.number = 7;
  LineRig rig({fault});
  for (int i = 0; i < 4000 && !rig.noticed(); ++i) rig.step();
  EXPECT_TRUE(rig.noticed());
  EXPECT_NE(rig.causes().find("board_2"), std::string::npos) << rig.causes();
  for (std::size_t b = 0; b < rig.robot.boards.size(); ++b) {
    EXPECT_EQ(rig.axis(b).machine().motion(), DriveMotion::kNone) << "nothing was enabled";
  }
  expect_row({});
}

TEST_F(LineRow, WrongRevision) {
  ScenarioFault fault = of(FaultKind::kBoardRevision);
  fault.board = 1;
  fault.number = 0x00020000;
  LineRig rig({fault});
  for (int i = 0; i < 4000 && !rig.noticed(); ++i) rig.step();
  EXPECT_TRUE(rig.noticed());
  EXPECT_NE(rig.causes().find("board_2"), std::string::npos) << rig.causes();
  EXPECT_NE(rig.causes().find("revision"), std::string::npos) << rig.causes();
  expect_row({});
}

/// Another's frame, which passes the slaves between two of the master's: one datagram that writes
/// `data` at register `at`.
void strangers_write(LineRig& rig, std::uint8_t command, int position, std::uint16_t at,
                     std::initializer_list<std::uint8_t> data) {
  std::vector<std::uint8_t> frame(60);
  std::fill_n(frame.begin(), 6, std::uint8_t{0xFF});
  frame[6] = 0x10;
  frame[12] = 0x88;
  frame[13] = 0xA4;
  canopen::put(&frame[14], static_cast<std::uint16_t>(0x1000 | (12 + data.size())));
  frame[16] = command;
  canopen::put(&frame[18], static_cast<std::uint16_t>(-position));
  canopen::put(&frame[20], at);
  canopen::put(&frame[22], static_cast<std::uint16_t>(data.size()));
  std::ranges::copy(data, frame.begin() + 26);
  auto& robot = *rig.backend;
  ASSERT_TRUE(robot.lines[0]->boards().line().pass(frame, robot.emulated->now_ns()));
}
constexpr std::uint8_t kWriteOne = 2, kWriteAll = 8;  // APWR, BWR
constexpr std::uint16_t kAlControl = 0x0120, kInputsFmmuActive = 0x061C;

TEST_F(LineRow, SlaveInAnotherState) {
  LineRig rig;
  rig.run();
  strangers_write(rig, kWriteOne, 1, kAlControl, {4, 0});  // SAFEOP
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("slave 1 (board_2): is in SAFEOP"), std::string::npos)
      << rig.causes();
}

TEST_F(LineRow, SecondMaster) {
  LineRig rig;
  rig.run();
  strangers_write(rig, kWriteAll, 0, kAlControl, {1, 0});  // INIT
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("slave"), std::string::npos) << rig.causes();
}

TEST_F(LineRow, WorkingCounterShortOnce) {
  LineRig rig;
  rig.run();
  strangers_write(rig, kWriteOne, 1, kInputsFmmuActive, {0});
  rig.step();
  EXPECT_EQ(rig.cycle->state().age_cycles()[2], 1U);
  strangers_write(rig, kWriteOne, 1, kInputsFmmuActive, {1});
  for (int i = 0; i < 200; ++i) {
    rig.step();
    EXPECT_EQ(rig.cycle->state().age_cycles()[2], 0U);
  }
  expect_running(rig);
  expect_row({});
}

TEST_F(LineRow, WorkingCounterShortForEver) {
  LineRig rig;
  rig.run();
  strangers_write(rig, kWriteOne, 1, kInputsFmmuActive, {0});
  expect_row(rig.watch());
  EXPECT_NE(rig.causes().find("slave 1 (board_2): its FMMUs were changed"), std::string::npos)
      << rig.causes();
}

/// For longer than the watchdog no frame reaches the slaves, and then they do again.
TEST_F(LineRow, WatchdogOfTheOutputs) {
  LineRig rig;
  rig.run();
  ScenarioFault fault = frames(FaultKind::kFrameDrop, 0, sim::FrameDirection::kToBoards);
  fault.duration_ns = 150'000'000;
  rig.inject(fault);
  expect_row(rig.watch());
  for (int i = 0; i < 300; ++i) rig.step();
  for (std::size_t i = 0; i < rig.robot.boards.size(); ++i) {
    const auto& slave = rig.backend->lines[0]->boards().line().slave(i);
    EXPECT_EQ(slave.state(), ethercat::AlState::kSafeOp);
    EXPECT_EQ(slave.code(), ethercat::AlCode::kWatchdog);
  }
}

TEST_F(LineRow, SlaveMissingAtTheStart) {
  ScenarioFault fault = of(FaultKind::kBoardKill);
  fault.board = 2;
  LineRig rig({fault});
  for (int i = 0; i < 8000 && !rig.noticed(); ++i) rig.step();
  EXPECT_TRUE(rig.noticed());
  EXPECT_NE(rig.causes().find("2 of 4 slaves answer: look at slave 2 (board_3)"), std::string::npos)
      << rig.causes();
  expect_row({});
}

}  // namespace
}  // namespace tandem::runtime
