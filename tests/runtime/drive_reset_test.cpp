// The reset of one joint's drive, on first-order joints: what it does in each phase, and to whom it
// is refused. The whole chain: sim_reset_test.cpp.
#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

/// The shoulder is a controller's, elbow and wrist are nobody's.
struct DriveReset : testing::Test, test::JointRun {
  void begin(hal::StopCategory on_fault) {
    for (hal::JointConfig& joint : robot.joints) joint.on_fault = on_fault;
    add_sine();
    JointRun::begin({.after_stop = AfterStop::kWait});
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  }
  /// What the loop answers to `ask`, called on another thread.
  template <class Ask>
  [[nodiscard]] std::string answered(const Ask& ask) {
    return text(while_cycling([&] { return ask(services()); }), "done");
  }
  [[nodiscard]] std::string reset(const std::string& joint) {
    return answered([&](RunServices& services) { return services.reset_joint(joint); });
  }
  void trip(int joint) {
    backend.faulted_joint = joint;
    steps(2);
    ASSERT_EQ(cycle->fault_log().latched(), 1U);
  }
  static void has(const std::string& text, const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  }
};

TEST_F(DriveReset, OfAFaultedRunClearsOneDriveAndLeavesTheRunStopped) {
  begin(hal::StopCategory::kCategory1);
  trip(0);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(reset("shoulder"), "done") << "its controller is stopped";
  steps(2);
  EXPECT_EQ(look(0).fault, 0U);
  EXPECT_EQ(look(0).resetting, 0);
  EXPECT_EQ(backend.single_resets, 1U) << "told in one cycle";
  steps(100);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend.latched, hal::StopCategory::kCategory1);
  EXPECT_EQ(cycle->fault_log().latched(), 1U);
  EXPECT_EQ(cycle->progress().resets, 0U);
  cycle->inbox().reset_faults();
  steps(50);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_EQ(cycle->fault_log().latched(), 0U);
}

TEST_F(DriveReset, OfAJointThatOnlyWarnedHoldsItWhereItIsAndTheRunGoesOn) {
  begin(hal::StopCategory::kWarn);
  ASSERT_TRUE(cycle->services().move_joint("elbow", {.target_rad = 1.0}, RunServices::Patience{0}));
  steps(100);
  trip(1);
  backend.push(1, -0.7);
  backend.reset_clears = false;  // the drive takes a while
  EXPECT_EQ(reset("elbow"), "done");
  steps(20);
  EXPECT_EQ(look(1).resetting, 1);
  backend.push(1, -0.8);
  steps(1);
  EXPECT_NEAR(cycle->command().position_rad()[1], -0.8, 1e-9) << "its reference follows it";
  backend.faulted_joint = -1;
  steps(500);
  EXPECT_EQ(look(1).resetting, 0);
  EXPECT_NEAR(cycle->command().position_rad()[1], -0.8, 1e-3) << "its motion is over";
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_EQ(cycle->fault_log().latched(), 0U);
  EXPECT_FALSE(cycle->faults()[0].latched);
  trip(1);
}

TEST_F(DriveReset, GivesUpAfterATimeAndKeepsTheFaultLatched) {
  begin(hal::StopCategory::kWarn);
  trip(2);
  backend.reset_clears = false;
  EXPECT_EQ(reset("wrist"), "done");
  steps(4000);
  EXPECT_EQ(look(2).resetting, 0);
  EXPECT_EQ(backend.single_resets, 1U);
  EXPECT_EQ(cycle->fault_log().latched(), 1U);
}

TEST_F(DriveReset, KeepsTheJointFromEverybodyUntilItIsOver) {
  begin(hal::StopCategory::kWarn);
  trip(0);
  ASSERT_TRUE(cycle->services().switch_controllers({"sine"}, {}, RunServices::Patience{0}));
  steps(1);
  backend.reset_clears = false;
  EXPECT_EQ(reset("shoulder"), "done");
  const char* words = "shoulder: its drive is being reset (ask again when that is over";
  const auto start = [this] {
    return answered(
        [](RunServices& services) { return services.switch_controllers({}, {"sine"}); });
  };
  has(start(), words);
  has(answered([](RunServices& services) { return services.move_joint("shoulder", {}); }), words);
  has(answered([](RunServices& services) { return services.recover("shoulder"); }), words);
  has(answered([](RunServices& services) { return services.set_joint("shoulder", {.mode = 0}); }),
      words);
  backend.faulted_joint = -1;
  steps(5);
  EXPECT_EQ(look(0).resetting, 0);
  EXPECT_EQ(start(), "done");
}

TEST_F(DriveReset, OfARobotThatIsHeldHoldsItsJointToo) {
  begin(hal::StopCategory::kWarn);
  trip(2);
  cycle->inbox().reset_faults();
  backend.faulted_joint = -1;
  steps(50);
  ASSERT_EQ(cycle->phase(), RunPhase::kHeld);
  ASSERT_TRUE(cycle->services().move_joint("elbow", {.target_rad = 1.0}, RunServices::Patience{0}));
  trip(1);
  backend.push(1, -0.7);
  EXPECT_EQ(reset("elbow"), "done");
  steps(1000);
  EXPECT_NEAR(cycle->command().position_rad()[1], -0.7, 1e-3);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_EQ(cycle->fault_log().latched(), 0U);
}

TEST_F(DriveReset, OfAHealthyDriveChangesNothing) {
  begin(hal::StopCategory::kWarn);
  EXPECT_EQ(reset("shoulder"), "done");
  EXPECT_EQ(backend.single_resets, 0U);
}

TEST_F(DriveReset, IsRefusedWithTheNextStep) {
  begin(hal::StopCategory::kWarn);
  has(reset("elbo"), "did you mean 'elbow'?");
  trip(0);
  has(reset("shoulder"), "shoulder: is claimed by the controller 'sine'");
  has(reset("shoulder"), "tandem controller stop sine");
  ASSERT_TRUE(cycle->services().switch_controllers({"sine"}, {}, RunServices::Patience{0}));
  steps(1);
  backend.cause = hal::FaultCause::kHeartbeatLost;
  has(reset("shoulder"), "shoulder: its board is lost, and would come back with all of its joints");
  backend.cause = hal::FaultCause::kDrive;
  backend.resets_alone = false;
  has(reset("shoulder"), "shoulder: its drive is reset by the process that serves the robot");
  EXPECT_EQ(backend.single_resets, 0U);
  backend.resets_alone = true;
  EXPECT_EQ(reset("shoulder"), "done");
  cycle->inbox().end_run();
  steps(1);
  const auto late = cycle->services().reset_joint("shoulder", RunServices::Patience{0});
  ASSERT_FALSE(late);
  has(late.error().to_string(), "the run is in the phase shut-down");
}

TEST_F(DriveReset, IsPartOfASnapshot) {
  begin(hal::StopCategory::kWarn);
  trip(1);
  backend.reset_clears = false;
  EXPECT_EQ(reset("elbow"), "done");
  steps(1000);
  const auto snapshot = cycle->save();
  ASSERT_TRUE(snapshot) << snapshot.error().to_string();
  steps(4000);
  EXPECT_EQ(look(1).resetting, 0);
  ASSERT_TRUE(cycle->restore(*snapshot));
  steps(1);
  EXPECT_EQ(look(1).resetting, 1);
}

// The other motion that a fault forbids: tandem joint move.
// A joint whose faults only warn was told to move, and lay where it was.
TEST_F(DriveReset, IsNeededBeforeTheJointIsMovedOrPutIntoAMode) {
  begin(hal::StopCategory::kWarn);
  trip(1);
  ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  const auto move = [&](double target_rad) {
    return answered([&](RunServices& services) {
      return services.move_joint("elbow", {.target_rad = target_rad});
    });
  };
  const auto set = [&](hal::ControlMode mode) {
    return answered([&](RunServices& services) {
      return services.set_joint("elbow", {.mode = static_cast<std::int32_t>(mode)});
    });
  };
  has(move(0.2), "its drive is in fault");
  has(move(0.2), "tandem joint reset elbow");
  has(set(hal::ControlMode::kTorque), "its drive is in fault");
  EXPECT_EQ(move(MoveRequest::kDefault), "done") << "a stop is never refused for that";
  EXPECT_EQ(set(hal::ControlMode::kIdle), "done") << "nor is no torque";
}

TEST_F(DriveReset, AndAFaultThatIsLatchedKeepsEveryJointFromBeingMoved) {
  begin(hal::StopCategory::kCategory1);
  const auto move = [this] {
    return answered(
        [](RunServices& services) { return services.move_joint("elbow", {.target_rad = 0.5}); });
  };
  EXPECT_EQ(move(), "done");
  trip(2);
  const double reference = cycle->command().position_rad()[1];
  has(move(),
      "elbow: nothing is moved while a fault is latched (tandem fault reset, then ask again)");
  EXPECT_EQ(reset("wrist"), "done");
  has(move(), "while a fault is latched");
  steps(100);
  EXPECT_NEAR(cycle->command().position_rad()[1], reference, 0.1);
  cycle->inbox().reset_faults();
  steps(50);
  ASSERT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_EQ(move(), "done");
}

}  // namespace
}  // namespace tandem::runtime
