// What a reset is answered while the robot retreats, and when a fault follows it at once, and a
// stop that ends the run: its commands, its socket and `tandem fault reset`, over a robot of first
// order.
#include <unistd.h>

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>

#include "apps/clients/commands.hpp"
#include "apps/control/run_control.hpp"
#include "apps/transport/control_socket.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/socket_path.hpp"

namespace tandem::apps {
namespace {

using runtime::RunPhase;

/// A run whose cycles a test makes itself, and whose controller can retreat.
struct AnsweredRun : ::testing::Test, runtime::test::JointRun {
  void SetUp() override {
    controller->retreats = true;
    begin({.after_stop = runtime::AfterStop::kWait, .retreat_cycles = 200});
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
    add_run_commands(registry, *cycle, robot);
  }
  /// `tandem fault reset` of a run whose joint `trips` is in fault when it looks; -1: none.
  Exit reset(int trips) {
    ControlRegistry served;
    served.add({"fault.reset", ControlEffect::kChanges, "as the run's", {}},
               [this](const Json&) -> Result<Json> {
                 return registry.answer(R"({"do": "fault.reset"})");
               });
    served.add({"fault.show", ControlEffect::kReads, "as the run's, some cycles later", {}},
               [this, trips](const Json&) -> Result<Json> {
                 steps(20);
                 if (trips >= 0) backend.faulted_joint = trips;
                 steps(1);
                 return registry.answer(R"({"do": "fault.show"})");
               });
    return reset_of(served);
  }

  /// `tandem fault reset` of what answers so.
  Exit reset_of(const ControlRegistry& served) {
    const std::string path = tandem::test::socket_path("-reset");
    const auto socket = ControlSocket::open(path, served);
    EXPECT_TRUE(socket) << socket.error().to_string();
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    const Exit status =
        asked_command({.row = command_row("fault.reset"), .target = {.socket = path}});
    out = ::testing::internal::GetCapturedStdout();
    err = ::testing::internal::GetCapturedStderr();
    return status;
  }

  runtime::test::Sine* controller = add_sine({0}, "able");
  ControlRegistry registry;
  std::string out, err;  // of the last command
};

TEST_F(AnsweredRun, RefusesAResetAtOnceWhileTheRobotRetreats) {
  (void)cycle->inbox().emergency_stop(hal::StopCategory::kCategory2);
  steps(1);
  ASSERT_EQ(cycle->phase(), RunPhase::kRetreating);
  const Json refused = registry.answer(R"({"do": "fault.reset"})");
  EXPECT_EQ(refused["ok"], false) << refused;
  EXPECT_EQ(refused.value("error", ""), "the robot is on its way to a safe posture");
  EXPECT_EQ(refused.value("hint", ""), "reset it when that is over");
  EXPECT_FALSE(cycle->inbox().is_urgent()) << "nothing was asked of the loop";
  controller->answer = Code::kStopped;  // it is there
  steps(1);
  ASSERT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(registry.answer(R"({"do": "fault.reset"})")["ok"], true);
  steps(20);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
}

/// What is missing is said: first the reset, then the start.
TEST_F(AnsweredRun, SaysWhatIsMissingBeforeControllersRun) {
  (void)cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  steps(1);
  ASSERT_EQ(cycle->phase(), RunPhase::kFaulted);
  const Json start = registry.answer(R"({"do": "controller.start", "name": "able"})");
  EXPECT_EQ(start.value("error", ""),
            "able: a fault is latched: this controller was active, and stands still");
  EXPECT_EQ(start.value("hint", ""), "tandem fault reset, then tandem controller start");
  EXPECT_EQ(registry.answer(R"({"do": "fault.reset"})")["ok"], true);
  steps(20);
  ASSERT_EQ(cycle->phase(), RunPhase::kHeld);
  const Json set = registry.answer(R"({"do": "joint.set", "joint": "wrist", "mode": "torque"})");
  EXPECT_EQ(set.value("error", ""),
            "wrist: every joint is held after the reset, until the controllers run");
  EXPECT_EQ(set.value("hint", ""), "tandem controller start lets them continue, then ask again");
}

/// The run goes on only when `tandem fault reset` looks for its answer: the joint that was enabled
/// trips before that.
TEST_F(AnsweredRun, EndsAResetThatAFaultFollowsAtOnceWithStatus1) {
  backend.latch_on_fault = true;
  const auto stop = [this] {
    (void)cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
    steps(1);
    EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  };
  stop();
  EXPECT_EQ(reset(-1), Exit::kDone) << err;
  EXPECT_EQ(err, "");
  stop();
  EXPECT_EQ(reset(1), Exit::kFault);
  EXPECT_NE(out.find("reset: every joint is enabled where it is"), std::string::npos) << out;
  EXPECT_NE(err.find("error: the reset succeeded, and a fault followed at once (elbow: "),
            std::string::npos)
      << err;
}

/// A stop or a reset that did not succeed has status 1: only what was not asked at all has 2.
TEST_F(AnsweredRun, EndsAResetThatIsNotAnsweredToTheEndWithStatus1) {
  (void)cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  steps(1);
  ControlRegistry served;
  served.add(
      {"fault.reset", ControlEffect::kChanges, "as the run's", {}},
      [this](const Json&) -> Result<Json> { return registry.answer(R"({"do": "fault.reset"})"); });
  served.add({"fault.show", ControlEffect::kReads, "ended meanwhile", {}},
             [](const Json&) -> Result<Json> { return fail("the run has ended"); });
  EXPECT_EQ(reset_of(served), Exit::kFault) << err;
  EXPECT_NE(err.find("error: the run has ended"), std::string::npos) << err;
  EXPECT_EQ(reset_of({}), Exit::kUsage) << "there is no such command";
}

// It said that every joint was enabled, and that a new fault had followed at once.
TEST_F(AnsweredRun, SaysThatACauseIsStillThereOfAJointWhoseFaultsOnlyWarn) {
  robot.joints[1].on_fault = hal::StopCategory::kWarn;
  backend.faulted_joint = 1;
  backend.reset_clears = false;
  steps(2);
  ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_EQ(reset(1), Exit::kFault);
  EXPECT_EQ(out.find("every joint is enabled"), std::string::npos) << out;
  EXPECT_NE(err.find("error: a cause is still there (elbow: "), std::string::npos) << err;
}

/// The reset named what had been found first, and what stood in its way nowhere.
TEST_F(AnsweredRun, NamesTheCauseThatIsThereNow) {
  backend.latch_on_fault = true;
  backend.faulted_joint = 1;
  backend.fault_code = 0x8612;
  backend.reset_clears = false;
  steps(2);
  ASSERT_EQ(cycle->phase(), RunPhase::kFaulted);
  backend.fault_code = 0x7320;
  steps(20);
  const Json shown = registry.answer(R"({"do": "fault.show"})");
  ASSERT_EQ(shown["faults"].size(), 2U) << shown;
  EXPECT_EQ(reset(1), Exit::kFault);
  EXPECT_NE(err.find("7320"), std::string::npos) << err;
  EXPECT_EQ(err.find("8612"), std::string::npos) << err;
  EXPECT_EQ(registry.answer(R"({"do": "fault.show"})")["faults"].size(), 2U) << "told once";
}

/// Between the phase of the last cycle and what it confirms, it lets time pass.
struct SlowEnd : hal::CycleObserver {
  void take(const hal::CycleView& view) noexcept override {
    if (view.phase == RunPhase::kDone) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
};

// It was said that the run was over, and its loop stopped nothing any more: status 1, of a stop
// that the loop was carrying out. The phase of its last cycle is seen before what that confirms.
TEST(AnsweredStop, IsConfirmedByTheLastCycle) {
  runtime::test::JointRun run;
  SlowEnd slow;
  run.observer = &slow;
  run.backend.shut_down_cycles = 2;
  run.begin({});
  ControlRegistry registry;
  add_run_commands(registry, *run.cycle, run.robot);
  run.cycle->inbox().end_run();
  run.steps(1);
  ASSERT_EQ(run.cycle->phase(), RunPhase::kShutDown);
  auto answer =
      std::async(std::launch::async, [&] { return registry.answer(R"({"do": "estop"})"); });
  while (!run.cycle->inbox().is_urgent()) std::this_thread::yield();
  EXPECT_FALSE(run.cycle->step());
  EXPECT_EQ(run.cycle->phase(), RunPhase::kDone);
  const Json confirmed = answer.get();
  EXPECT_EQ(confirmed.value("confirmed", false), true) << confirmed;
  const Json late = registry.answer(R"({"do": "estop"})");
  EXPECT_EQ(late.value("error", ""), "the run is over: its loop stops nothing any more") << late;
}

}  // namespace
}  // namespace tandem::apps
