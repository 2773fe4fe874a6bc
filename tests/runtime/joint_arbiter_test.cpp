// Who leads a joint: the table of situations, and what the arbiter says of a run.
#include "runtime/joint_arbiter.hpp"

#include <array>

#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

struct Row {
  const char* what;
  JointSituation joint;
  JointLead lead;
};

constexpr Row kRows[] = {
    {"bring-up", {.claimed = true, .unhomed = true}, JointLead::kEnabling},
    {"a reset", {.phase = RunPhase::kResetting, .claimed = true}, JointLead::kEnabling},
    {"settling", {.phase = RunPhase::kSettling, .claimed = true}, JointLead::kHold},
    {"nobody's", {.phase = RunPhase::kRunning}, JointLead::kHold},
    {"claimed", {.phase = RunPhase::kRunning, .claimed = true}, JointLead::kController},
    {"owned", {.phase = RunPhase::kRunning, .claimed = true, .owned = true}, JointLead::kOwner},
    {"moved", {.phase = RunPhase::kRunning, .moving = true}, JointLead::kOperator},
    {"moved while held",
     {.phase = RunPhase::kHeld, .claimed = true, .moving = true},
     JointLead::kOperator},
    {"a retreat", {.phase = RunPhase::kRetreating, .claimed = true}, JointLead::kRetreat},
    {"beside it", {.phase = RunPhase::kRetreating}, JointLead::kHold},
    {"moved beside it", {.phase = RunPhase::kRetreating, .moving = true}, JointLead::kHold},
    {"its drive is reset",
     {.phase = RunPhase::kRunning, .moving = true, .resetting = true},
     JointLead::kReset},
    {"while held",
     {.phase = RunPhase::kHeld, .claimed = true, .resetting = true},
     JointLead::kReset},
    {"but claimed",
     {.phase = RunPhase::kRunning, .claimed = true, .resetting = true},
     JointLead::kController},
    {"homed", {.phase = RunPhase::kHeld, .moving = true, .homing = true}, JointLead::kHoming},
    {"homed before all else",
     {.phase = RunPhase::kRunning, .claimed = true, .resetting = true, .homing = true},
     JointLead::kHoming},
    {"homed in a retreat", {.phase = RunPhase::kRetreating, .homing = true}, JointLead::kHoming},
    {"to be homed",
     {.phase = RunPhase::kRunning, .claimed = true, .unhomed = true},
     JointLead::kUnhomed},
    {"to be homed, the owner's",
     {.phase = RunPhase::kRunning, .claimed = true, .owned = true, .unhomed = true},
     JointLead::kUnhomed},
    {"to be homed, in a retreat",
     {.phase = RunPhase::kRetreating, .claimed = true, .unhomed = true},
     JointLead::kUnhomed},
    {"to be homed, nobody's", {.phase = RunPhase::kRunning, .unhomed = true}, JointLead::kHold},
    {"stopped", {.phase = RunPhase::kFaulted, .claimed = true, .moving = true}, JointLead::kHold},
    {"without torque",
     {.phase = RunPhase::kFaulted, .released = true, .homing = true},
     JointLead::kNobody},
    {"the end", {.phase = RunPhase::kShutDown, .claimed = true}, JointLead::kHold},
    {"after it", {.phase = RunPhase::kDone}, JointLead::kNobody},
};

TEST(JointLead, IsWhatTheTableSays) {
  for (const Row& row : kRows) EXPECT_EQ(lead_of(row.joint), row.lead) << row.what;
}

using JointArbiterTest = test::JointServices;

TEST_F(JointArbiterTest, SaysWhoLeadsAJointOfARun) {
  EXPECT_EQ(cycle->lead(0), JointLead::kController);
  EXPECT_EQ(cycle->lead(1), JointLead::kHold);
  ASSERT_TRUE(services().move_joint("elbow", {.target_rad = 0.5}, RunServices::Patience{0}));
  steps(2);
  EXPECT_EQ(cycle->lead(1), JointLead::kOperator);
  EXPECT_EQ(cycle->lead(2), JointLead::kHold);
  steps(20'000);
  EXPECT_EQ(cycle->lead(1), JointLead::kHold) << "it has arrived";
  (void)cycle->inbox().emergency_stop(hal::StopCategory::kCategory0);
  steps(1);
  EXPECT_EQ(cycle->lead(0), JointLead::kNobody);
}

/// A robot in the phase running, whose elbow a test makes ill and homes.
struct JointParts : testing::Test {
  struct Robot final : test::FirstOrderRobot {
    using FirstOrderRobot::FirstOrderRobot;
    bool home(std::size_t joint) noexcept override {
      of[joint] = {.state = hal::HomingState::kHoming};
      return true;
    }
    hal::Homing homing(std::size_t joint) const noexcept override { return of[joint]; }
    std::array<hal::Homing, 3> of{};
  };
  static hal::RobotConfig homed_elbow() {
    hal::RobotConfig robot = hal::test::fake_robot();
    robot.joints[1].homing.emplace().required = true;
    return robot;
  }
  JointParts() {
    backend.of[1].state = hal::HomingState::kNotHomed;
    now.run.on(RunEvent::kEnabled, 0);
    EXPECT_TRUE(now.run.in(RunPhase::kRunning));
  }
  void be_ill(bool ill) {
    now.state.fault()[1] = ill ? 0x7310 : 0;
    now.state.drive_state()[1] = static_cast<std::uint8_t>(
        ill ? hal::DriveState::kFault : hal::DriveState::kOperationEnabled);
  }

  hal::RobotConfig robot = homed_elbow();
  Robot backend{robot};
  ControllerHost host{robot, nullptr, 1'000'000};
  rt::WallClock clock;
  CycleNow now{CycleParts{robot, backend, host, clock}, {}};
  DriveResets resets{now};
  hal::CommandImage command{robot.shape()};
};

TEST_F(JointParts, AResetIsToldOnceAndEndsWhenItsDriveIsWell) {
  be_ill(true);
  EXPECT_EQ(resets.begin(1).reason, RejectReason::kNone);
  EXPECT_TRUE(resets.is_on(1) && resets.begins(1));
  command.mode()[1] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
  resets.watch(command);
  EXPECT_TRUE(resets.is_on(1));
  EXPECT_FALSE(resets.begins(1));
  be_ill(false);
  now.state.drive_state()[1] = static_cast<std::uint8_t>(hal::DriveState::kSwitchOnDisabled);
  resets.watch(command);
  EXPECT_TRUE(resets.is_on(1)) << "it is not enabled";
  be_ill(false);
  resets.watch(command);
  EXPECT_FALSE(resets.is_on(1));
}

TEST_F(JointParts, AResetEndsWithAStopOrItsTime) {
  be_ill(true);
  EXPECT_EQ(resets.begin(1).reason, RejectReason::kNone);
  resets.fail();
  EXPECT_FALSE(resets.is_on(1));
  EXPECT_EQ(resets.begin(1).reason, RejectReason::kNone);
  for (int i = 0; i < 3999; ++i) resets.watch(command);
  EXPECT_TRUE(resets.is_on(1));
  resets.watch(command);
  EXPECT_FALSE(resets.is_on(1));
}

TEST_F(JointParts, AHomingIsNeededUntilItHasFoundTheJoint) {
  be_ill(false);
  JointHoming homing(now, resets);
  EXPECT_TRUE(homing.is_needed(1));
  EXPECT_FALSE(homing.is_needed(0));
  EXPECT_EQ(homing.begin(0).reason, RejectReason::kHomedThere);
  EXPECT_EQ(homing.begin(1).reason, RejectReason::kNone);
  EXPECT_EQ(homing.begin(1).reason, RejectReason::kHoming);
  EXPECT_TRUE(homing.is_on(1));
  EXPECT_FALSE(homing.next_ended());
  backend.of[1].state = hal::HomingState::kHomed;
  EXPECT_EQ(homing.next_ended(), 1U);
  EXPECT_FALSE(homing.next_ended()) << "once";
  EXPECT_FALSE(homing.is_needed(1) || homing.is_on(1));
}

TEST_F(JointParts, AHomingIsRefusedToADriveThatIsIllOrReset) {
  JointHoming homing(now, resets);
  be_ill(true);
  EXPECT_EQ(homing.begin(1).reason, RejectReason::kDriveFault);
  EXPECT_EQ(resets.begin(1).reason, RejectReason::kNone);
  EXPECT_EQ(homing.begin(1).reason, RejectReason::kResetting);
}

}  // namespace
}  // namespace tandem::runtime
