// What the master finds by itself of a joint that moves beyond its limits, on a drive that does not
// watch them.
#include <cmath>

#include "hal/ethercat-can/axis_codec.hpp"
#include "tests/ethercat_can/deaf_rig.hpp"

namespace tandem::hal::can {
namespace {

using test::DeafRig;
using test::servo;
using test::SheetRig;

/// The limits' wire values: what the drive says when the joint has `share` of a limit.
struct FastRig : DeafRig {
  explicit FastRig(Change change = nullptr) : DeafRig(change) {
    scale = AxisScale::of(robot, robot.joints[0]);
  }
  void show(double velocity_share, double torque_share) {
    const JointConfig& joint = robot.joints[0];
    drive.value(0x606C) =
        std::llround(velocity_share * joint.max_velocity_rad_s * scale.velocity_per_rad_s);
    drive.value(0x6077) = std::llround(torque_share * joint.max_torque_Nm * scale.mille_per_Nm);
  }
  AxisScale scale;
};

void on(SheetRig& rig, ControlMode mode) {
  ASSERT_TRUE(rig.bring_up());
  rig.ask(mode);
  rig.steps(20);
}

TEST(Motion, FasterThanItMayIsAFaultInEveryMode) {
  for (const ControlMode mode :
       {ControlMode::kPosition, ControlMode::kVelocity, ControlMode::kTorque}) {
    SCOPED_TRACE(static_cast<int>(mode));
    FastRig rig;
    on(rig, mode);
    rig.show(1.45, 0.1);
    rig.steps(1000);
    EXPECT_EQ(rig.master->phase(), Phase::kOperational) << "1.5 times the limit";
    rig.show(-1.55, 0.1);
    EXPECT_NEAR(rig.until_fault(), 202, 2) << "0.2 s";
    EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kTooFast);
    EXPECT_EQ(rig.state.fault()[0], 0x8400U);
    EXPECT_NE(rig.told().find("moves beyond its limits"), std::string::npos) << rig.told();
    rig.steps(5);
    EXPECT_EQ(rig.drive.value(0x6040), 0x0002) << "it can brake";
  }
}

TEST(Motion, TorqueAndPowerBeyondTheirLimitsAreFaults) {
  FastRig strong;
  on(strong, ControlMode::kPosition);
  strong.show(0.0, -1.6);
  EXPECT_NEAR(strong.until_fault(), 202, 2);
  EXPECT_EQ(strong.master->fault_cause(0), FaultCause::kTooStrong);
  FastRig powerful;
  on(powerful, ControlMode::kPosition);
  powerful.show(1.3, -1.3);
  EXPECT_NEAR(powerful.until_fault(), 202, 2);
  EXPECT_EQ(powerful.master->fault_cause(0), FaultCause::kTooPowerful);
}

TEST(Motion, ForAShorterTimeIsAnImpact) {
  FastRig rig;
  on(rig, ControlMode::kPosition);
  for (int n = 0; n < 5; ++n) {
    rig.show(3.0, 3.0);
    rig.steps(190);
    rig.show(0.5, 0.5);
    rig.steps(200);
  }
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
}

TEST(Motion, ThatIsSeldomWithinItsLimitsIsNoImpact) {
  FastRig rig;
  on(rig, ControlMode::kPosition);
  for (int n = 0; n < 2; ++n) {
    rig.show(3.0, 0.0);
    rig.steps(190);
    rig.show(0.5, 0.0);
    rig.steps(10);
  }
  EXPECT_EQ(rig.master->fault_cause(0), FaultCause::kTooFast);
}

TEST(Motion, TakesMarginAndTimeOfTheFileAndIsNotWatchedAtZero) {
  FastRig wide([](RobotConfig& robot) {
    robot.joints[0].max_excess = 0.5;
    robot.joints[0].excess_time_s = 0.3;
  });
  on(wide, ControlMode::kPosition);
  wide.show(1.95, 0.0);
  wide.steps(1000);
  EXPECT_EQ(wide.master->phase(), Phase::kOperational);
  wide.show(2.1, 0.0);
  EXPECT_NEAR(wide.until_fault(), 402, 2);
  FastRig off([](RobotConfig& robot) { robot.joints[0].max_excess = 0.0; });
  on(off, ControlMode::kPosition);
  off.show(9.0, 9.0);
  off.steps(2000);
  EXPECT_EQ(off.master->phase(), Phase::kOperational);
}

/// Its motor swings about a reference that stands, with this torque against the velocity's phase.
int until_it_swings(FastRig& rig, double lead_rad, double velocity_share) {
  on(rig, ControlMode::kPosition);
  rig.drive.deaf = true;
  const double w = 2.0 * test::kPi * 2.0;
  const double amplitude_rad = velocity_share * rig.robot.joints[0].max_velocity_rad_s / w;
  const std::int64_t middle = rig.drive.value(0x607A);
  for (int k = 0; k < 6000; ++k) {
    if (rig.state.fault()[0] != 0) return k;
    const double t = 1e-3 * k;
    rig.drive.value(0x607A) =
        middle + std::llround(amplitude_rad * std::sin(w * t) * rig.scale.counts_per_rad);
    rig.drive.value(0x6077) =
        std::llround(5.0 * std::cos(w * t + lead_rad) * rig.scale.mille_per_Nm);
    rig.step();
  }
  return -1;
}

TEST(Motion, ALoopThatKeepsItsJointSwingingIsAFault) {
  FastRig swings;
  const int taken = until_it_swings(swings, 0.5, 0.4);
  EXPECT_NEAR(taken, 2000, 200) << "eight half-swings of 2 Hz";
  EXPECT_EQ(swings.master->fault_cause(0), FaultCause::kSwings);
  EXPECT_EQ(swings.state.fault()[0], 0xFF03U);
  FastRig shaken;
  EXPECT_EQ(until_it_swings(shaken, 0.5 + test::kPi, 0.4), -1) << "it brakes";
  FastRig little;
  EXPECT_EQ(until_it_swings(little, 0.5, 0.2), -1) << "below a quarter of its velocity";
}

}  // namespace
}  // namespace tandem::hal::can
