#include "canopen/messages.hpp"
#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using test::Rig;
using test::robot_config;

TEST(BringUp, EnablesThreeBoardsOfTwoAxesWithoutMovingAJoint) {
  Rig rig;
  for (std::size_t j = 0; j < 6; ++j) rig.position_rad[j] = 0.1 * static_cast<double>(j);
  while (rig.master->phase() == Phase::kBringUp && rig.cycle < 5000) (void)rig.step();
  ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  EXPECT_LT(rig.cycle, 600u) << "nodes are configured in parallel, one object a cycle";
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_EQ(rig.state.drive_state()[j], static_cast<int>(DriveState::kOperationEnabled));
    const firmware::AxisObjects& axis = rig.axis(j).objects();
    EXPECT_EQ(axis.target_position, axis.position) << "the drive holds where it is";
  }
  EXPECT_EQ(rig.master->status_text(), "");
}

TEST(BringUp, ConfiguresScalesLimitsGainsAndHeartbeats) {
  Rig rig;
  rig.bring_up();
  EXPECT_EQ(rig.object<std::uint32_t>(3, 0x608F, 1), 36000u);
  EXPECT_EQ(rig.object<std::uint32_t>(3, 0x2033), 360000u);
  EXPECT_EQ(rig.object<std::uint32_t>(3, 0x6076), 50000u);
  EXPECT_EQ(rig.object<std::uint16_t>(3, 0x6072), 2000);
  EXPECT_EQ(rig.object<std::int32_t>(3, 0x607D, 1), -11459);  // -2 rad
  EXPECT_EQ(rig.object<std::int32_t>(3, 0x607D, 2), 11459);
  EXPECT_EQ(rig.gains(3, 0x2020), (std::array<float, 4>{400.0F, 10.0F, 40.0F, 100.0F}));
  EXPECT_EQ(rig.gains(3, 0x2022), (std::array<float, 4>{0.2F, 2.0F, 0.0F, 40.0F}));
  EXPECT_EQ(rig.object<float>(3, 0x2024, 1), 0.125F);  // R / (N K) = 0.5 / 4
  EXPECT_EQ(rig.object<float>(3, 0x2026, 1), 0.5F);
  EXPECT_EQ(rig.object<float>(3, 0x2026, 2), 4.0F);
  EXPECT_EQ(rig.object<float>(3, 0x2026, 3), 400.0F);
  EXPECT_EQ(rig.object<std::uint16_t>(3, 0x2032), 10);
  const canopen::ObjectDictionary& od = rig.boards[1]->dictionary();
  EXPECT_EQ(od.value<std::uint32_t>(0x1016, 1), 0x007F0096u) << "the master, 150 ms";
  EXPECT_EQ(od.value<std::uint16_t>(0x1017, 0), 50);
  EXPECT_EQ(od.value<std::uint32_t>(0x1006, 0), 0u) << "others stop 1.5 of it after a SYNC";
  EXPECT_EQ(od.value<std::uint32_t>(0x2052, 0), 11000u) << "ten cycles without SYNC are borne";
  EXPECT_EQ(od.value<std::uint32_t>(0x1800, 1), 0x4000018Bu) << "no remote requests";
}

TEST(BringUp, WritesStopOptionsToOurOwnBoards) {
  RobotConfig robot = robot_config();
  robot.joints[3].stop_options = {.shutdown = 1, .disable = 0, .halt = 2, .fault = 1};
  Rig rig(robot);
  rig.bring_up();
  const canopen::DriveOptions& set = rig.axis(3).objects().options;
  EXPECT_EQ(set.shutdown, 1);
  EXPECT_EQ(set.disable_operation, 0);
  EXPECT_EQ(set.halt, 2);
  EXPECT_EQ(set.fault_reaction, 1);
  EXPECT_EQ(rig.axis(2).objects().options.fault_reaction, -1) << "as the firmware has it";
}

TEST(BringUp, NamesABoardThatDoesNotAnswer) {
  Rig rig;
  rig.present[1] = false;
  rig.leave(Phase::kBringUp);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.master->status_text(),
            "board board_1 (node 11, bus legs): no boot-up message within 3 s; is it powered and "
            "connected, and is its node id 11?");
}

TEST(BringUp, NamesEveryBoardThatDoesNotAnswer) {
  Rig rig;
  rig.present[0] = false;
  rig.sensor_present = false;
  rig.leave(Phase::kBringUp);
  const std::string text = rig.master->status_text();
  EXPECT_NE(text.find("board board_0 (node 10"), std::string::npos) << text;
  EXPECT_NE(text.find("sensor foot (node 40, bus arms)"), std::string::npos) << text;
  EXPECT_EQ(text.find("board_1"), std::string::npos) << text;
}

TEST(BringUp, WaitsForABoardThatIsPoweredLate) {
  Rig rig;
  rig.present[2] = false;
  rig.steps(1500);
  EXPECT_EQ(rig.master->phase(), Phase::kBringUp);
  EXPECT_EQ(rig.master->status_text(),
            "board board_2 (node 12, bus legs): waiting for its boot-up message");
  rig.present[2] = true;
  rig.leave(Phase::kBringUp);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
}

TEST(BringUp, NamesAWrongIdentity) {
  Rig rig(robot_config(), [](firmware::BoardSetup& setup, std::size_t b) {
    if (b == 2) setup.product = 0x0403;
  });
  rig.leave(Phase::kBringUp);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.master->status_text(),
            "board board_2 (node 12, bus legs): wrong product code: object 1018:02 is 0x403 "
            "instead of 0x402");
}

/// What a board says of itself, and what bring-up makes of it.
std::string with_identity(std::uint32_t revision, std::uint32_t serial, BoardConfig expected) {
  RobotConfig robot = robot_config();
  robot.boards[1].vendor_id = expected.vendor_id;
  robot.boards[1].revision = expected.revision;
  robot.boards[1].serial = expected.serial;
  Rig rig(robot, [=](firmware::BoardSetup& setup, std::size_t b) {
    if (b != 1) return;
    setup.revision = revision;
    setup.serial = serial;
  });
  rig.leave(Phase::kBringUp);
  return rig.master->phase() == Phase::kOperational ? "" : rig.master->status_text();
}

TEST(BringUp, TakesALaterMinorRevisionButNoOtherMajor) {
  const std::string who = "board board_1 (node 11, bus legs): ";
  EXPECT_EQ(with_identity(0x00010000, 0, {}), "") << "the emulated boards' own";
  EXPECT_EQ(with_identity(0x00010007, 0, {}), "");
  EXPECT_EQ(with_identity(0x00020000, 0, {}),
            who +
                "wrong revision: object 1018:03 is 0x20000 instead of 0x10000 or a later minor "
                "of it");
  BoardConfig later;
  later.revision = 0x00010002;
  EXPECT_EQ(with_identity(0x00010001, 0, later),
            who +
                "wrong revision: object 1018:03 is 0x10001 instead of 0x10002 or a later minor "
                "of it");
}

TEST(BringUp, ChecksVendorAndSerialAsConfigured) {
  const std::string who = "board board_1 (node 11, bus legs): ";
  BoardConfig other;
  other.vendor_id = 0x99;
  EXPECT_EQ(with_identity(0x00010000, 0, other),
            who + "wrong vendor id: object 1018:01 is 0x7A4D instead of 0x99");
  BoardConfig seventh;
  seventh.serial = 7;
  EXPECT_EQ(with_identity(0x00010000, 7, seventh), "");
  EXPECT_EQ(with_identity(0x00010000, 8, seventh),
            who + "wrong serial number: object 1018:04 is 0x8 instead of 0x7");
}

TEST(BringUp, NamesTheObjectAndTheJointOfAnSdoAbort) {
  RobotConfig robot = robot_config();
  robot.joints[3].min_position_rad = 2.0;  // above the maximum: 607D is refused
  robot.joints[3].max_position_rad = -2.0;
  Rig rig(robot);
  rig.leave(Phase::kBringUp);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.master->status_text(),
            "writing object 687D:02 of joint Joint3 (board board_1, node 11, axis 1) failed: "
            "maximum is less than minimum (abort code 0x06090036)");
}

TEST(BringUp, NamesTheDriveThatIsNotEnabled) {
  Rig rig;
  rig.bus_V = 40.0;
  rig.position_rad[4] = std::nan("");  // the encoder is not connected
  rig.leave(Phase::kBringUp);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  const std::string text = rig.master->status_text();
  EXPECT_EQ(text.find("joint Joint4 (board board_2, node 12, axis 0): position sensor "
                      "(error code 0x7300)"),
            0u)
      << text;
}

TEST(BringUp, StartsANodeAgainThatRebootsDuringConfiguration) {
  Rig rig;
  rig.steps(40);
  const std::array reset{canopen::make_nmt(canopen::NmtCommand::kResetNode, 11)};
  (void)rig.legs.master().send(reset);  // as a brown-out would
  rig.leave(Phase::kBringUp);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
}

TEST(BringUp, DoesNotWaitForASlowHeartbeat) {
  for (const int heartbeat_ms : {600, 1'100, 20'000}) {
    RobotConfig robot = robot_config();
    for (BoardConfig& board : robot.boards) board.heartbeat_ms = heartbeat_ms;
    for (SensorConfig& sensor : robot.sensors) sensor.heartbeat_ms = heartbeat_ms;
    Rig rig(robot);
    rig.leave(Phase::kBringUp);
    ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
    EXPECT_LT(rig.cycle, 2'000U);
    rig.steps(5'000);
    EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  }
}

TEST(BringUp, RefusesABusThatIsNotFd) {
  RobotConfig robot = robot_config();
  robot.buses[0].fd = false;
  LoopbackBus bus;
  const std::array<Bus*, 2> ends{&bus.master(), &bus.master()};
  const auto master = DriveMaster::create(robot, ends);
  ASSERT_FALSE(master);
  EXPECT_EQ(master.error().key, "board 'board_0'");
}

}  // namespace
}  // namespace tandem::hal::can
