// What a drive of another make keeps, and what its numbers mean: a configuration that is named and
// stored, stop options, velocity units, PDOs beyond the fourth, frames of CAN FD, a second axis.
#include <gtest/gtest.h>

#include "hal/ethercat-can/drive_use.hpp"
#include "sheet_rig.hpp"

namespace tandem::hal::can {
namespace {

using namespace test;

Sheet storing() {
  Sheet s = servo();
  s.add(0x1010, 1, kUnsigned32, kSetting, 0);
  s.add(0x1020, 1, kUnsigned32, kSetting, 0);
  s.add(0x1020, 2, kUnsigned32, kSetting, 0);
  return s;
}

void keeps(RobotConfig& robot) { robot.boards[0].keeps_configuration = true; }

/// Brings the rig's drive up by a master that was just started, and counts what it wrote.
int writes_of_a_start(SheetRig& rig) {
  const std::array<Bus*, 2> ends{&rig.bus.master(), &rig.other.master()};
  auto created = DriveMaster::create(rig.robot, ends);
  EXPECT_TRUE(created.has_value());
  rig.master = std::move(*created);
  rig.drive.writes = 0;
  EXPECT_TRUE(rig.bring_up());
  return rig.drive.writes;
}

TEST(SheetKept, AnUnchangedDriveIsNotWrittenAgain) {
  SheetRig rig(storing(), keeps);
  const int first = writes_of_a_start(rig);
  EXPECT_GT(first, 30);
  EXPECT_NE(rig.drive.value(0x1020, 1), 0);
  EXPECT_NE(rig.drive.value(0x1020, 2), 0);
  EXPECT_EQ(writes_of_a_start(rig), 2) << "targets 60FF and 6071: what no drive keeps";
  rig.command.position_rad()[0] = 100 * kRadPerCount;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x6064), 100) << "it does what was stored";
  EXPECT_TRUE(rig.master->warnings().empty());
}

/// Another configuration has another name; so has another cycle, which 60C2 has to tell.
TEST(SheetKept, AChangedConfigurationIsWritten) {
  SheetRig rig(storing(), keeps);
  const int first = writes_of_a_start(rig);
  rig.robot.boards[0].heartbeat_ms = 70;
  EXPECT_EQ(writes_of_a_start(rig), first);
  EXPECT_EQ(rig.drive.value(0x1017), 70);
  EXPECT_EQ(writes_of_a_start(rig), 2);
  rig.drive.value(0x1020, 2) = 1;  // by somebody else
  rig.drive.store_now();
  EXPECT_EQ(writes_of_a_start(rig), first);
}

TEST(SheetKept, ADriveThatDoesNotStoreIsWrittenAtEveryStartAndToldOf) {
  SheetRig rig(storing(), keeps);
  rig.drive.stores = false;
  const int first = writes_of_a_start(rig);
  EXPECT_EQ(writes_of_a_start(rig), first);
  ASSERT_EQ(rig.master->warnings().size(), 1U);
  EXPECT_NE(rig.master->warnings()[0].find("does not store its configuration (1010:1)"),
            std::string::npos)
      << rig.master->warnings()[0];
}

TEST(SheetKept, WithoutTheKeyNothingIsStored) {
  SheetRig rig(storing());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x1020, 1), 0);
}

TEST(SheetKept, StopOptionsAreSetWhereTheyAreAskedFor) {
  Sheet s = servo();
  for (const int index : {0x605B, 0x605C, 0x605D, 0x605E}) s.add(index, 0, kInteger16, kSetting, 0);
  SheetRig rig(s, [](RobotConfig& robot) {
    robot.joints[0].stop_options = {.shutdown = 1, .disable = {}, .halt = 2, .fault = -3};
  });
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x605A), 2);
  EXPECT_EQ(rig.drive.value(0x605B), 1);
  EXPECT_EQ(rig.drive.value(0x605C), 0) << "as it was";
  EXPECT_EQ(rig.drive.value(0x605D), 2);
  EXPECT_EQ(static_cast<std::int16_t>(rig.drive.value(0x605E)), -3);
  const auto facts = drive_facts(rig.robot);
  ASSERT_EQ(facts.size(), 1U);
  EXPECT_EQ(facts[0].how,
            "605A is set to 2, 605B is set to 1, 605C 0, 605D is set to 2, 605E is set to -3");
}

TEST(SheetKept, StopOptionsOfOurOwnBoardsAreToldToo) {
  RobotConfig robot = robot_config();
  EXPECT_TRUE(drive_facts(robot).empty()) << "docs/firmware.md has what they do";
  robot.joints[1].stop_options = {.shutdown = 1, .disable = {}, .halt = {}, .fault = 0};
  const auto facts = drive_facts(robot);
  ASSERT_EQ(facts.size(), 1U);
  EXPECT_EQ(facts[0].what, robot.joints[1].name);
  EXPECT_EQ(facts[0].how, "605B is set to 1, 605E is set to 0");
}

/// A motor that turns 50 times as often as the joint, and tells its speed in rpm: 3000 rpm are
/// 60 revolutions of the joint per minute.
TEST(SheetKept, VelocitiesInRpmAreConverted) {
  Sheet s = servo();
  s.add(0x60A9, 0, kUnsigned32, canopen::kRead, 0x00B44700);
  s.add(0x6091, 1, kUnsigned32, canopen::kRead, 50);
  s.add(0x6091, 2, kUnsigned32, canopen::kRead, 1);
  const auto units = canopen::units_of(s.sheet, 0);
  ASSERT_TRUE(units.velocity_per_rev.has_value());
  EXPECT_DOUBLE_EQ(*units.velocity_per_rev, 3000.0);
  SheetRig rig(s, [](RobotConfig& robot) {
    robot.joints[0].velocity_units_per_rev = 3000.0;
    robot.joints[0].velocity_units_per_rev.of_sheet = true;
  });
  ASSERT_TRUE(rig.bring_up());
  rig.drive.value(0x606C) = -1500;
  rig.ask(ControlMode::kVelocity);
  rig.command.velocity_rad_s()[0] = 2.0 * kPi;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x60B1), 3000);
  EXPECT_NEAR(rig.state.velocity_rad_s()[0], -kPi, 1e-9);
}

/// Tenths of a revolution per minute; without the gear, or with another unit, the value is asked
/// for.
TEST(SheetKept, OtherVelocityUnitsAreReadOrAskedFor) {
  Sheet s = servo();
  s.add(0x6091, 1, kUnsigned32, canopen::kRead, 50);
  s.add(0x6091, 2, kUnsigned32, canopen::kRead, 1);
  const auto with = [&](std::int64_t unit) {
    s.add(0x60A9, 0, kUnsigned32, canopen::kRead, unit);
    return canopen::units_of(s.sheet, 0);
  };
  EXPECT_DOUBLE_EQ(with(0xFFB44700).velocity_per_rev.value_or(0.0), 30000.0);
  EXPECT_DOUBLE_EQ(with(0x00B40300).velocity_per_rev.value_or(0.0), 50.0);
  EXPECT_FALSE(with(0x00B50300).velocity_per_rev.has_value()) << "increments: as without it";
  EXPECT_EQ(with(0x00B50300).unknown_velocity, 0U);
  EXPECT_EQ(with(0x00010300).unknown_velocity, 0x00010300U) << "metres";
  s.remove(0x6091);
  EXPECT_EQ(with(0x00B44700).unknown_velocity, 0x00B44700U);
}

TEST(SheetKept, PdosBeyondTheFourthAreSwitchedOff) {
  Sheet s = servo();
  s.add(0x1805, 1, kUnsigned32, kSetting, 0x190, true);
  s.add(0x1404, 1, kUnsigned32, kSetting, 0x80000000 | 0x210, true);
  SheetRig rig(s);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(static_cast<std::uint32_t>(rig.drive.value(0x1805, 1)), 0x80000000U | 0x195U);
  EXPECT_TRUE(rig.drive.aborts.empty());
}

/// Eight bytes of a classic bus, or as many as the drive is said to take on CAN FD.
TEST(SheetKept, ADriveOfCanFdGetsItsAxisInOneFrame) {
  const auto pdos = [](bool fd) {
    Sheet s = servo();
    if (fd) s.sheet.most_pdo_bytes = 64;
    RobotConfig robot = SheetRig::config(s);
    robot.buses[0].fd = true;
    const auto layout = make_pdo_layout(robot);
    EXPECT_TRUE(layout.has_value());
    return layout->nodes[0].pdos.size();
  };
  EXPECT_EQ(pdos(true), 3U) << "command, feedback, and the slow feedback";
  EXPECT_GT(pdos(false), 3U);
}

/// Two axes of one drive, the second's objects at +0x800, in four PDOs of eight bytes each way.
Sheet two_axes() {
  Sheet s = common();
  s.add(0x1016, 1, kUnsigned32, kSetting, 0);
  for (const int at : {0, 0x800}) {
    s.add(0x6040 + at, 0, kUnsigned16, kDemand, 0);
    s.add(0x6041 + at, 0, kUnsigned16, kActual);
    s.add(0x605A + at, 0, kInteger16, kSetting, 6);
    s.add(0x6060 + at, 0, kInteger8, kDemand, 0);
    s.add(0x6061 + at, 0, kInteger8, kActual);
    s.add(0x6064 + at, 0, kInteger32, kActual);
    s.add(0x607A + at, 0, kInteger32, kDemand, 0);
    s.add(0x60C2 + at, 1, kUnsigned8, kSetting, 0);
    s.add(0x60C2 + at, 2, kInteger8, kSetting, -3);
    s.add(0x6502 + at, 0, kUnsigned32, canopen::kRead, 0x80);
  }
  for (const int index : {0x606C, 0x6077, 0x603F}) s.remove(index);
  return s;
}

TEST(SheetKept, TwoAxesOfOneDriveFollowEachItsOwn) {
  SheetRig rig(two_axes(), [](RobotConfig& robot) {
    JointConfig second = robot.joints[0];
    second.name = "second";
    second.axis = 1;
    robot.joints.push_back(second);
  });
  rig.command.mode()[1] = static_cast<std::int8_t>(ControlMode::kPosition);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_TRUE(rig.drive.aborts.empty());
  EXPECT_FALSE(rig.too_long);
  rig.command.position_rad()[0] = 100 * kRadPerCount;
  rig.command.position_rad()[1] = -700 * kRadPerCount;
  rig.steps(5);
  EXPECT_EQ(static_cast<std::int32_t>(rig.drive.value(0x6064)), 100);
  EXPECT_EQ(static_cast<std::int32_t>(rig.drive.value(0x6864)), -700);
  EXPECT_NEAR(rig.state.position_rad()[0], 100 * kRadPerCount, 1e-12);
  EXPECT_NEAR(rig.state.position_rad()[1], -700 * kRadPerCount, 1e-12);
  EXPECT_EQ(rig.drive.value(0x6860), 8);
  EXPECT_EQ(rig.drive.value(0x685A), 2);
  rig.drive.fault();
  rig.steps(5);
  EXPECT_EQ(rig.state.fault()[0], 0x1000U) << "neither 603F in a PDO nor an emergency tells more";
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
}

}  // namespace
}  // namespace tandem::hal::can
