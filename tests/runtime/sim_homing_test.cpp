// A joint whose encoder does not know where it is: homed through the whole chain, on both wires and
// by another maker's drive; until then nothing moves it.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "canopen/data_sheet.hpp"
#include "tests/runtime/swing_loop.hpp"

namespace tandem::runtime {
namespace {

using hal::FaultCause;
using hal::FaultKind;
using hal::HomingState;

constexpr double kLowSwitch_rad = -2.995;

/// Which wire, and whose drive.
struct Kind {
  const char* name;
  hal::RobotConfig (*robot)();
};

hal::RobotConfig can_robot() { return tandem::test::swing_robot(); }
hal::RobotConfig line_robot() { return tandem::test::line_swing_robot(); }
hal::RobotConfig others_robot() {
  hal::RobotConfig robot = tandem::test::classic_swing_robot();
  const std::string file = std::string(TANDEM_SOURCE_DIR) + "/config/drives/servo.eds";
  auto sheet = canopen::load_data_sheet(file);
  EXPECT_TRUE(sheet.has_value());
  robot.boards[0].sheet = std::make_shared<const canopen::DataSheet>(std::move(*sheet));
  robot.boards[0].eds = file;
  robot.joints[0].reversed = true;
  robot.joints[0].zero_counts = 5000;
  return robot;
}

/// The swing, which hangs from its hoist at 0.5 rad; its low switch is at the end of its range.
struct HomedSwing : ::testing::TestWithParam<Kind>, test::SwingLoop {
  /// @param cycles  that the run has; 0: it waits
  void begin(bool required = true, AfterReset after_reset = AfterReset::kHold,
             bool at_start = false, std::uint64_t cycles = 0) {
    hal::RobotConfig config = GetParam().robot();
    config.joints[0].homing = hal::HomingConfig{.method = config.joints[0].reversed ? 18 : 17,
                                                .speed_rad_s = 1.5,
                                                .zero_speed_rad_s = 0.1,
                                                .acceleration_rad_s2 = 5.0,
                                                .position_rad = kLowSwitch_rad,
                                                .timeout_s = 10.0,
                                                .required = required,
                                                .at_start = at_start};
    change(*config.joints[0].homing);
    of(std::move(config));
    add_sine();
    SwingLoop::begin({.running_cycles = cycles,
                      .settle_cycles = 200,
                      .after_stop = cycles == 0 ? AfterStop::kWait : AfterStop::kEnd,
                      .after_reset = after_reset});
  }
  void until(RunPhase phase, int most = 6000) { (void)LoopRun::until(phase, most); }
  /// What the loop answers to `ask`, called on another thread; empty: it is done.
  template <class Ask>
  [[nodiscard]] std::string refusal(const Ask& ask) {
    return text(while_cycling([&] { return ask(services()); }), "");
  }
  [[nodiscard]] std::string home_refused() {
    return refusal([](RunServices& services) { return services.home_joint("swing"); });
  }
  [[nodiscard]] std::string move_refused() {
    return refusal(
        [](RunServices& services) { return services.move_joint("swing", {.target_rad = 0.1}); });
  }
  [[nodiscard]] std::string start_refused() {
    return refusal([](RunServices& services) { return services.go_on(); });
  }
  [[nodiscard]] hal::Homing homing() { return cycle->services().joints()[0].look.homing; }
  void until_homed(int most = 8000) {
    for (int i = 0; i < most && homing().state == HomingState::kHoming; ++i) steps(1);
  }
  [[nodiscard]] double off_rad() const {
    return cycle->state().position_rad()[0] - backend->plant().joint(0).position_rad;
  }
  void home() {
    ASSERT_TRUE(cycle->services().home_joint("swing", RunServices::Patience{0}));
    steps(1);
    ASSERT_EQ(homing().state, HomingState::kHoming);
  }

  /// Homes it from its hoist by `method`. @return the joint's true angle at the place that is found
  double found_by(int method, double index_rad = 0.0) {
    change = [&](hal::HomingConfig& homing) {
      homing.method = method;
      homing.position_rad = 0.25;
      homing.index_rad = index_rad;
      homing.timeout_s = 60.0;
      if (index_rad == 0.0) return;
      // Gently: the pulse is the motor's, and the spring would swing.
      homing.speed_rad_s = 0.5;
      homing.zero_speed_rad_s = 0.02;
      homing.acceleration_rad_s2 = 1.0;
    };
    begin();
    until(RunPhase::kHeld);
    home();
    until_homed(30'000);
    EXPECT_EQ(homing().state, HomingState::kHomed)
        << "method " << method << ": " << hal::row_of(homing().error).words;
    return 0.25 - off_rad();
  }

  std::function<void(hal::HomingConfig&)> change = [](hal::HomingConfig&) {};
};

TEST_P(HomedSwing, IsHeldUntilItIsHomedAndThenKnowsWhereItIs) {
  change = [](hal::HomingConfig& homing) { homing.speed_rad_s = 0.5; };  // the spring swings less
  begin();
  until(RunPhase::kHeld);
  const double rest = backend->plant().joint(0).position_rad;
  EXPECT_NEAR(cycle->state().position_rad()[0], 0.0, 0.1) << "it counts from where it was";
  steps(500);
  EXPECT_NEAR(backend->plant().joint(0).position_rad, rest, 0.05);
  home();
  double fastest = 0.0;
  for (int i = 0; i < 8000 && homing().state == HomingState::kHoming; ++i) {
    steps(1);
    fastest = std::max(fastest, std::abs(backend->plant().joint(0).velocity_rad_s));
  }
  ASSERT_EQ(homing().state, HomingState::kHomed) << hal::row_of(homing().error).words;
  EXPECT_LT(fastest, 1.0);
  const double off = off_rad();
  EXPECT_NEAR(off, 0.0, 5e-4) << "at 0.1 rad/s a period's way past the switch's edge";
  const bool ours = robot.boards[0].eds.empty();  // another's drive has no motor encoder to show
  if (ours) {
    EXPECT_NEAR(cycle->state().motor_position_rad()[0],
                backend->plant().joint(0).motor_position_rad + off, 1e-4);
  }
  steps(300);
  EXPECT_NEAR(backend->plant().joint(0).position_rad, kLowSwitch_rad, 0.01)
      << "held where it was found, without a jump";
  ASSERT_TRUE(cycle->services().go_on(RunServices::Patience{0}));
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  double worst = 0.0;
  for (int i = 0; i < 500; ++i) {
    steps(1);
    worst = std::max(worst, std::abs(off_rad() - off));
  }
  EXPECT_LT(worst, 2e-3);
}

const char* const kRemedy =
    "swing: has to be homed first: its position is not known (tandem joint "
    "home swing)";

TEST_P(HomedSwing, RefusesEverythingElseByName) {
  begin();
  until(RunPhase::kHeld);
  EXPECT_EQ(move_refused(), kRemedy);
  EXPECT_EQ(start_refused(), kRemedy);
  EXPECT_EQ(refusal([](RunServices& services) { return services.recover("swing"); }), kRemedy);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  home();
  steps(200);
  for (const std::string& why : {move_refused(), start_refused(), home_refused()}) {
    EXPECT_TRUE(why.starts_with("swing: is being homed")) << why;
  }
}

TEST_P(HomedSwing, StopsWhereItIsWhenTheHomingIsStopped) {
  begin();
  until(RunPhase::kHeld);
  home();
  steps(700);
  ASSERT_GT(std::abs(backend->plant().joint(0).velocity_rad_s), 0.3);
  ASSERT_TRUE(cycle->services().move_joint("swing", {}, RunServices::Patience{0}));
  until_homed();
  EXPECT_EQ(homing().state, HomingState::kNotHomed);
  EXPECT_EQ(homing().error, FaultCause::kHomingStopped);
  const double rest = backend->plant().joint(0).position_rad;
  steps(500);
  EXPECT_NEAR(backend->plant().joint(0).position_rad, rest, 0.05);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_EQ(move_refused(), kRemedy) << "it is not homed";
  home();  // and from there again
  until_homed();
  EXPECT_EQ(homing().state, HomingState::kHomed);
}

TEST_P(HomedSwing, AFaultEndsTheHomingAndNothingMovesOn) {
  begin();
  until(RunPhase::kHeld);
  home();
  steps(500);
  sim::ScenarioFault fault;
  fault.kind = FaultKind::kEncoderUnplug;
  fault.joint = 0;
  fault.duration_ns = 5'000'000;
  ASSERT_EQ(backend->robot().inject(fault), Code::kOk);
  until(RunPhase::kFaulted);
  EXPECT_EQ(homing().state, HomingState::kNotHomed);
  EXPECT_EQ(homing().error, FaultCause::kHomingInterrupted);
  EXPECT_FALSE(home_refused().empty());
  steps(15'000);  // it swings out
  cycle->inbox().reset_faults();
  until(RunPhase::kHeld);
  EXPECT_EQ(move_refused(), kRemedy);
  home();
  until_homed();
  EXPECT_EQ(homing().state, HomingState::kHomed);
}

/// After a fault it is where it was; a board that was without power knows nothing any more, and
/// controllers that a reset would let continue wait.
TEST_P(HomedSwing, SurvivesAResetOfFaultsButNotTheBoardsPower) {
  begin(true, AfterReset::kContinue);
  until(RunPhase::kHeld);
  home();
  until_homed();
  ASSERT_TRUE(cycle->services().go_on(RunServices::Patience{0}));
  steps(100);
  ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  const auto fault_of = [&](FaultKind kind) {
    sim::ScenarioFault fault;
    fault.kind = kind;
    (kind == FaultKind::kEncoderUnplug ? fault.joint : fault.board) = 0;
    fault.duration_ns = 5'000'000;
    ASSERT_EQ(backend->robot().inject(fault), Code::kOk);
    until(RunPhase::kFaulted);
    steps(15'000);
    cycle->inbox().reset_faults();
  };
  fault_of(FaultKind::kEncoderUnplug);
  until(RunPhase::kRunning);
  EXPECT_EQ(homing().state, HomingState::kHomed);
  EXPECT_LT(std::abs(off_rad()), 0.03);
  fault_of(FaultKind::kBoardReset);
  until(RunPhase::kHeld, 20'000);
  EXPECT_EQ(homing().state, HomingState::kNotHomed);
  EXPECT_EQ(start_refused(), kRemedy);
}

TEST_P(HomedSwing, ThatNeedNotBeHomedRunsAtOnce) {
  begin(false);
  until(RunPhase::kRunning);
  EXPECT_LT(std::abs(off_rad()), 0.01) << "its encoder is absolute";
  EXPECT_EQ(homing().state, HomingState::kNotHomed);
  EXPECT_TRUE(home_refused().starts_with("swing: is claimed by the controller 'sine'"));
}

TEST_P(HomedSwing, IsHomedByTheRunItselfWhereThatIsDeclared) {
  begin(true, AfterReset::kHold, true);
  until(RunPhase::kHeld);
  until(RunPhase::kRunning, 8000);
  EXPECT_EQ(homing().state, HomingState::kHomed);
  steps(200);
  EXPECT_LT(std::abs(off_rad()), 3e-3);
}

TEST_P(HomedSwing, ARunWhoseTimeEndsBeforeThatEndsInAFaultThatNamesTheJoint) {
  begin(true, AfterReset::kHold, false, 500);
  while (cycle->step()) {
  }
  const auto faults = cycle->faults();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].joint, "swing");
  EXPECT_NE(faults[0].text.find("was not homed"), std::string::npos) << faults[0].text;
  EXPECT_EQ(cycle->running_cycles(), 0U);
}

/// Limit switches at 2.995 rad, a home switch from the middle of the range or about it.
TEST_P(HomedSwing, IsHomedByTheSwitchesThatTheMethodMeans) {
  for (const auto& [method, edge_rad] : {std::pair{17, -2.995},
                                         {18, 2.995},
                                         {19, 0.0},
                                         {22, 0.0},
                                         {23, -0.05},
                                         {25, 0.05},
                                         {27, 0.05},
                                         {29, -0.05}}) {
    const double found_rad = found_by(method);
    const double sign = robot.joints[0].reversed ? -1.0 : 1.0;
    EXPECT_NEAR(sign * found_rad, edge_rad, 2e-3) << "method " << method;
  }
}

TEST_P(HomedSwing, IsHomedByTheMotorsIndexPulse) {
  for (const int method : {1, 4, 8, 12, 33, 34}) {
    const double first_rad = found_by(method, 0.01);
    EXPECT_NEAR(std::remainder(found_by(method, 0.03) - first_rad - 0.02, 0.02 * std::numbers::pi),
                0.0, 2e-3)
        << "method " << method;
  }
}

TEST_P(HomedSwing, ThatHasNoHomeSwitchIsNotHomed) {
  change = [](hal::HomingConfig& homing) {
    homing.method = 24;
    homing.home_switch_rad = {4.0, 5.0};
  };
  begin();
  until(RunPhase::kHeld);
  home();
  until_homed(20'000);
  EXPECT_EQ(homing().state, HomingState::kNotHomed);
  EXPECT_EQ(homing().error, FaultCause::kHomingDrive);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
}

TEST_P(HomedSwing, ThatCannotBeHomedAtTheStartEndsTheRunAtOnce) {
  change = [](hal::HomingConfig& homing) { homing.method = 31; };
  begin(true, AfterReset::kHold, true, 60'000);
  int cycles = 0;
  while (cycle->step()) ++cycles;
  EXPECT_LT(cycles, 20'000) << "long before the run's time is over";
  const auto faults = cycle->faults();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].joint, "swing");
  EXPECT_TRUE(faults[0].text.starts_with(
      "its homing (method 31) failed: the drive reports a homing error (statusword bit 13)"))
      << faults[0].text;
  EXPECT_EQ(cycle->state().homing()[0], static_cast<std::uint8_t>(HomingState::kNotHomed));
}

TEST_P(HomedSwing, ThatEndsOutsideOfItsLimitsIsLedInsideBeforeAnythingElse) {
  change = [](hal::HomingConfig& homing) { homing.position_rad = -3.05; };
  begin(true, AfterReset::kHold, true);
  until(RunPhase::kHeld);
  EXPECT_EQ(cycle->state().homing()[0], static_cast<std::uint8_t>(HomingState::kNotHomed));
  until(RunPhase::kRunning, 9000);
  EXPECT_EQ(cycle->state().homing()[0], static_cast<std::uint8_t>(HomingState::kHomed));
  EXPECT_GE(cycle->command().position_rad()[0], -3.0);
  EXPECT_GT(cycle->state().position_rad()[0], -3.03) << "it was homed at -3.05";
}

/// Two runs are the same to the last bit, and a snapshot of the middle of a homing goes on.
TEST_P(HomedSwing, IsAFunctionOfItsStateAlone) {
  begin();
  until(RunPhase::kHeld);
  home();
  steps(300);
  const auto middle = cycle->save();
  ASSERT_TRUE(middle.has_value());
  until_homed();
  steps(100);
  const auto end = cycle->save();
  const std::int64_t ended = cycle->progress().time_ns.load();
  ASSERT_TRUE(cycle->restore(*middle));
  steps(1);
  ASSERT_EQ(homing().state, HomingState::kHoming);
  while (cycle->progress().time_ns.load() < ended) steps(1);
  EXPECT_EQ(homing().state, HomingState::kHomed);
  EXPECT_TRUE(*cycle->save() == *end);
}

/// At power-on the drive counts within one turn, wherever its zero is: the joint is where it is,
/// and does not move.
TEST(SingleTurn, OfADriveIsTheOneInWhichTheJointIs) {
  hal::RobotConfig robot = others_robot();
  const double turn = robot.joints[0].encoder_counts_per_rev;
  robot.joints[0].encoder_turn_counts = static_cast<std::int32_t>(turn);
  for (const double zero : {0.0, 0.02, 0.5, 0.98, 3.5, -2.4}) {  // [turns]
    SCOPED_TRACE(zero);
    robot.joints[0].zero_counts = static_cast<std::int32_t>(std::lround(zero * turn));
    test::SwingLoop run(robot);
    run.begin({.running_cycles = 300, .settle_cycles = 200},
              {.posture = "up", .release_ns = 100'000'000'000});
    const double begun_rad = run.backend->plant().joint(0).position_rad;
    run.run_to(RunPhase::kRunning);
    run.steps(200);
    const double seen_rad = run.cycle->state().position_rad()[0];
    EXPECT_NEAR(seen_rad, run.backend->plant().joint(0).position_rad, 1e-3);
    EXPECT_NEAR(seen_rad, begun_rad, 0.02);
  }
}

INSTANTIATE_TEST_SUITE_P(Each, HomedSwing,
                         ::testing::Values(Kind{"can", can_robot}, Kind{"line", line_robot},
                                           Kind{"others", others_robot}),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace tandem::runtime
