// The master against drives that have profile position and profile velocity alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hal/config/capabilities.hpp"
#include "hal/config/drive_ranges.hpp"
#include "hal/ethercat-can/drive_use.hpp"
#include "sheet_rig.hpp"

namespace tandem::hal::can {
namespace {

using namespace test;

constexpr double kVelocity_rad_s = 2.0;
constexpr double kAcceleration_rad_s2 = 10.0;
constexpr double kEnd_rad = 1.0;

/// source: KITmedical/kacanopen_old eds/Faulhaber (the objects and 6502; the entries are our own)
Sheet profile_drive(std::int64_t modes = 0x25) {
  Sheet s = common();
  s.add(0x1016, 1, kUnsigned32, kSetting, 0);
  s.add(0x607A, 0, kInteger32, kDemand, 0);
  s.add(0x607F, 0, kUnsigned32, kSetting, 0);
  s.add(0x6081, 0, kUnsigned32, kDemand, 0);
  s.add(0x6083, 0, kUnsigned32, kDemand, 30000);
  s.add(0x6084, 0, kUnsigned32, kDemand, 30000);
  s.add(0x60FF, 0, kInteger32, kDemand, 0);
  s.add(0x6502, 0, kUnsigned32, canopen::kRead, modes);
  return s.remove(0x6077);
}

void limited(RobotConfig& robot) {
  JointConfig& joint = robot.joints[0];
  joint.max_velocity_rad_s = kVelocity_rad_s;
  joint.max_acceleration_rad_s2 = kAcceleration_rad_s2;
  joint.min_position_rad = -kEnd_rad;
  joint.max_position_rad = kEnd_rad;
}

struct ProfileRig : SheetRig {
  explicit ProfileRig(const Sheet& s = profile_drive()) : SheetRig(s, limited) {}
  [[nodiscard]] double at_rad() { return static_cast<double>(drive.value(0x6064)) * kRadPerCount; }
  /// A cycle of the reference.
  void refer(double position_rad, double velocity_rad_s) {
    command.position_rad()[0] = position_rad;
    command.velocity_rad_s()[0] = velocity_rad_s;
    step();
  }
  /// To and fro from rest at 0. @return the largest distance between reference and joint
  double follow_sine(double amplitude_rad, double rad_s, int cycles) {
    double worst = 0.0;
    for (int i = 0; i < cycles; ++i) {
      const double t = 1e-3 * i;
      const double position = amplitude_rad * (1.0 - std::cos(rad_s * t));
      refer(position, amplitude_rad * rad_s * std::sin(rad_s * t));
      worst = std::max(worst, std::abs(at_rad() - position));
    }
    return worst;
  }
  /// SYNC alone goes on, as when the loop is stuck and the bus has another producer.
  void sync_alone(int count) {
    for (int i = 0; i < count; ++i) {
      drive.receive(Frame{.id = 0x80, .length = 0});
      drive.out.clear();
    }
  }
  void run_at(double rad_s, double from_rad, double to_rad) {
    for (double at = from_rad; at < to_rad; at += 1e-3 * rad_s) refer(at, rad_s);
  }
};

TEST(ProfileDrive, GetsTheJointsLimits) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.steps(20);
  EXPECT_TRUE(rig.drive.aborts.empty());
  EXPECT_EQ(rig.drive.value(0x6060), 1);
  for (const int index : {0x607F, 0x6081}) {
    EXPECT_EQ(rig.drive.value(index), std::llround(kVelocity_rad_s / kRadPerCount));
  }
  for (const int index : {0x6083, 0x6084}) {
    EXPECT_EQ(rig.drive.value(index), std::llround(kAcceleration_rad_s2 / kRadPerCount));
  }
  EXPECT_EQ(static_cast<ControlMode>(rig.state.mode()[0]), ControlMode::kPosition);
}

TEST(ProfileDrive, FirstSetPointIsTheMeasuredPosition) {
  ProfileRig rig(profile_drive().add(0x6064, 0, kInteger32, kActual, 1234));
  ASSERT_TRUE(rig.bring_up());
  rig.steps(10);  // the reference is 0
  ASSERT_FALSE(rig.drive.set_points.empty());
  EXPECT_EQ(rig.drive.set_points.front(), 1234);
}

/// A set-point takes four cycles: bit 4 up, bit 12 up, down, down. The joint is so far behind at
/// most; without the braking way in the set-point it would be v^2 / 2a = 0.04 rad behind.
TEST(ProfileDrive, FollowsATrajectoryWithinAHandshake) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.steps(20);
  const double worst = rig.follow_sine(0.3, 3.0, 4000);
  EXPECT_LT(worst, 5e-3 * 0.3 * 3.0 + kRadPerCount);
  EXPECT_GT(rig.drive.set_points.size(), 900U);
  EXPECT_LE(rig.drive.fastest * kRadPerCount, kVelocity_rad_s);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
}

TEST(ProfileDrive, ComesToRestWhereItWouldBrakeWhenNothingMoreComes) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.run_at(1.0, 0.0, 0.7);
  const double from = rig.at_rad();
  EXPECT_NEAR(from, 0.7, 0.01);
  rig.sync_alone(1000);
  EXPECT_NEAR(rig.at_rad() - from, 1.0 / (2 * kAcceleration_rad_s2), 0.01);
  const double rest = rig.at_rad();
  rig.sync_alone(100);
  EXPECT_EQ(rig.at_rad(), rest);
}

TEST(ProfileDrive, NoSetPointIsBeyondTheJointsRange) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.run_at(2.0, 0.0, kEnd_rad);  // a controller that does not brake
  const auto most = *std::max_element(rig.drive.set_points.begin(), rig.drive.set_points.end());
  EXPECT_LE(static_cast<double>(most) * kRadPerCount, kEnd_rad + kRadPerCount);
}

TEST(ProfileDrive, HoldBringsItToRestWithoutTurningBack) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.run_at(1.0, 0.0, 0.7);
  const double from = rig.at_rad();
  rig.master->stop(StopCategory::kHold);
  double furthest = from;
  for (int i = 0; i < 1000; ++i) {
    rig.exchange();
    const rt::ScopedRealtime in_cycle;
    (void)rig.master->send(rig.command, rig.parameters);  // whose reference stands still
    furthest = std::max(furthest, rig.at_rad());
  }
  EXPECT_NEAR(furthest - from, 1.0 / (2 * kAcceleration_rad_s2), 0.01);
  EXPECT_NEAR(rig.at_rad(), furthest, kRadPerCount);
  EXPECT_TRUE(rig.drive.enabled());
}

TEST(ProfileDrive, QuickStopDisablesIt) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.run_at(1.5, 0.0, 0.3);
  rig.master->stop(StopCategory::kCategory1);
  rig.steps(100);
  EXPECT_FALSE(rig.drive.enabled());
  const double rest = rig.at_rad();
  rig.command.position_rad()[0] = rest;
  rig.command.velocity_rad_s()[0] = 0.0;
  rig.drive.set_points.clear();
  rig.master->reset();
  rig.steps(100);
  ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  EXPECT_TRUE(rig.drive.enabled());
  ASSERT_FALSE(rig.drive.set_points.empty())
      << "a drive that is enabled again gets a set-point again";
  EXPECT_NEAR(static_cast<double>(rig.drive.set_points.front()) * kRadPerCount, rest, 1e-9);
}

TEST(ProfileDrive, ADriveThatIsSlowToTakeASetPointFollowsLater) {
  ProfileRig rig;
  rig.drive.set_point_ms = 7;
  ASSERT_TRUE(rig.bring_up());
  rig.steps(50);
  EXPECT_LT(rig.follow_sine(0.3, 3.0, 3000), 20e-3 * 0.3 * 3.0);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
}

TEST(ProfileDrive, ADriveThatTakesNoSetPointIsAFault) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.steps(20);
  rig.drive.takes_set_points = false;
  for (int i = 0; i < 1500; ++i) rig.refer(std::min(0.9, 1e-3 * i), 1.0);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.state.fault()[0], 0x8611U) << "it does not follow";
}

TEST(ProfileDrive, ChangesToVelocityAndBackWithoutAJump) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.ask(ControlMode::kVelocity);
  for (int i = 0; i < 400; ++i) rig.refer(0.0, 1.0);
  EXPECT_EQ(rig.drive.value(0x6060), 3);
  EXPECT_EQ(static_cast<ControlMode>(rig.state.mode()[0]), ControlMode::kVelocity);
  EXPECT_NEAR(rig.at_rad(), 0.4 - 0.05, 0.01) << "1 rad/s after a ramp of 0.1 s";
  for (int i = 0; i < 300; ++i) rig.refer(0.0, 0.0);
  const double rest = rig.at_rad();
  rig.ask(ControlMode::kPosition);
  for (int i = 0; i < 300; ++i) rig.refer(rest, 0.0);
  EXPECT_EQ(rig.drive.value(0x6060), 1);
  EXPECT_NEAR(rig.at_rad(), rest, kRadPerCount);
  rig.run_at(0.5, rest, rest + 0.2);
  EXPECT_NEAR(rig.at_rad(), rest + 0.2, 0.01);
}

TEST(ProfileDrive, HoldEndsAVelocity) {
  ProfileRig rig;
  ASSERT_TRUE(rig.bring_up());
  rig.ask(ControlMode::kVelocity);
  for (int i = 0; i < 300; ++i) rig.refer(0.0, 1.0);
  const double from = rig.at_rad();
  rig.master->stop(StopCategory::kHold);
  rig.steps(1000);
  EXPECT_NEAR(rig.at_rad() - from, 0.05, 0.02) << "v^2 / 2a";
}

TEST(ProfileDrive, HasNoTorqueAndNoCompliance) {
  const ProfileRig rig;
  EXPECT_TRUE(check_capability(rig.robot, 0, ControlMode::kPosition, InteractionMode::kStiff));
  EXPECT_TRUE(check_capability(rig.robot, 0, ControlMode::kVelocity, InteractionMode::kStiff));
  for (const auto& [mode, interaction] : {std::pair{ControlMode::kTorque, InteractionMode::kStiff},
                                          {ControlMode::kPosition, InteractionMode::kCompliant}}) {
    const Status refused = check_capability(rig.robot, 0, mode, interaction);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().to_string().find("its drive has no such mode"), std::string::npos);
  }
}

/// It would run on when the master is dead.
TEST(ProfileDrive, VelocityNeedsADriveThatWatchesItsMaster) {
  const ProfileRig rig(profile_drive().remove(0x1016));
  ASSERT_TRUE(rig.master) << rig.error;
  EXPECT_TRUE(check_capability(rig.robot, 0, ControlMode::kPosition, InteractionMode::kStiff));
  EXPECT_FALSE(check_capability(rig.robot, 0, ControlMode::kVelocity, InteractionMode::kStiff));
}

TEST(ProfileDrive, WithoutWhatItNeedsIsRefusedByName) {
  struct Row {
    const char* what;
    Sheet sheet;
  };
  const Row rows[] = {
      {"(profile torque)", profile_drive(0x08)},
      {"(profile position)", profile_drive(0x01).remove(0x6081)},
      {"(profile velocity)", profile_drive(0x04).remove(0x1016)},
      {"(profile position, profile velocity)", profile_drive().remove(0x6083).remove(0x6084)},
  };
  for (const Row& row : rows) {
    const ProfileRig rig(row.sheet);
    EXPECT_EQ(rig.master, nullptr) << row.what;
    EXPECT_NE(
        rig.error.find("Its modes (6502) make their own way to a target " + std::string(row.what)),
        std::string::npos)
        << rig.error;
  }
}

TEST(ProfileDrive, WithACyclicModeTheProfileModesAreNotUsed) {
  SheetRig rig(interpolating().add(0x607A, 0, kInteger32, kDemand, 0));
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x6060), 7);
}

TEST(ProfileDrive, LimitsInOtherUnitsThanTheDrivesAreRefused) {
  Sheet s = profile_drive();
  for (SheetEntry& entry : s.sheet.entries) {
    if (entry.index == 0x6081) entry.high = 3000;  // rpm
    if (entry.index == 0x6083) entry.high = 320;   // rev/s^2
  }
  ProfileRig rig(s);
  JointConfig& joint = rig.robot.joints[0];
  auto errors = check_drive_ranges(rig.robot, joint);
  ASSERT_EQ(errors.size(), 2U) << "11459 counts/s, 57296 counts/s^2";
  EXPECT_NE(errors[0].key.find("velocity_units_per_rev"), std::string::npos) << errors[0].key;
  EXPECT_NE(errors[1].key.find("acceleration_units_per_rev"), std::string::npos) << errors[1].key;
  joint.velocity_units_per_rev = 60.0 * 100;
  joint.acceleration_units_per_rev = 100;
  EXPECT_TRUE(check_drive_ranges(rig.robot, joint).empty());
}

TEST(ProfileDrive, IsToldInWords) {
  const auto use = use_of(profile_drive().sheet);
  ASSERT_TRUE(use) << use.error().to_string();
  const auto how = [&](const char* what) {
    const auto found = std::ranges::find(use->does, what, &DriveFact::what);
    return found != use->does.end() ? found->how : "";
  };
  EXPECT_EQ(how("position"), "mode 1 (profile position), target 607A");
  EXPECT_EQ(how("velocity"), "mode 3 (profile velocity), target 60FF");
  const auto facts = drive_facts(ProfileRig().robot);
  ASSERT_EQ(facts.size(), 1U);
  EXPECT_TRUE(
      facts[0].how.starts_with("by ramps of its own: profile position (mode 1), profile "
                               "velocity (mode 3), no torque; 605A is set to 2"))
      << facts[0].how;
}

}  // namespace
}  // namespace tandem::hal::can
