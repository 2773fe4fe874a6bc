// Drives that behave as those of others were seen to: heartbeats before samples, stops that are
// ignored, causes that no PDO has, PDOs that cannot be switched off.
#include "hal/ethercat-can/drive_use.hpp"
#include "tests/ethercat_can/sheet_rig.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using canopen::SheetEntry;
using test::kRadPerCount;
using test::kSetting;
using test::servo;
using test::Sheet;
using test::SheetRig;
using enum canopen::DataType;

/// CANopenNode sends its heartbeat at each change of state, and its first sample later.
TEST(ForeignWays, AHeartbeatBeforeTheFirstSampleIsNoSilence) {
  for (const int syncs : {0, 1, 2, 5, 9}) {
    SheetRig rig(servo());
    rig.drive.tells_states = true;
    rig.drive.first_syncs_unanswered = syncs;
    EXPECT_TRUE(rig.bring_up()) << syncs;
  }
  SheetRig silent(servo());
  silent.drive.tells_states = true;
  silent.drive.first_syncs_unanswered = 1'000'000;
  EXPECT_FALSE(silent.bring_up());
  EXPECT_NE(silent.master->status_text().find("no complete TPDO for 10 cycles"), std::string::npos)
      << silent.master->status_text();
}

TEST(ForeignWays, ANodeThatWasToldToStartIsWaitedFor) {
  SheetRig rig(servo());
  EXPECT_TRUE(rig.master->answering(0).none());
  for (int i = 0; i < 3000 && !rig.drive.operational(); ++i) rig.step();
  EXPECT_TRUE(rig.master->answering(0).test(5));
}

TEST(ForeignWays, AtTheEndNobodyWatchesTheMasterAnyMore) {
  SheetRig rig(servo());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_NE(rig.drive.value(0x1016, 1), 0);
  for (int i = 0; i < 100 && !rig.end(); ++i) {
    EXPECT_TRUE(!rig.drive.enabled() || rig.drive.value(0x1016, 1) != 0) << "not while it may move";
  }
  rig.exchange();
  EXPECT_EQ(rig.drive.value(0x1016, 1), 0) << "a silent master would be its error 8130";
  EXPECT_FALSE(rig.drive.operational());
}

TEST(ForeignWays, AtTheEndGuardingIsOverToo) {
  SheetRig rig(test::interpolating());
  ASSERT_TRUE(rig.bring_up());
  EXPECT_NE(rig.drive.value(0x100D), 0);
  for (int i = 0; i < 100 && !rig.end(); ++i) continue;
  rig.exchange();
  EXPECT_EQ(rig.drive.value(0x100D), 0);
}

/// KickCAT's emulated motor.
TEST(ForeignWays, ADriveThatIgnoresAQuickStopIsSentDisableVoltage) {
  SheetRig rig(servo());
  rig.drive.ignores_quick_stop = true;
  ASSERT_TRUE(rig.bring_up());
  rig.master->stop(StopCategory::kCategory1);
  rig.steps(290);
  EXPECT_TRUE(rig.drive.enabled());
  EXPECT_EQ(rig.drive.value(0x6040), 2);
  rig.steps(20);
  EXPECT_FALSE(rig.drive.enabled());
  rig.steps(1000);
  EXPECT_TRUE(rig.drive.operational()) << "it obeyed: no NMT stop";
  EXPECT_EQ(rig.state.fault()[0], 0U);
}

TEST(ForeignWays, SoItIsAtTheEndOfARun) {
  SheetRig rig(servo());
  rig.drive.ignores_quick_stop = true;
  ASSERT_TRUE(rig.bring_up());
  int taken = 0;
  while (!rig.end() && taken < 4000) ++taken;
  EXPECT_LT(taken, 320);
  EXPECT_FALSE(rig.drive.enabled());
  EXPECT_EQ(rig.master->status_text(), "") << "it obeyed";
}

/// A CANopenNode drive without 605A: at the end of a run the watch over the master was still armed.
TEST(ForeignWays, ADriveThatStaysInQuickStopActiveIsLetGoAtTheEnd) {
  SheetRig rig(servo().remove(0x605A));
  rig.drive.stays_in_quick_stop = true;
  ASSERT_TRUE(rig.bring_up());
  int taken = 0;
  while (!rig.end() && taken < 4000) ++taken;
  rig.exchange();
  EXPECT_LT(taken, 1100);
  EXPECT_EQ(rig.drive.value(0x6041), 0x0250);
  EXPECT_EQ(rig.drive.value(0x1016, 1), 0) << "a silent master would be its error 8130";
}

/// The scale of a joint that turns the other way round is negative: its drive was never let go.
TEST(ForeignWays, ADriveOfAReversedJointIsLetGoToo) {
  SheetRig rig(servo().remove(0x605A), [](RobotConfig& robot) { robot.joints[0].reversed = true; });
  rig.drive.stays_in_quick_stop = true;
  ASSERT_TRUE(rig.bring_up());
  rig.master->stop(StopCategory::kCategory1);
  rig.drive.value(0x606C) = 6000;
  rig.steps(1500);
  EXPECT_EQ(rig.drive.value(0x6041), 0x0217);
  rig.drive.value(0x606C) = 0;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x6041), 0x0250);
}

TEST(ForeignWays, AfterAStopItIsLetGoWhenItsRampIsOver) {
  SheetRig rig(servo().remove(0x605A));
  rig.drive.stays_in_quick_stop = true;
  ASSERT_TRUE(rig.bring_up());
  rig.master->stop(StopCategory::kCategory1);
  rig.drive.value(0x606C) = 6000;  // its ramp: 6000 counts/s are 1 rad/s
  rig.steps(1500);
  EXPECT_EQ(rig.drive.value(0x6041), 0x0217);
  rig.drive.value(0x606C) = 0;
  rig.steps(5);
  EXPECT_EQ(rig.drive.value(0x6041), 0x0250);
  EXPECT_EQ(rig.state.fault()[0], 0U);
}

TEST(ForeignWays, AfterAStartThatFailedNobodyWatchesTheMasterEither) {
  SheetRig rig(servo());
  rig.drive.refuses_operation = true;
  EXPECT_FALSE(rig.bring_up());
  EXPECT_NE(rig.drive.value(0x1016, 1), 0);
  for (int i = 0; i < 4000 && !rig.end(); ++i) continue;
  rig.exchange();
  EXPECT_EQ(rig.drive.value(0x1016, 1), 0);
}

TEST(ForeignWays, AFaultsCauseIsAskedForWhereNoPdoTellsIt) {
  SheetRig rig(servo().add(0x603F, 0, kUnsigned16, canopen::kRead));
  ASSERT_TRUE(rig.bring_up());
  rig.drive.fault();
  rig.steps(20);
  EXPECT_EQ(rig.state.fault()[0], 0x8611U);
  EXPECT_NE(rig.master->status_text().find("0x8611"), std::string::npos)
      << rig.master->status_text();
  rig.master->reset();
  rig.steps(100);
  ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  rig.drive.error = 0x2310;
  rig.drive.fault();
  rig.steps(20);
  EXPECT_EQ(rig.state.fault()[0], 0x2310U) << "it is asked anew";
}

TEST(ForeignWays, AnEmergencyBehindTheStatuswordIsTheFaultsCause) {
  SheetRig rig(servo().remove(0x603F));
  ASSERT_TRUE(rig.bring_up());
  rig.drive.fault();
  rig.steps(5);
  EXPECT_EQ(rig.state.fault()[0], 0x1000U);
  Frame emergency;
  emergency.id = 0x85;
  emergency.length = 8;
  emergency.data = {0x10, 0x32, 0x04, 0x77};  // byte 3 is the maker's own
  EXPECT_EQ(rig.bus.boards().send(std::array{emergency}), 1U);
  rig.steps(2);
  EXPECT_EQ(rig.state.fault()[0], 0x3210U);
}

// source: ipa320/cob_robots ElmoSimplIQ.dcf
TEST(ForeignWays, AMappingIsNoLongerThanItsHighLimit) {
  Sheet s = servo();
  for (int map = 0x1600; map < 0x1604; ++map) {
    s.add(map, 0, kUnsigned8, kSetting, 0);
    for (SheetEntry& entry : s.sheet.entries) {
      if (entry.index == map && entry.sub == 0) entry.high = 2;
    }
  }
  SheetRig rig(s);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_TRUE(rig.drive.aborts.empty());
  rig.command.position_rad()[0] = 100 * kRadPerCount;
  rig.steps(5);
  EXPECT_NEAR(rig.state.position_rad()[0], 100 * kRadPerCount, 1e-12);
}

TEST(ForeignWays, AMappingEndsBeforeAnEntryThatCannotBeWritten) {
  for (const int mapping : {0x1600, 0x1A00}) {
    for (const int sub : {2, 3}) {
      Sheet s = servo();
      s.add(mapping, sub, kUnsigned32, canopen::kRead, 0);
      SheetRig rig(s);
      ASSERT_TRUE(rig.bring_up()) << mapping << ' ' << sub;
      EXPECT_TRUE(rig.drive.aborts.empty());
      EXPECT_LT(rig.drive.value(mapping), sub);
    }
  }
}

/// Position PDOs as most drives have them from power-on.
Sheet with_default_mapping() {
  Sheet s = servo();
  const auto map = [&](int index, std::initializer_list<std::int64_t> entries) {
    s.add(index, 0, kUnsigned8, kSetting, static_cast<std::int64_t>(entries.size()));
    int sub = 0;
    for (const std::int64_t entry : entries) s.add(index, ++sub, kUnsigned32, kSetting, entry);
  };
  map(0x1600, {0x60400010, 0x607A0020});
  map(0x1A00, {0x60410010, 0x60640020});
  return s;
}

// source: ipa320/cob_robots ElmoSimplIQ.dcf; canopen-python #541
TEST(ForeignWays, APdoThatCannotBeSwitchedOffKeepsItsMapping) {
  for (const std::uint8_t access : {canopen::kRead, canopen::kWrite, canopen::kReadWrite}) {
    for (int which = 0; which < 15; ++which) {
      Sheet s = with_default_mapping();
      const bool writable = (access & canopen::kWrite) != 0;
      const auto id = [&](int bit, int parameter, int cob) {
        if ((which >> bit & 1) != 0) s.add(parameter, 1, kUnsigned32, access, cob, true);
      };
      id(0, 0x1400, 0x200);
      id(1, 0x1401, 0x300);
      id(2, 0x1800, 0x180);
      id(3, 0x1801, 0x280);
      SheetRig rig(s);
      ASSERT_TRUE(rig.bring_up()) << which << ' ' << int{access};
      EXPECT_TRUE(rig.drive.aborts.empty()) << which;
      const bool kept = !writable && (which & 1) != 0;
      EXPECT_TRUE(!kept || rig.drive.value(0x1600) == 2) << "as it was";
      rig.command.position_rad()[0] = 100 * kRadPerCount;
      rig.steps(5);
      EXPECT_NEAR(rig.state.position_rad()[0], 100 * kRadPerCount, 1e-12) << which;
    }
  }
}

TEST(ForeignWays, OneWhoseMappingLacksWhatIsNeededIsRefusedBeforeTheStart) {
  Sheet s = servo();
  for (int n = 0; n < 4; ++n) {
    s.add(0x1400 + n, 1, kUnsigned32, canopen::kRead, 0x200 + 0x100 * n, true);
    s.add(0x1800 + n, 1, kUnsigned32, canopen::kRead, 0x180 + 0x100 * n, true);
  }
  SheetRig rig(s);
  EXPECT_EQ(rig.master, nullptr);
  EXPECT_NE(rig.error.find("COB-ID"), std::string::npos) << rig.error;
}

// source: dianhuaeven/Eyou_Canopen_master config/YiyouServo_V1.4.dcfgen.eds
TEST(ForeignWays, ADriveByItsObjectsMayCallItselfSomethingElse) {
  for (const std::int64_t type : {0x00220811LL, 0x00020191LL, 0LL}) {
    const Sheet s = servo().add(0x1000, 0, kUnsigned32, canopen::kRead, type);
    SheetRig rig(s);
    EXPECT_TRUE(rig.bring_up()) << type;
    const auto told = drive_warnings(rig.robot);
    ASSERT_TRUE(told.has_value());
    EXPECT_TRUE(std::ranges::any_of(*told, [](const Error& e) { return e.key == "1000"; })) << type;
    SheetRig right(s);  // the sheet is wrong, and the drive is a drive
    right.drive = test::SheetDrive(servo().sheet, 5);
    EXPECT_TRUE(right.bring_up()) << type;
    SheetRig other(s);
    other.drive =
        test::SheetDrive(servo().add(0x1000, 0, kUnsigned32, canopen::kRead, 0x00030191).sheet, 5);
    EXPECT_FALSE(other.bring_up()) << type;
    EXPECT_NE(other.master->status_text().find("device type"), std::string::npos)
        << other.master->status_text();
  }
}

TEST(ForeignWays, WhatTheSheetSaysCannotBeReadIsNotChecked) {
  Sheet s = servo();
  s.add(0x6502, 0, kUnsigned32, canopen::kWrite, 0x3EF);
  s.add(0x1018, 1, kUnsigned32, canopen::kWrite, 0x99);
  s.add(0x1000, 0, kUnsigned32, canopen::kWrite, 0x00020192);
  SheetRig rig(s);
  EXPECT_TRUE(rig.bring_up());
  EXPECT_TRUE(rig.drive.aborts.empty());
}

}  // namespace
}  // namespace tandem::hal::can
