// The master against drives of others: what their sheets offer is what it uses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "hal/ethercat-can/axis_codec.hpp"
#include "hal/ethercat-can/drive_use.hpp"
#include "sheet_rig.hpp"

namespace tandem::hal::can {
namespace {

using namespace test;

TEST(Sheet, AServoDriveIsBroughtUpAndFollowsInEveryCyclicMode) {
  SheetRig rig(servo());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_TRUE(rig.drive.aborts.empty()) << "it was asked for what it has not";
  rig.command.position_rad()[0] = 100 * kRadPerCount;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x6060), 8);
  EXPECT_EQ(rig.drive.value(0x6064), 100);
  EXPECT_NEAR(rig.state.position_rad()[0], 100 * kRadPerCount, 1e-12);
  EXPECT_EQ(rig.state.motor_position_rad()[0], rig.state.position_rad()[0]) << "it has no other";
  rig.ask(ControlMode::kVelocity);
  rig.command.velocity_rad_s()[0] = 2000 * kRadPerCount;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x6060), 9);
  EXPECT_GT(rig.drive.value(0x6064), 103);
  rig.ask(ControlMode::kTorque);
  rig.command.torque_Nm()[0] = 12.5;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x6060), 10);
  EXPECT_NEAR(rig.state.torque_Nm()[0], 12.5, 0.05);
  EXPECT_EQ(static_cast<ControlMode>(rig.state.mode()[0]), ControlMode::kTorque);
}

TEST(Sheet, TheDriveKnowsTheCycleAndWatchesTheMaster) {
  SheetRig rig(servo());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x60C2, 1), 1) << "1 ms";
  EXPECT_EQ(static_cast<std::int8_t>(rig.drive.value(0x60C2, 2)), -3);
  EXPECT_EQ(rig.drive.value(0x1016, 1), 0x7F0096) << "node 127, 150 ms";
  EXPECT_EQ(rig.drive.value(0x1017), 50);
  EXPECT_EQ(rig.drive.value(0x6007), 3) << "it did nothing when its master died";
  EXPECT_EQ(rig.drive.value(0x605A), 2);
}

TEST(Sheet, LimitsThatExcludeWhatItIsSentAreWarnedOf) {
  Sheet s = servo();
  const auto limits = [&](int index, std::int64_t low, std::int64_t high) {
    for (SheetEntry& entry : s.sheet.entries) {
      if (entry.index != index) continue;
      entry.low = low;
      entry.high = high;
      entry.line = 77;
    }
  };
  limits(0x6060, -4, 10);
  limits(0x607A, -5, 5);
  EXPECT_TRUE(drive_warnings(SheetRig(s).robot)->empty());
  limits(0x6060, 1, 8);
  limits(0x607A, 5, -5);
  const auto warnings = drive_warnings(SheetRig(s).robot);
  ASSERT_EQ(warnings->size(), 2U);
  EXPECT_EQ((*warnings)[0].to_string().substr(0, 46),
            "drive.eds:77: 607A: its LowLimit, 5, is more t");
  EXPECT_NE((*warnings)[1].to_string().find(
                "drive.eds:77: 6060: its limits do not take mode 9, 10, in which"),
            std::string::npos)
      << (*warnings)[1].to_string();
}

/// A third of a million counts per revolution, and 16.67 Nm: what sheets and gears give.
TEST(Sheet, ItsScalesNeedNotBeWhole) {
  const auto thirds = [](RobotConfig& robot) {
    robot.joints[0].encoder_counts_per_rev = 1000.0 / 3.0;
    robot.joints[0].motor_encoder_counts_per_rev = 1000.0 / 3.0;
    robot.joints[0].rated_torque_Nm = 50.0001 / 3.0;
  };
  SheetRig rig(servo(), thirds);
  const AxisScale scale = AxisScale::of(rig.robot, rig.robot.joints[0]);
  EXPECT_DOUBLE_EQ(scale.counts_per_rad * 2.0 * kPi, 1000.0 / 3.0);
  EXPECT_DOUBLE_EQ(scale.motor_counts_per_rad * 2.0 * kPi, 1000.0 / 3.0);
  EXPECT_DOUBLE_EQ(scale.mille_per_Nm, 3000.0 / 50.0001);
  ASSERT_TRUE(rig.bring_up());
  rig.ask(ControlMode::kTorque);
  rig.steps(5);
  rig.drive.value(0x6064) = 100'000;
  rig.steps(3);
  EXPECT_NEAR(rig.state.position_rad()[0], 300.0 * 2.0 * kPi, 1e-9);
  RobotConfig own = classic_config();
  thirds(own);
  EXPECT_DOUBLE_EQ(AxisScale::of(own, own.joints[0]).counts_per_rad * 2.0 * kPi, 333.0)
      << "608F of our own boards";
}

TEST(Sheet, AnOffsetOfPositionsThatSomebodyLeftIsSetToZero) {
  SheetRig rig(servo().add(0x60B0, 0, kInteger32, canopen::kReadWrite, 777));
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x60B0), 0) << "the drive adds it to every target";
}

TEST(Sheet, PdosThatAreNotUsedAreSwitchedOff) {
  SheetRig rig(servo());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x1403, 1) & 0x80000000, 0x80000000);
  EXPECT_EQ(rig.drive.value(0x1803, 1) & 0x80000000, 0x80000000);
  EXPECT_EQ(rig.drive.value(0x1800, 3), 0) << "an inhibit time of 30 ms hides states";
  EXPECT_EQ(rig.drive.value(0x1800, 2), 1);
  EXPECT_FALSE(rig.too_long);
}

TEST(Sheet, ATpdoThatIsSentByEventsForEverIsSwitchedOff) {
  Sheet s = servo();
  s.add(0x1800, 2, kUnsigned8, canopen::kRead, 255);
  SheetRig rig(s);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x1800, 1) & 0x80000000, 0x80000000);
  EXPECT_EQ(rig.drive.value(0x1801, 2), 1) << "the next one carries what it would have";
  rig.command.position_rad()[0] = 100 * kRadPerCount;
  rig.steps(5);
  EXPECT_NEAR(rig.state.position_rad()[0], 100 * kRadPerCount, 1e-12);
}

TEST(Sheet, ADriveWhoseTpdosAreAllSentByEventsIsRefused) {
  Sheet s = servo();
  for (int n = 0; n < 4; ++n) s.add(0x1800 + n, 2, kUnsigned8, canopen::kRead, 255);
  SheetRig rig(s);
  EXPECT_EQ(rig.master, nullptr);
  EXPECT_NE(rig.error.find("PDO"), std::string::npos) << rig.error;
}

TEST(Sheet, ADriveWithoutCspInterpolates) {
  SheetRig rig(interpolating());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_TRUE(rig.drive.aborts.empty());
  rig.command.position_rad()[0] = -250 * kRadPerCount;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x6060), 7);
  EXPECT_EQ(rig.drive.value(0x6040) & 0x1F, 0x1F) << "bit 4: follow";
  EXPECT_NEAR(rig.state.position_rad()[0], -250 * kRadPerCount, 1e-12);
}

TEST(Sheet, ADriveThatHearsNoHeartbeatIsGuarded) {
  SheetRig rig(interpolating());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x100C), 50);
  EXPECT_EQ(rig.drive.value(0x100D), 3);
  const int before = rig.drive.guarded();
  rig.steps(500);
  EXPECT_NEAR(rig.drive.guarded() - before, 10, 1);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
}

TEST(Sheet, AGuardedDriveThatDoesNotAnswerIsTold) {
  SheetRig rig(interpolating());
  ASSERT_TRUE(rig.bring_up());
  rig.steps(10);
  rig.drive.answers_guarding = false;
  rig.steps(200);
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kGuardingLost);
  const std::string text = rig.master->status_text();
  EXPECT_NE(text.find("guarding lost at "), std::string::npos) << text;
  EXPECT_NE(text.find("(no answer to node guarding for 150 ms)"), std::string::npos) << text;
}

TEST(Sheet, ADriveWithNeitherIsWatchedByItsTpdos) {
  SheetRig rig(servo().remove(0x1016).remove(0x1017));
  ASSERT_TRUE(rig.bring_up());
  rig.steps(500);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
}

TEST(Sheet, AMappingThatCannotBeWrittenIsUsedAsItIs) {
  Sheet s = servo();
  for (const int map : {0x1600, 0x1601, 0x1602, 0x1603, 0x1A00, 0x1A01, 0x1A02, 0x1A03}) {
    for (int sub = 0; sub <= 8; ++sub) {
      s.add(map, sub, sub == 0 ? kUnsigned8 : kUnsigned32, canopen::kRead, 0);
    }
  }
  const auto map = [&](int index, std::initializer_list<std::int64_t> entries) {
    s.add(index, 0, kUnsigned8, canopen::kRead, static_cast<std::int64_t>(entries.size()));
    int sub = 0;
    for (const std::int64_t entry : entries)
      s.add(index, ++sub, kUnsigned32, canopen::kRead, entry);
  };
  map(0x1600, {0x60400010});
  map(0x1601, {0x60400010, 0x60810020});  // 6081: nobody here could fill it
  map(0x1602, {0x60400010, 0x607A0020});
  map(0x1A00, {0x60410010});
  map(0x1A01, {0x60410010, 0x60640020});
  SheetRig rig(s);
  ASSERT_TRUE(rig.bring_up());
  rig.command.position_rad()[0] = 100 * kRadPerCount;
  rig.steps(5);
  EXPECT_NEAR(rig.state.position_rad()[0], 100 * kRadPerCount, 1e-12);
  EXPECT_EQ(rig.drive.value(0x6060), 8) << "set at start-up, as no PDO has it";
  EXPECT_EQ(rig.drive.value(0x1401, 1) & 0x80000000, 0x80000000) << "nobody fills it";
}

TEST(Sheet, AMappingThatStaysWithATargetInAnotherLengthIsRefused) {
  Sheet s = servo().remove(0x60B1).remove(0x60B2).remove(0x60FF).remove(0x6071);
  for (const int map : {0x1600, 0x1601, 0x1602, 0x1603}) {
    for (int sub = 0; sub <= 8; ++sub) {
      s.add(map, sub, sub == 0 ? kUnsigned8 : kUnsigned32, canopen::kRead, 0);
    }
  }
  s.add(0x1600, 0, kUnsigned8, canopen::kRead, 2);
  s.add(0x1600, 1, kUnsigned32, canopen::kRead, 0x60400010);
  s.add(0x1600, 2, kUnsigned32, canopen::kRead, 0x607A0010);
  const SheetRig rig(s);
  EXPECT_EQ(rig.master, nullptr);
  EXPECT_NE(rig.error.find("1600 is not used: 607A:00 has 32 bits, and is there with 16"),
            std::string::npos)
      << rig.error;
  // In a PDO of its own the rest is there, and the target is what is missing.
  s.add(0x1600, 0, kUnsigned8, canopen::kRead, 1);
  s.add(0x1601, 0, kUnsigned8, canopen::kRead, 1);
  s.add(0x1601, 1, kUnsigned32, canopen::kRead, 0x607A0010);
  const SheetRig apart(s);
  EXPECT_NE(apart.error.find("[1601sub1] maps 607A:00, which has 32 bits, with 16"),
            std::string::npos)
      << apart.error;
}

TEST(Sheet, VelocityIsThePositionsDifferenceWhereTheDriveTellsNone) {
  SheetRig rig(servo().remove(0x606C));
  ASSERT_TRUE(rig.bring_up());
  for (int i = 1; i <= 20; ++i) {
    rig.command.position_rad()[0] = 3 * i * kRadPerCount;
    rig.step();
  }
  EXPECT_NEAR(rig.state.velocity_rad_s()[0], 3000 * kRadPerCount, 1e-9);
}

TEST(Sheet, ADriveThatBootsInFiveSecondsAndAnswersTwiceIsBroughtUp) {
  SheetRig rig(servo());
  rig.drive.boot_ms = 5000;
  rig.drive.answers_late = true;
  rig.drive.emergency_at_boot = true;
  ASSERT_TRUE(rig.bring_up(20000));
}

TEST(Sheet, ADriveThatDoesNotNameItsModesIsTakenAtItsSheetsWord) {
  SheetRig rig(servo().remove(0x6502));
  ASSERT_TRUE(rig.bring_up()) << "6502 is asked for, and need not exist";
}

TEST(Sheet, ADriveWithoutAModeOfItsSheetIsRefused) {
  SheetRig poor(servo());
  poor.drive =
      SheetDrive(Sheet(servo()).add(0x6502, 0, kUnsigned32, canopen::kRead, 0x65).sheet, 5);
  EXPECT_FALSE(poor.bring_up());
  EXPECT_NE(poor.master->status_text().find("has not the modes"), std::string::npos)
      << poor.master->status_text();
}

TEST(Sheet, AnotherDriveIsRefused) {
  SheetRig rig(servo());
  rig.drive =
      SheetDrive(Sheet(servo()).add(0x1018, 2, kUnsigned32, canopen::kRead, 0x124).sheet, 5);
  EXPECT_FALSE(rig.bring_up());
  EXPECT_NE(rig.master->status_text().find("0x124 instead of 0x123"), std::string::npos)
      << rig.master->status_text();
}

TEST(Sheet, AProfileWithAdditionalInformationIsADrive) {
  for (const std::int64_t type : {0x00000192LL, 0x00020192LL, 0x00420192LL, 0xFFFF0192LL}) {
    SheetRig rig(servo().add(0x1000, 0, kUnsigned32, canopen::kRead, type));
    EXPECT_TRUE(rig.bring_up()) << type;
  }
  SheetRig other(servo());
  other.drive =
      SheetDrive(Sheet(servo()).add(0x1000, 0, kUnsigned32, canopen::kRead, 0x00020191).sheet, 5);
  EXPECT_FALSE(other.bring_up());
}

TEST(Sheet, ManufacturersObjectsOfTheSameNumberAreLeftAlone) {
  Sheet s = servo();
  for (const int index : {0x2010, 0x2011, 0x2020, 0x2033, 0x2051}) {
    s.add(index, 0, kReal32, kDemand, 7);
  }
  SheetRig rig(s);
  ASSERT_TRUE(rig.bring_up());
  rig.steps(20);
  for (const int index : {0x2010, 0x2011, 0x2020, 0x2033, 0x2051}) {
    EXPECT_EQ(rig.drive.value(index), 7) << index;
  }
}

TEST(Sheet, WithoutTheCyclicObjectsItIsRefusedBeforeAnythingIsSent) {
  const SheetRig no_target(
      servo().remove(0x607A).remove(0x60FF).remove(0x6071).remove(0x60B1).remove(0x60B2));
  EXPECT_NE(no_target.error.find("no position, velocity or torque target"), std::string::npos)
      << no_target.error;
  const SheetRig no_status(servo().remove(0x6041));
  EXPECT_NE(no_status.error.find("carry of axis 0 not 6041 (the sheet does not have it)"),
            std::string::npos)
      << no_status.error;
  EXPECT_NE(no_status.error.find("COB-ID"), std::string::npos) << no_status.error;
}

TEST(Sheet, AFaultOfTheDriveIsLatchedAndResetByAnEdge) {
  SheetRig rig(servo());
  ASSERT_TRUE(rig.bring_up());
  rig.steps(5);
  rig.drive.fault();
  rig.steps(5);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.state.fault()[0], 0x8611u);
  rig.master->reset();
  rig.steps(50);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
}

TEST(Sheet, IsToldInWords) {
  const auto use = use_of(interpolating().sheet);
  ASSERT_TRUE(use) << use.error().to_string();
  const auto how = [&](const char* what) {
    const auto found = std::ranges::find(use->does, what, &DriveFact::what);
    return found != use->does.end() ? found->how : "";
  };
  EXPECT_EQ(how("position"), "mode 7 (interpolated position), target 60C1:1");
  EXPECT_EQ(how("RPDO 1"), "6040 60C1:1 6060 (7 bytes)");
  EXPECT_EQ(how("TPDO 1"), "6041 6064 6077 (8 bytes)");
  EXPECT_EQ(how("watching"), "node guarding");
  const auto misses = [&](const char* begin) {
    return std::ranges::any_of(use->misses,
                               [&](const std::string& text) { return text.starts_with(begin); });
  };
  EXPECT_TRUE(misses("velocity control"));
  EXPECT_TRUE(misses("compliant joints"));
  EXPECT_FALSE(misses("velocity feedback"));
  EXPECT_FALSE(use_of(DataSheet{}));
}

TEST(Sheet, OfADriveThatMissesADeadMasterIsWarnedOf) {
  SheetRig rig(servo().remove(0x1016));
  const auto warnings = drive_warnings(rig.robot);
  ASSERT_TRUE(warnings);
  ASSERT_EQ(warnings->size(), 1U);
  EXPECT_NE((*warnings)[0].to_string().find("does not notice when the master dies"),
            std::string::npos);
  EXPECT_EQ((*warnings)[0].key, "board 'board_0'");
  EXPECT_TRUE(drive_warnings(SheetRig(servo()).robot)->empty());
  EXPECT_TRUE(drive_warnings(test::classic_config())->empty()) << "our own boards";
}

TEST(Sheet, WithoutTheBusBitRateIsWarnedOfOnCanAlone) {
  SheetRig rig(servo().remove(0x1016));
  auto sheet = std::make_shared<canopen::DataSheet>(*rig.robot.boards[0].sheet);
  sheet->bit_rates_kbit_s = {125, 250};
  rig.robot.boards[0].sheet = sheet;
  const auto warnings = drive_warnings(rig.robot);
  ASSERT_TRUE(warnings);
  ASSERT_EQ(warnings->size(), 2U);
  EXPECT_NE((*warnings)[0].to_string().find("has 125, 250 kbit/s"), std::string::npos)
      << (*warnings)[0].to_string();
  rig.robot.buses[0].kind =
      BusKind::kEthercat;  // and there the slave's watchdog sees a dead master
  const auto others = drive_warnings(rig.robot);
  ASSERT_TRUE(others) << others.error().to_string();
  EXPECT_TRUE(others->empty());
  // What it does then is said nowhere, on either wire.
  SheetRig mute(servo().remove(0x6007));
  mute.robot.buses[0].kind = BusKind::kEthercat;
  const auto unsaid = drive_warnings(mute.robot);
  ASSERT_TRUE(unsaid) << unsaid.error().to_string();
  ASSERT_EQ(unsaid->size(), 1U);
  EXPECT_NE((*unsaid)[0].to_string().find("no 6007"), std::string::npos);
}

TEST(Sheet, WhoseMappingNoFrameCarriesIsWarnedOfOnceForAllItsBoards) {
  SheetRig rig(servo());
  auto sheet = std::make_shared<canopen::DataSheet>(*rig.robot.boards[0].sheet);
  for (canopen::SheetEntry& entry : sheet->entries) {
    if (entry.index != 0x1A00) continue;
    if (entry.sub == 0) entry.line = 700;
    entry.value = canopen::SheetValue{.number = entry.sub == 0 ? 3 : 0x60640020};
  }
  sheet->file = "drive.eds";
  rig.robot.boards[0].sheet = sheet;
  const auto warnings = drive_warnings(rig.robot);
  ASSERT_TRUE(warnings);
  ASSERT_EQ(warnings->size(), 1U);
  EXPECT_TRUE((*warnings)[0].to_string().starts_with("drive.eds:700: [1A00] maps 96 bits"))
      << (*warnings)[0].to_string();
}

}  // namespace
}  // namespace tandem::hal::can
