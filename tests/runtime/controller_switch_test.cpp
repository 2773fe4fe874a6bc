// Controllers that change while a run goes on, on first-order joints. Linked with the real-time
// trap.
#include <atomic>
#include <thread>

#include "tests/runtime/switch_run.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;
using test::document_of;
using test::kNow;
using test::Names;
using test::Sine;
using test::SwitchRun;

TEST(ControllerSwitch, HappensInTheNextCycleAndInThatOnly) {
  SwitchRun run;
  run.run();
  EXPECT_EQ(run.active(), Names{"left"});
  const auto asked = run.change({"left"}, {"right"});
  ASSERT_TRUE(asked);
  EXPECT_FALSE(asked->done) << "nobody has stepped";
  EXPECT_EQ(run.active(), Names{"left"});
  const int before = run.left->updates;
  run.steps(1);
  EXPECT_EQ(run.active(), Names{"right"});
  EXPECT_EQ(run.left->updates, before);
  EXPECT_EQ(run.left->stops, 1);
  EXPECT_EQ(run.right->starts, 1);
  EXPECT_EQ(run.right->updates, 1);
}

TEST(ControllerSwitch, IsAnsweredWithItsCycleWhenTheLoopIsAtWork) {
  SwitchRun run(1'000'000'000);
  run.run();
  std::atomic<bool> done{false};
  std::thread loop([&] {
    while (!done.load() && run.cycle->step()) {
    }
  });
  const auto asked = run.services().switch_controllers({"left"}, {"right"});
  done = true;
  loop.join();
  ASSERT_TRUE(asked) << asked.error().to_string();
  EXPECT_TRUE(asked->done);
  EXPECT_GE(asked->cycle, 100U);
  EXPECT_EQ(run.active(), Names{"right"});
}

TEST(ControllerSwitch, RefusesAConflictAndNamesBothControllersAndTheJoint) {
  SwitchRun run;
  run.run();
  const auto asked = run.change({}, {"right"});
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().key, "elbow");
  EXPECT_EQ(asked.error().message, "is claimed by the controllers 'left' and 'right'");
  run.steps(10);
  EXPECT_EQ(run.active(), Names{"left"});
  EXPECT_EQ(run.right->starts, 0);
}

TEST(ControllerSwitch, JudgesWhoWouldBeActiveTogetherAfterWhatWasAskedBefore) {
  SwitchRun run;
  run.run();
  ASSERT_TRUE(run.change({}, {"wrist"}));  // not taken yet
  const auto asked = run.change({"left"}, {"right"});
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().key, "wrist");
  ASSERT_TRUE(run.change({"left", "wrist"}, {"right"}));
  run.steps(1);
  EXPECT_EQ(run.active(), Names{"right"});
}

TEST(ControllerSwitch, IsAllOrNothing) {
  SwitchRun run;
  run.run();
  EXPECT_FALSE(run.change({"left"}, {"right", "wrist"}));  // those two want the wrist
  EXPECT_FALSE(run.change({"left"}, {"rihgt"}));
  EXPECT_FALSE(run.change({"left", "wrist"}, {}));  // not active
  EXPECT_FALSE(run.change({}, {"left"}));           // active already
  EXPECT_FALSE(run.change({"left"}, {"left"}));
  EXPECT_FALSE(run.change({"left", "left"}, {}));
  EXPECT_FALSE(run.change({}, {}));
  run.steps(10);
  EXPECT_EQ(run.active(), Names{"left"});
  EXPECT_EQ(run.left->stops, 0);
  const auto mistyped = run.change({}, {"rihgt"});
  EXPECT_EQ(mistyped.error().hint, "did you mean 'right'?");
}

TEST(ControllerSwitch, HoldsWhatAStoppedControllerLeaves) {
  SwitchRun run;
  run.run();
  const double before = run.reference(0);
  run.steps(1);
  const double last = run.reference(0);
  ASSERT_TRUE(run.change({"left"}, {}));
  run.steps(300);
  const double rest = run.reference(0);
  EXPECT_NEAR(rest - last, (last - before) * (1.0 + 250.0 / 2.0), 1e-9) << "it brakes for 0.25 s";
  run.steps(300);
  EXPECT_EQ(run.reference(0), rest);
  EXPECT_EQ(run.cycle->command().velocity_rad_s()[0], 0.0);
  EXPECT_EQ(run.cycle->command().mode()[0], static_cast<std::int8_t>(ControlMode::kPosition));
}

TEST(ControllerSwitch, WithEveryControllerStoppedTheRunHoldsForItsDuration) {
  SwitchRun run(500);
  run.run();
  ASSERT_TRUE(run.change({"left"}, {}));
  run.cycle->run();
  EXPECT_EQ(run.cycle->running_cycles(), 500U);
  EXPECT_TRUE(run.cycle->faults().empty());
}

TEST(ControllerSwitch, TheRunEndsWhenTheExperimentsActiveControllersAreDone) {
  SwitchRun run(500);
  run.run();
  ASSERT_TRUE(run.change({}, {"wrist"}));
  run.steps(10);
  run.left->answer = Code::kStopped;
  run.steps(10);
  EXPECT_TRUE(run.services().controllers()[0].done);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning) << "the wrist is at work";
  run.wrist->answer = Code::kStopped;
  run.steps(1);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kShutDown);
}

TEST(ControllerSwitch, AControllerThatWasLoadedWhileTheRunGoesOnNeverEndsIt) {
  SwitchRun run(500);
  run.run();
  auto made = std::make_shared<Sine>(std::vector<std::size_t>{0});
  ASSERT_TRUE(run.services().load("late", made, document_of(), kNow));
  ASSERT_TRUE(run.change({"left"}, {"late"}));
  made->answer = Code::kStopped;
  run.cycle->run();
  EXPECT_EQ(made->updates, 1);
  EXPECT_EQ(run.cycle->running_cycles(), 500U);
}

TEST(ControllerSwitch, BeforeTheControllersRunSetsWhoWillStart) {
  SwitchRun run(500, 50);
  run.steps(30);
  ASSERT_EQ(run.cycle->phase(), RunPhase::kSettling);
  ASSERT_TRUE(run.change({"left"}, {"right"}));
  run.steps(5);
  EXPECT_EQ(run.active(), Names{"right"});
  EXPECT_EQ(run.right->starts, 0);
  EXPECT_EQ(run.left->stops, 0) << "it never ran";
  while (run.cycle->phase() == RunPhase::kSettling) run.steps(1);
  run.steps(10);
  EXPECT_EQ(run.right->starts, 1);
  EXPECT_EQ(run.left->starts, 0);
}

TEST(ControllerSwitch, IsRefusedOnceTheRunShutsDown) {
  SwitchRun run;
  run.run();
  run.cycle->inbox().end_run();
  run.steps(1);
  const auto asked = run.change({"left"}, {});
  ASSERT_FALSE(asked);
  EXPECT_EQ(asked.error().message, "the run is in the phase shut-down");
  run.cycle->run();
  EXPECT_FALSE(run.change({"left"}, {}));
}

TEST(ControllerSwitch, AfterAResetTheSameControllersStartAgain) {
  SwitchRun run;
  run.run();
  ASSERT_TRUE(run.change({"left"}, {"right"}));
  run.steps(1);
  run.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  run.cycle->run();
  EXPECT_EQ(run.active(), Names{"right"});
  EXPECT_EQ(run.right->stops, 1);
}

}  // namespace
}  // namespace tandem::runtime
