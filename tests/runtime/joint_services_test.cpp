// What an operator sets of joints while a run goes on: on first-order joints, between two steps.
#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <limits>

#include "log/log_file.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/hal/fake_backend.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/first_order_robot.hpp"
#include "tests/runtime/test_controllers.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;
using hal::InteractionMode;
using hal::PidLoop;

/// The shoulder is a controller's, elbow and wrist are nobody's.
struct JointServices : testing::Test {
  void SetUp() override {
    ASSERT_TRUE(host.add("sine", std::make_shared<test::Sine>(std::vector<std::size_t>{0}),
                         test::parameters()));
    cycle = std::make_unique<RobotCycle>(CycleParts{robot, backend, host, clock},
                                         CycleConfig{.settle_cycles = 20});
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) EXPECT_TRUE(cycle->step());
  }
  [[nodiscard]] RunServices& services() const { return cycle->services(); }
  [[nodiscard]] Result<RequestResult> mode(const std::string& joint, ControlMode mode) const {
    return services().set_joint(joint, {.mode = static_cast<std::int32_t>(mode)},
                                RunServices::Patience{0});
  }
  [[nodiscard]] JointStatus look(std::size_t joint) const {
    return services().joints()[joint].look;
  }
  [[nodiscard]] static std::string text(const Result<RequestResult>& refused) {
    return refused ? "accepted" : refused.error().to_string();
  }

  hal::RobotConfig robot = hal::test::fake_robot();
  test::FirstOrderRobot backend{robot};
  ControllerHost host{robot, nullptr, 1'000'000};
  rt::WallClock clock;
  std::unique_ptr<RobotCycle> cycle;
};

/// The elbow's range ends at 1.5 rad, its velocity at 2 rad/s. A controller has it.
struct JointRecovery : testing::Test {
  JointRecovery() {
    EXPECT_TRUE(host.add("sine", std::make_shared<test::Sine>(std::vector<std::size_t>{1}),
                         test::parameters()));
    cycle = std::make_unique<RobotCycle>(CycleParts{robot, backend, host, clock},
                                         CycleConfig{.after_stop = AfterStop::kWait});
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) EXPECT_TRUE(cycle->step());
  }
  [[nodiscard]] std::string recover(const std::string& joint) {
    const auto asked = cycle->services().recover(joint, RunServices::Patience{0});
    return asked ? std::string("asked") : asked.error().to_string();
  }
  /// By the loop, to what was asked last.
  [[nodiscard]] double answered() {
    steps(1);
    return cycle->command().position_rad()[1];
  }
  void stop_at(double elbow_rad) {
    steps(100);
    cycle->inbox().emergency_stop(hal::StopCategory::kCategory0);
    steps(5);
    backend.push(1, elbow_rad);
    steps(5);
  }
  void reset() {
    cycle->inbox().reset_faults();
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kHeld);
  }

  hal::RobotConfig robot = hal::test::fake_robot();
  test::FirstOrderRobot backend{robot};
  ControllerHost host{robot, nullptr, 1'000'000};
  rt::WallClock clock;
  std::unique_ptr<RobotCycle> cycle;
};

TEST_F(JointRecovery, LeadsAJointSlowlyToItsLimitWhenItIsAsked) {
  stop_at(1.6);
  EXPECT_EQ(recover("elbow"), "asked");
  EXPECT_EQ(answered(), 1.6) << "a fault is latched: nothing moves";
  reset();
  EXPECT_EQ(cycle->command().position_rad()[1], 1.6);
  EXPECT_NE(recover("elbo").find("did you mean 'elbow'"), std::string::npos);
  EXPECT_EQ(recover("elbow"), "asked");
  double before = answered();
  EXPECT_DOUBLE_EQ(before, 1.5999);
  for (int i = 0; i < 990; ++i) {
    const double now = answered();
    EXPECT_NEAR(before - now, 1e-4, 1e-12);
    before = now;
  }
  steps(100);
  EXPECT_EQ(cycle->command().position_rad()[1], 1.5);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
}

/// A start had ended it without a word. Outside, the joint takes 15,000 cycles.
TEST_F(JointRecovery, IsNotEndedByTheStartOfAControllerThatClaimsTheJoint) {
  stop_at(3.0);
  reset();
  EXPECT_EQ(recover("elbow"), "asked");
  const double before = answered();
  const auto start = [this](const std::function<Result<RequestResult>(RunServices&)>& ask) {
    auto asked = std::async(std::launch::async, [&] { return ask(cycle->services()); });
    while (asked.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) steps(1);
    const Result<RequestResult> answer = asked.get();
    return answer ? std::string("started") : answer.error().to_string();
  };
  const auto all = [&] { return start([](RunServices& services) { return services.go_on(); }); };
  EXPECT_EQ(all(),
            "elbow: is on its way back to its limits, which the controller 'sine' would end (ask "
            "again when it is inside: tandem joint list elbow shows where it is)");
  EXPECT_EQ(start([](RunServices& services) { return services.switch_controllers({}, {"sine"}); }),
            all());
  const auto moved = start(
      [](RunServices& services) { return services.move_joint("elbow", {.target_rad = 0.0}); });
  EXPECT_NE(moved.find("is on its way back to its limits, which this would end"), std::string::npos)
      << moved;
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_LT(answered(), before);
  steps(15'100);
  EXPECT_EQ(cycle->command().position_rad()[1], 1.5);
  EXPECT_EQ(all(), "started");
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
}

TEST_F(JointRecovery, ComesBeforeAMotion) {
  stop_at(1.6);
  reset();
  auto asked = std::async(std::launch::async, [&] {
    return cycle->services().move_joint("elbow", {.target_rad = 0.0});
  });
  while (asked.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) steps(1);
  const auto answer = asked.get();
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().to_string(),
            "elbow: stands outside its limits (lead it back first: tandem joint recover elbow)");
  EXPECT_EQ(cycle->command().position_rad()[1], 1.6);
}

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
                           RunServices::Patience{0}));
  steps(1);
  EXPECT_EQ(look(2).interaction, static_cast<std::uint8_t>(InteractionMode::kCompliant));
  EXPECT_EQ(cycle->command().stiffness_Nm_rad()[2], 20.0);
  EXPECT_EQ(cycle->command().damping_Nms_rad()[2], 3.0);
}

TEST_F(JointServices, LeadAStiffnessOverWhileItYields) {
  ASSERT_TRUE(services().set_joint("wrist", {.stiffness_Nm_rad = 20.0, .interaction = 1},
                                   RunServices::Patience{0}));
  steps(200);
  ASSERT_TRUE(services().set_joint("wrist", {.stiffness_Nm_rad = 50.0}, RunServices::Patience{0}));
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
  ASSERT_TRUE(services().set_joint("wrist", {.stiffness_Nm_rad = 20.0, .interaction = 1},
                                   RunServices::Patience{0}));
  steps(200);
  ASSERT_TRUE(services().set_joint("wrist", {.stiffness_Nm_rad = 50.0, .damping_Nms_rad = 3.0},
                                   RunServices::Patience{0}));
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
  ASSERT_TRUE(services().switch_controllers({"sine"}, {}, RunServices::Patience{0}));
  steps(1);
  EXPECT_EQ(look(0).moving, 0) << "nobody asked for a motion";
}

TEST(JointServicesOf, ADelayedRunShowWhatWasAskedForAtOnce) {
  const hal::RobotConfig robot = hal::test::fake_robot();
  test::FirstOrderRobot backend(robot);
  ControllerHost host(robot, nullptr, 1'000'000);
  rt::WallClock clock;
  RobotCycle cycle({robot, backend, host, clock}, {.delay_cycles = 5});
  for (int i = 0; i < 50; ++i) cycle.step();
  ASSERT_EQ(cycle.phase(), RunPhase::kRunning);
  ASSERT_TRUE(cycle.services().set_joint("elbow", {.stiffness_Nm_rad = 9.0, .interaction = 1},
                                         RunServices::Patience{0}));
  cycle.step();
  const JointStatus look = cycle.services().joints()[1].look;
  EXPECT_EQ(look.stiffness_Nm_rad, 9.0);
  EXPECT_EQ(look.interaction, static_cast<std::uint8_t>(InteractionMode::kCompliant));
}

TEST_F(JointServices, RefuseTheModeOfAClaimedJointAndNameItsController) {
  const std::string refused = text(mode("shoulder", ControlMode::kTorque));
  EXPECT_NE(refused.find("shoulder: is claimed by the controller 'sine'"), std::string::npos)
      << refused;
  ASSERT_TRUE(services().switch_controllers({"sine"}, {}, RunServices::Patience{0}));
  EXPECT_TRUE(mode("shoulder", ControlMode::kTorque)) << "nobody will have it";
  steps(1);
  EXPECT_EQ(look(0).mode, static_cast<std::int8_t>(ControlMode::kTorque));
}

TEST_F(JointServices, GiveAClaimedJointTheImpedanceThatItsControllerDoesNotWrite) {
  ASSERT_TRUE(
      services().set_joint("shoulder", {.stiffness_Nm_rad = 30.0}, RunServices::Patience{0}));
  steps(150);
  EXPECT_EQ(cycle->command().stiffness_Nm_rad()[0], 30.0);
  ASSERT_TRUE(services().switch_controllers({"sine"}, {}, RunServices::Patience{0}));
  steps(1);
  ASSERT_TRUE(services().switch_controllers({}, {"sine"}, RunServices::Patience{0}));
  steps(150);
  EXPECT_EQ(cycle->command().stiffness_Nm_rad()[0], 30.0) << "a start keeps it";
}

// The value that was not given became that of robot.toml, or of an earlier request.
TEST_F(JointServices, LeaveTheOtherValueOfAnImpedanceAsTheControllerWroteIt) {
  hal::CommandImage command = cycle->command();
  command.stiffness_Nm_rad()[0] = 1.0;
  command.damping_Nms_rad()[0] = 0.05;
  (void)host.set_joint(0, {.stiffness_Nm_rad = 0.5}, true, cycle->state(), command);
  EXPECT_EQ(command.stiffness_Nm_rad()[0], 0.5);
  EXPECT_EQ(command.damping_Nms_rad()[0], 0.05);
  command.stiffness_Nm_rad()[0] = 1.0;
  (void)host.set_joint(0, {.damping_Nms_rad = 0.09}, true, cycle->state(), command);
  EXPECT_EQ(command.stiffness_Nm_rad()[0], 1.0);
  EXPECT_EQ(command.damping_Nms_rad()[0], 0.09);
}

// "asked for" was the answer while time stood, and the joint never moved.
TEST_F(JointServices, RefuseToMoveAClaimedJointWithoutAskingTheLoop) {
  EXPECT_NE(text(services().move_joint("shoulder", {.target_rad = 0.3}, RunServices::Patience{0}))
                .find("is claimed by the controller 'sine'"),
            std::string::npos);
}

TEST_F(JointServices, RefuseWhatAJointCannotDoAndNameTheLimit) {
  EXPECT_NE(text(mode("elbwo", ControlMode::kIdle)).find("did you mean 'elbow'?"),
            std::string::npos);
  const auto stiff = [&](double value) {
    return text(
        services().set_joint("elbow", {.stiffness_Nm_rad = value}, RunServices::Patience{0}));
  };
  EXPECT_NE(stiff(201.0).find("elbow: the stiffness 201 Nm/rad is beyond the joint's limit (give 0 "
                              "to 200 Nm/rad)"),
            std::string::npos)
      << stiff(201.0);
  EXPECT_NE(stiff(-1.0).find("beyond"), std::string::npos);
  EXPECT_NE(stiff(std::numeric_limits<double>::infinity()).find("beyond"), std::string::npos);
  const auto gain = [&](double kp) {
    return text(
        services().set_gains("elbow", PidLoop::kPosition, {.kp = kp}, RunServices::Patience{0}));
  };
  EXPECT_NE(gain(-1.0).find("elbow: kp -1 is beyond"), std::string::npos);
  EXPECT_NE(gain(1e30).find("beyond the joint's limit"), std::string::npos) << "taken live before";
  EXPECT_NE(gain(std::nan("")).find("beyond"), std::string::npos);
  steps(2);
  EXPECT_EQ(services().joints()[1].gains[0].kp, 200.0);
}

TEST(JointServicesOf, AJointWithoutALoopRefuseItsModeAndItsGains) {
  hal::RobotConfig robot = hal::test::fake_robot();
  robot.gains[0].current = {};
  test::FirstOrderRobot backend(robot);
  ControllerHost host(robot, nullptr, 1'000'000);
  rt::WallClock clock;
  RobotCycle cycle({robot, backend, host, clock}, {});
  for (int i = 0; i < 50; ++i) cycle.step();
  const auto mode = cycle.services().set_joint(
      "elbow", {.mode = static_cast<std::int32_t>(ControlMode::kCurrent)},
      RunServices::Patience{0});
  ASSERT_FALSE(mode);
  EXPECT_EQ(mode.error().message, "joint 'elbow' has no current control (stiff)");
  const auto gains =
      cycle.services().set_gains("elbow", PidLoop::kCurrent, {.kp = 1.0}, RunServices::Patience{0});
  ASSERT_FALSE(gains);
  EXPECT_EQ(gains.error().message, "this joint has no current loop");
}

TEST(JointServicesOf, ARunThatDoesNotControlYetRefuseModes) {
  const hal::RobotConfig robot = hal::test::fake_robot();
  test::FirstOrderRobot backend(robot);
  ControllerHost host(robot, nullptr, 1'000'000);
  rt::WallClock clock;
  RobotCycle cycle({robot, backend, host, clock}, {.settle_cycles = 50});
  for (int i = 0; i < 30; ++i) cycle.step();
  ASSERT_EQ(cycle.phase(), RunPhase::kSettling);
  const auto mode = cycle.services().set_joint("elbow", {.mode = 3}, RunServices::Patience{0});
  ASSERT_FALSE(mode);
  EXPECT_EQ(mode.error().hint,
            "ask again in the phase running; after a fault: tandem fault reset first");
  EXPECT_TRUE(
      cycle.services().set_joint("elbow", {.stiffness_Nm_rad = 9.0}, RunServices::Patience{0}));
  EXPECT_TRUE(cycle.services().set_gains("elbow", PidLoop::kPosition, {.kd = 9.0},
                                         RunServices::Patience{0}));
  cycle.step();
  EXPECT_EQ(cycle.services().joints()[1].gains[0].kd, 9.0);
  EXPECT_EQ(cycle.services().joints()[1].gains[0].kp, 200.0) << "what is not named stays";
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
  ASSERT_TRUE(cycle->services().go_on(RunServices::Patience{0}));
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
  const hal::RobotConfig robot = hal::test::fake_robot();
  test::FirstOrderRobot backend(robot);
  ControllerHost host(robot, nullptr, 1'000'000);
  ASSERT_TRUE(host.add("sine", std::make_shared<test::Sine>(std::vector<std::size_t>{0}),
                       test::parameters(), false));
  rt::WallClock clock;
  RobotCycle cycle({robot, backend, host, clock, recorder->get()}, {.running_cycles = 100});
  for (int i = 0; i < 50; ++i) cycle.step();
  ASSERT_TRUE(cycle.services().switch_controllers({}, {"sine"}, RunServices::Patience{0}));
  ASSERT_TRUE(cycle.services().set_joint("elbow", {.mode = 3}, RunServices::Patience{0}));
  ASSERT_TRUE(cycle.services().set_gains("wrist", PidLoop::kPosition, {.kp = 150.0},
                                         RunServices::Patience{0}));
  const auto move = [&](const MoveRequest& wish) {
    return cycle.services().move_joint("wrist", wish, RunServices::Patience{0});
  };
  ASSERT_TRUE(move({.target_rad = 0.5}));
  ASSERT_TRUE(move({}));
  cycle.run();
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

// An operator's motions: tandem joint move.

struct JointMoves : JointServices {
  [[nodiscard]] std::string move(const std::string& joint, const MoveRequest& wish) {
    const auto asked = services().move_joint(joint, wish, RunServices::Patience{0});
    return asked ? std::string("asked") : asked.error().to_string();
  }
  /// By the loop, to what was asked last.
  [[nodiscard]] std::string answered(const std::string& joint, const MoveRequest& wish) {
    auto asked = std::async(std::launch::async, [&] { return services().move_joint(joint, wish); });
    while (asked.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) steps(1);
    const auto answer = asked.get();
    return answer ? std::string("done") : answer.error().to_string();
  }
  [[nodiscard]] double reference(std::size_t joint) const {
    return cycle->command().position_rad()[joint];
  }
};

TEST_F(JointMoves, GoOnATrapezoidAndStayWhereTheyEnd) {
  const double from = reference(1);
  EXPECT_EQ(move("elbow", {.target_rad = from + 0.4, .speed_rad_s = 0.5}), "asked");
  double last = from, fastest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    steps(1);
    const double speed = (reference(1) - last) / 1e-3;
    EXPECT_GE(speed, -1e-9);
    EXPECT_LE(std::abs(speed - fastest), 2e-3) << "1 rad/s^2: half a second to its speed" << i;
    fastest = speed;
    last = reference(1);
  }
  EXPECT_EQ(reference(1), from + 0.4);
  EXPECT_NEAR(cycle->state().position_rad()[1], from + 0.4, 1e-3);
}

TEST_F(JointMoves, BrakeWhenTheyAreStoppedAndGoOverIntoAnotherTarget) {
  const double from = reference(1);
  EXPECT_EQ(move("elbow", {.target_rad = from + 1.0, .speed_rad_s = 0.5}), "asked");
  steps(1000);
  EXPECT_EQ(move("elbow", {}), "asked");
  steps(1000);
  const double rests = reference(1);
  steps(100);
  EXPECT_EQ(reference(1), rests);
  EXPECT_NEAR(rests - from, 0.125 + 0.25 + 0.125, 2e-3) << "0.5 s up, 0.5 s at speed, 0.5 s down";
  EXPECT_EQ(move("elbow", {.target_rad = from, .speed_rad_s = 2.0, .acceleration_rad_s2 = 8.0}),
            "asked");
  steps(1500);
  EXPECT_EQ(reference(1), from);
}

/// A joint in its limit is not beyond it.
TEST_F(JointMoves, ReachBothLimitsAndLeaveThemAgain) {
  for (const double limit : {1.5, -1.5}) {
    EXPECT_EQ(answered("elbow", {.target_rad = limit, .speed_rad_s = 2.0}), "done");
    steps(3000);
    ASSERT_EQ(reference(1), limit);
    EXPECT_EQ(answered("elbow", {.target_rad = 0.0, .speed_rad_s = 2.0}), "done");
    steps(3000);
    EXPECT_EQ(reference(1), 0.0);
  }
}

TEST_F(JointMoves, AreRefusedBeyondTheLimitsAndOfJointsThatAreTaken) {
  const auto has = [](const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  has(move("elbow", {.target_rad = 1.6}),
      "the target 1.6 rad (91.67 deg) is beyond the joint's limits (give -1.5 to 1.5 rad, which "
      "is -85.94 to 85.94 deg)");
  has(move("elbow", {.target_rad = std::numeric_limits<double>::infinity()}), "is beyond");
  has(move("elbow", {.target_rad = 0.0, .speed_rad_s = 2.1}),
      "the speed 2.1 rad/s (120.3 deg/s) is");
  has(move("elbow", {.target_rad = 0.0, .speed_rad_s = 0.0}), "the speed 0 rad/s (0 deg/s) is");
  has(move("elbow", {.target_rad = 0.0, .acceleration_rad_s2 = -1.0}),
      "the acceleration -1 rad/s2 (-57.3 deg/s2) is");
  has(move("elbwo", {.target_rad = 0.0}), "did you mean 'elbow'?");
  has(answered("shoulder", {.target_rad = 0.0}), "is claimed by the controller 'sine'");
  ASSERT_TRUE(mode("elbow", ControlMode::kVelocity));
  has(answered("elbow", {.target_rad = 0.0}), "is not in position control");
  cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  steps(1);
  has(move("wrist", {.target_rad = 0.0}), "the run is in the phase shut-down");
}

TEST_F(JointMoves, EndWhenAControllerTakesTheJoint) {
  const double from = reference(1);
  auto load = std::async(std::launch::async, [&] {
    return services().load("wave", std::make_shared<test::Sine>(std::vector<std::size_t>{1}),
                           *TomlDocument::parse("", "none.toml"));
  });
  while (load.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) steps(1);
  ASSERT_TRUE(load.get());
  EXPECT_EQ(move("elbow", {.target_rad = from + 1.0, .speed_rad_s = 0.5}), "asked");
  steps(1000);
  ASSERT_TRUE(services().switch_controllers({}, {"wave"}, RunServices::Patience{0}));
  steps(500);
  EXPECT_LT(std::abs(cycle->command().position_rad()[1] - cycle->state().position_rad()[1]), 0.2);
  ASSERT_TRUE(services().switch_controllers({"wave"}, {}, RunServices::Patience{0}));
  steps(200);
  const double left = reference(1);
  steps(1000);
  EXPECT_EQ(reference(1), left) << "the motion of before does not go on";
}

TEST_F(JointMoves, GoOnFromASnapshot) {
  EXPECT_EQ(move("elbow", {.target_rad = reference(1) + 1.0}), "asked");
  steps(300);
  const auto snapshot = cycle->save();
  ASSERT_TRUE(snapshot) << snapshot.error().to_string();
  steps(100);
  const double then = reference(1);
  ASSERT_TRUE(cycle->restore(*snapshot));
  EXPECT_LT(reference(1), then);
  steps(100);
  EXPECT_EQ(reference(1), then);
}

}  // namespace
}  // namespace tandem::runtime
