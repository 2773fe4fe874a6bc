// What an operator sets of joints while a run goes on: on first-order joints, between two steps.
#include <cmath>
#include <limits>

#include "log/log_file.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

using test::kNow;

using hal::ControlMode;
using hal::InteractionMode;
using hal::PidLoop;
using test::JointRun;
using test::JointServices;

TEST_F(JointServices, ShowEveryJointAfterTheLastCycle) {
  const auto joints = services().joints();
  ASSERT_EQ(joints.size(), 3U);
  EXPECT_EQ(joints[0].name, "shoulder");
  EXPECT_EQ(joints[0].owner, "sine");
  EXPECT_EQ(joints[1].owner, "");
  EXPECT_EQ(joints[0].look.cycle, 99U);
  EXPECT_EQ(joints[0].look.position_rad, cycle->state().position_rad()[0]);
  EXPECT_EQ(joints[1].gains[0].kp, 200.0);
}

TEST_F(JointServices, PutAJointIntoEachModeWhereItStands) {
  for (const ControlMode wanted :
       {ControlMode::kTorque, ControlMode::kVelocity, ControlMode::kIdle, ControlMode::kOpenLoop,
        ControlMode::kCurrent, ControlMode::kPosition}) {
    ASSERT_TRUE(mode("elbow", wanted));
    steps(1);
    EXPECT_EQ(look(1).mode, static_cast<std::int8_t>(wanted));
    EXPECT_EQ(cycle->command().position_rad()[1], cycle->state().position_rad()[1]);
    EXPECT_EQ(cycle->command().velocity_rad_s()[1], 0.0);
    steps(5);
    EXPECT_EQ(look(1).mode, static_cast<std::int8_t>(wanted)) << "it stays";
  }
  EXPECT_TRUE(cycle->faults().empty());
}

TEST_F(JointServices, SetInteractionAndImpedanceTogether) {
  ASSERT_TRUE(
      services().set_joint("wrist",
                           {.stiffness_Nm_rad = 20.0,
                            .damping_Nms_rad = 3.0,
                            .interaction = static_cast<std::int32_t>(InteractionMode::kCompliant)},
                           kNow));
  steps(1);
  EXPECT_EQ(look(2).interaction, static_cast<std::uint8_t>(InteractionMode::kCompliant));
  EXPECT_EQ(cycle->command().stiffness_Nm_rad()[2], 20.0);
  EXPECT_EQ(cycle->command().damping_Nms_rad()[2], 3.0);
}

TEST_F(JointServices, LeadAStiffnessOverWhileItYields) {
  ASSERT_TRUE(services().set_joint("wrist", {.stiffness_Nm_rad = 20.0, .interaction = 1}, kNow));
  steps(200);
  ASSERT_TRUE(services().set_joint("wrist", {.stiffness_Nm_rad = 50.0}, kNow));
  steps(1);
  EXPECT_EQ(cycle->command().stiffness_Nm_rad()[2], 20.0);
  double before = 20.0;
  for (int i = 0; i < 100; ++i) {
    steps(1);
    const double now = cycle->command().stiffness_Nm_rad()[2];
    EXPECT_GE(now, before);
    EXPECT_LT(now - before, 30.0 * 1.9 / 100.0);  // minimum jerk over a hundred cycles
    before = now;
  }
  EXPECT_EQ(before, 50.0);
}

// For 0.1 s the answer of `tandem joint set` was the old stiffness, and the joint was "moving".
TEST_F(JointServices, ShowWhatWasAskedForWhileTheCommandGoesOverToIt) {
  ASSERT_TRUE(services().set_joint("wrist", {.stiffness_Nm_rad = 20.0, .interaction = 1}, kNow));
  steps(200);
  ASSERT_TRUE(
      services().set_joint("wrist", {.stiffness_Nm_rad = 50.0, .damping_Nms_rad = 3.0}, kNow));
  for (int i = 0; i < 120; ++i) {
    steps(1);
    EXPECT_EQ(look(2).stiffness_Nm_rad, 50.0) << i;
    EXPECT_EQ(look(2).damping_Nms_rad, 3.0) << i;
    EXPECT_EQ(look(2).moving, 0) << i;
    if (i == 0) {
      EXPECT_EQ(cycle->command().stiffness_Nm_rad()[2], 20.0) << "without a step";
    }
  }
  EXPECT_EQ(cycle->command().stiffness_Nm_rad()[2], 50.0);
  ASSERT_TRUE(services().switch_controllers({"sine"}, {}, kNow));
  steps(1);
  EXPECT_EQ(look(0).moving, 0) << "nobody asked for a motion";
}

TEST(JointServicesOf, ADelayedRunShowWhatWasAskedForAtOnce) {
  JointRun run;
  run.begin({.delay_cycles = 5});
  run.steps(50);
  ASSERT_EQ(run.cycle->phase(), RunPhase::kRunning);
  ASSERT_TRUE(run.services().set_joint("elbow", {.stiffness_Nm_rad = 9.0, .interaction = 1}, kNow));
  run.steps(1);
  const JointStatus look = run.look(1);
  EXPECT_EQ(look.stiffness_Nm_rad, 9.0);
  EXPECT_EQ(look.interaction, static_cast<std::uint8_t>(InteractionMode::kCompliant));
}

TEST_F(JointServices, RefuseTheModeOfAClaimedJointAndNameItsController) {
  const std::string refused = text(mode("shoulder", ControlMode::kTorque));
  EXPECT_NE(refused.find("shoulder: is claimed by the controller 'sine'"), std::string::npos)
      << refused;
  ASSERT_TRUE(services().switch_controllers({"sine"}, {}, kNow));
  EXPECT_TRUE(mode("shoulder", ControlMode::kTorque)) << "nobody will have it";
  steps(1);
  EXPECT_EQ(look(0).mode, static_cast<std::int8_t>(ControlMode::kTorque));
}

TEST_F(JointServices, GiveAClaimedJointTheImpedanceThatItsControllerDoesNotWrite) {
  ASSERT_TRUE(services().set_joint("shoulder", {.stiffness_Nm_rad = 30.0}, kNow));
  steps(150);
  EXPECT_EQ(cycle->command().stiffness_Nm_rad()[0], 30.0);
  ASSERT_TRUE(services().switch_controllers({"sine"}, {}, kNow));
  steps(1);
  ASSERT_TRUE(services().switch_controllers({}, {"sine"}, kNow));
  steps(150);
  EXPECT_EQ(cycle->command().stiffness_Nm_rad()[0], 30.0) << "a start keeps it";
}

// The value that was not given became that of robot.toml, or of an earlier request.
TEST_F(JointServices, LeaveTheOtherValueOfAnImpedanceAsTheControllerWroteIt) {
  hal::CommandImage command = cycle->command();
  command.stiffness_Nm_rad()[0] = 1.0;
  command.damping_Nms_rad()[0] = 0.05;
  JointReferences& references = host->references();
  (void)references.set(0, {.stiffness_Nm_rad = 0.5}, true, {cycle->state(), command});
  EXPECT_EQ(command.stiffness_Nm_rad()[0], 0.5);
  EXPECT_EQ(command.damping_Nms_rad()[0], 0.05);
  command.stiffness_Nm_rad()[0] = 1.0;
  (void)references.set(0, {.damping_Nms_rad = 0.09}, true, {cycle->state(), command});
  EXPECT_EQ(command.stiffness_Nm_rad()[0], 1.0);
  EXPECT_EQ(command.damping_Nms_rad()[0], 0.09);
}

// "asked for" was the answer while time stood, and the joint never moved.
TEST_F(JointServices, RefuseToMoveAClaimedJointWithoutAskingTheLoop) {
  EXPECT_NE(text(services().move_joint("shoulder", {.target_rad = 0.3}, kNow))
                .find("is claimed by the controller 'sine'"),
            std::string::npos);
}

TEST_F(JointServices, RefuseWhatAJointCannotDoAndNameTheLimit) {
  EXPECT_NE(text(mode("elbwo", ControlMode::kIdle)).find("did you mean 'elbow'?"),
            std::string::npos);
  const auto stiff = [&](double value) {
    return text(services().set_joint("elbow", {.stiffness_Nm_rad = value}, kNow));
  };
  EXPECT_NE(stiff(201.0).find("elbow: the stiffness 201 Nm/rad is beyond the joint's limit (give 0 "
                              "to 200 Nm/rad)"),
            std::string::npos)
      << stiff(201.0);
  EXPECT_NE(stiff(-1.0).find("beyond"), std::string::npos);
  EXPECT_NE(stiff(std::numeric_limits<double>::infinity()).find("beyond"), std::string::npos);
  const auto gain = [&](double kp) {
    return text(services().set_gains("elbow", PidLoop::kPosition, {.kp = kp}, kNow));
  };
  EXPECT_NE(gain(-1.0).find("elbow: kp -1 is beyond"), std::string::npos);
  EXPECT_NE(gain(1e30).find("beyond the joint's limit"), std::string::npos) << "taken live before";
  EXPECT_NE(gain(std::nan("")).find("beyond"), std::string::npos);
  steps(2);
  EXPECT_EQ(services().joints()[1].gains[0].kp, 200.0);
}

// "the robot has no joint 'finger' (did you mean 'finger_l'?)", which /joint_states shows.
TEST(JointServicesOf, AFollowersNameNameItsLeader) {
  hal::RobotConfig robot = hal::test::fake_robot();
  robot.followers = {{"finger", 1, -1.0, 0.0}};
  JointRun run(robot);
  run.begin({.settle_cycles = 20});
  run.steps(100);
  EXPECT_EQ(run.text(run.services().move_joint("finger", {.target_rad = 0.1}, kNow)),
            "finger: the joint 'finger' follows 'elbow' (mimic) (command 'elbow')");
}

TEST(JointServicesOf, AJointWithoutALoopRefuseItsModeAndItsGains) {
  hal::RobotConfig robot = hal::test::fake_robot();
  robot.gains[0].current = {};
  JointRun run(robot);
  run.begin({});
  run.steps(50);
  const auto mode = run.services().set_joint(
      "elbow", {.mode = static_cast<std::int32_t>(ControlMode::kCurrent)}, kNow);
  ASSERT_FALSE(mode);
  EXPECT_EQ(mode.error().message, "joint 'elbow' has no current control (stiff)");
  const auto gains = run.services().set_gains("elbow", PidLoop::kCurrent, {.kp = 1.0}, kNow);
  ASSERT_FALSE(gains);
  EXPECT_EQ(gains.error().message, "this joint has no current loop");
}

TEST(JointServicesOf, ARunThatDoesNotControlYetRefuseModes) {
  JointRun run;
  run.begin({.settle_cycles = 50});
  run.steps(30);
  ASSERT_EQ(run.cycle->phase(), RunPhase::kSettling);
  const auto mode = run.services().set_joint("elbow", {.mode = 3}, kNow);
  ASSERT_FALSE(mode);
  EXPECT_EQ(mode.error().hint,
            "ask again in the phase running; after a fault: tandem fault reset first");
  EXPECT_TRUE(run.services().set_joint("elbow", {.stiffness_Nm_rad = 9.0}, kNow));
  EXPECT_TRUE(run.services().set_gains("elbow", PidLoop::kPosition, {.kd = 9.0}, kNow));
  run.steps(1);
  EXPECT_EQ(run.services().joints()[1].gains[0].kd, 9.0);
  EXPECT_EQ(run.services().joints()[1].gains[0].kp, 200.0) << "what is not named stays";
}

/// Joint 1's position gains after a controller that has `joint` has set them.
hal::PidGains gains_after(std::size_t joint, hal::PidGains wanted, std::vector<FaultReport>& faults,
                          const GainsRequest& operators = {}) {
  JointRun run;
  run.add("tuner", std::make_shared<test::Tuner>(joint, 1, wanted));
  run.begin({});
  run.steps(50);
  EXPECT_TRUE(run.services().set_gains("elbow", PidLoop::kPosition, operators, kNow));
  run.steps(1);
  faults = run.cycle->faults();
  EXPECT_EQ(run.services().joints()[1].gains[0], run.host->gains().gains(1, PidLoop::kPosition))
      << "what is shown is in force";
  return run.services().joints()[1].gains[0];
}

TEST(JointServicesOf, AControllerSetsTheGainsOfItsOwnJointsUpToTheirLimits) {
  std::vector<FaultReport> faults;
  EXPECT_EQ(gains_after(1, {.kp = 20.0, .ki = 1.0}, faults),
            (hal::PidGains{.kp = 20.0, .ki = 1.0}));
  EXPECT_TRUE(faults.empty());
  const hal::PidGains usual = gains_after(0, {}, faults);
  EXPECT_EQ(usual.kp, 200.0) << "a joint that another may have";
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].joint, "elbow");
  EXPECT_NE(faults[0].text.find("'tuner' wrote to this joint, its mode or its gains"),
            std::string::npos);
  for (const double kp : {1e9, -1.0, std::nan("")}) {
    EXPECT_EQ(gains_after(1, {.kp = kp}, faults), usual);
    EXPECT_EQ(faults.size(), 1U);
  }
}

TEST(JointServicesOf, AnOperatorsGainsLeaveWhatAControllerHasSet) {
  std::vector<FaultReport> faults;
  EXPECT_EQ(gains_after(1, {.kp = 20.0, .ki = 1.0}, faults, {.kd = 3.0}),
            (hal::PidGains{.kp = 20.0, .ki = 1.0, .kd = 3.0}));
}

TEST_F(JointServices, HoldJointsAgainAfterAReset) {
  ASSERT_TRUE(mode("elbow", ControlMode::kTorque));
  steps(10);
  robot.joints[0].on_fault = hal::StopCategory::kHold;
  backend.faulted_joint = 0;
  backend.latch_on_fault = true;
  steps(5);
  ASSERT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(look(1).mode, static_cast<std::int8_t>(ControlMode::kPosition));
  EXPECT_FALSE(mode("elbow", ControlMode::kTorque)) << "joints are held";
  cycle->inbox().reset_faults();
  steps(60);
  ASSERT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_FALSE(mode("elbow", ControlMode::kTorque)) << "and so they are after the reset";
  ASSERT_TRUE(cycle->services().go_on(kNow));
  steps(1);
  ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_EQ(look(1).mode, static_cast<std::int8_t>(ControlMode::kPosition));
  EXPECT_TRUE(mode("elbow", ControlMode::kTorque));
}

TEST(JointServicesOf, ALoggedRunAreInItsLog) {
  const log::ScratchFolder folder;
  auto recorder =
      log::Recorder::open(folder / "run.mcap", {.joints = {"shoulder", "elbow", "wrist"}}, {});
  ASSERT_TRUE(recorder);
  JointRun run;
  run.recorder = recorder->get();
  run.add_sine({0}, "sine", false);
  run.begin({.running_cycles = 100});
  run.steps(50);
  ASSERT_TRUE(run.services().switch_controllers({}, {"sine"}, kNow));
  ASSERT_TRUE(run.services().set_joint("elbow", {.mode = 3}, kNow));
  ASSERT_TRUE(run.services().set_gains("wrist", PidLoop::kPosition, {.kp = 150.0}, kNow));
  const auto move = [&](const MoveRequest& wish) {
    return run.services().move_joint("wrist", wish, kNow);
  };
  ASSERT_TRUE(move({.target_rad = 0.5}));
  ASSERT_TRUE(move({}));
  run.cycle->run();
  (void)(*recorder)->close();
  std::vector<std::string> texts;
  const auto events = log::LogFile::open(folder / "run.mcap")->events();
  ASSERT_TRUE(events);
  for (const auto& event : *events) {
    if (event.event.cycle == 50) texts.push_back(event.text);
  }
  EXPECT_EQ(texts,
            (std::vector<std::string>{
                "controllers switched", "mode or impedance set of elbow", "gains set of wrist",
                "motion requested of wrist: to 0.5 rad (28.65 deg)", "motion stopped of wrist"}));
}

}  // namespace
}  // namespace tandem::runtime
