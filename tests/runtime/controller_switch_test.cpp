// Controllers that come, go and change while a run goes on, on first-order joints. Requests are
// made between two steps, so that the cycle in which they are taken is known. Linked with the
// real-time trap.
#include <algorithm>
#include <cmath>
#include <random>
#include <thread>

#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/hal/fake_backend.hpp"
#include "tests/runtime/first_order_robot.hpp"
#include "tests/runtime/test_controllers.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;
using hal::InteractionMode;
using test::FirstOrderRobot;
using test::Sine;

constexpr RunServices::Patience kNow{0};  // asked for, not waited for
using Names = std::vector<std::string>;

TomlDocument no_parameters(const std::string& text = "") {
  return *TomlDocument::parse(text, "parameters");
}

/// Three joints. "left" has 0 and 1, "right" 1 and 2, "wrist" 2. Only "left" is active at first.
struct SwitchRun {
  explicit SwitchRun(std::uint64_t running_cycles = 2000, std::uint64_t settle_cycles = 0)
      : backend(robot), host(robot, nullptr, 1'000'000) {
    left = add("left", {0, 1}, true);
    right = add("right", {1, 2}, false);
    wrist = add("wrist", {2}, false);
    cycle = std::make_unique<RobotCycle>(
        CycleParts{robot, backend, host, clock},
        CycleConfig{.running_cycles = running_cycles, .settle_cycles = settle_cycles});
  }
  Sine* add(const std::string& name, std::vector<std::size_t> joints, bool active) {
    auto made = std::make_shared<Sine>(std::move(joints));
    EXPECT_TRUE(host.add(name, made, test::parameters(), active));
    return made.get();
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) EXPECT_TRUE(cycle->step());
  }
  /// Into the motion.
  void run() { steps(100); }
  [[nodiscard]] RunServices& services() const { return cycle->services(); }
  [[nodiscard]] Result<Asked> change(const Names& stop, const Names& start) const {
    return services().switch_controllers(stop, start, kNow);
  }
  [[nodiscard]] Names active() const {
    Names names;
    for (const ControllerLook& one : services().controllers()) {
      if (one.active) names.push_back(one.name);
    }
    return names;
  }
  [[nodiscard]] double position(std::size_t joint) const {
    return cycle->command().position_rad()[joint];
  }

  const hal::RobotConfig robot = hal::test::fake_robot();
  FirstOrderRobot backend;
  ControllerHost host;
  rt::WallClock clock;
  Sine *left, *right, *wrist;
  std::unique_ptr<RobotCycle> cycle;
};

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
  const double last = run.position(0);
  ASSERT_TRUE(run.change({"left"}, {}));
  run.steps(200);
  EXPECT_EQ(run.position(0), last);
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
  ASSERT_TRUE(run.services().load("late", made, no_parameters(), kNow));
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
  run.cycle->requests().end_run();
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
  run.cycle->requests().emergency_stop(hal::StopCategory::kCategory1);
  run.cycle->run();
  EXPECT_EQ(run.active(), Names{"right"});
  EXPECT_EQ(run.right->stops, 1);
}

TEST(ControllerLoad, MakesAControllerThatCanBeStartedAndUnloaded) {
  SwitchRun run;
  run.run();
  auto made = std::make_shared<Sine>(std::vector<std::size_t>{2});
  const std::weak_ptr<Sine> alive = made;
  ASSERT_TRUE(run.services().load("late", std::move(made), no_parameters(), kNow));
  ASSERT_TRUE(run.change({}, {"late"}));
  run.steps(10);
  EXPECT_EQ(alive.lock()->updates, 10);
  EXPECT_EQ(run.services().joints()[2].owner, "late");
  EXPECT_FALSE(run.services().unload("late", kNow)) << "it is active";
  ASSERT_TRUE(run.change({"late"}, {}));
  ASSERT_TRUE(run.services().unload("late", kNow));
  EXPECT_FALSE(alive.expired()) << "the loop still has it";
  run.steps(1);
  EXPECT_EQ(run.services().controllers().size(), 3U);
  EXPECT_TRUE(alive.expired());
}

TEST(ControllerLoad, RefusesWhatIsWrongWhileTheRunGoesOn) {
  SwitchRun run;
  run.run();
  const auto load = [&](const std::string& name, std::vector<std::size_t> joints,
                        const std::string& text = "") {
    return run.services().load(name, std::make_shared<Sine>(std::move(joints)), no_parameters(text),
                               kNow);
  };
  EXPECT_EQ(load("left", {0}).error().key, "left");
  EXPECT_FALSE(load("", {0}));
  EXPECT_FALSE(load("late", {3}));
  EXPECT_FALSE(load("late", {1, 1}));
  const auto unknown = load("late", {0}, "amplitude_rd = 1");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("amplitude_rd"), std::string::npos);
  run.steps(10);
  EXPECT_EQ(run.services().controllers().size(), 3U);
}

TEST(ControllerLoad, HasRoomForSoManyAndSaysSo) {
  SwitchRun run;
  run.run();
  for (std::size_t i = 3; i < kMostControllers; ++i) {
    ASSERT_TRUE(run.services().load(std::to_string(i),
                                    std::make_shared<Sine>(std::vector<std::size_t>{0}),
                                    no_parameters(), kNow));
    run.steps(1);
  }
  EXPECT_FALSE(run.services().load("more", std::make_shared<Sine>(std::vector<std::size_t>{0}),
                                   no_parameters(), kNow));
  ASSERT_TRUE(run.services().unload("5", kNow));
  run.steps(1);
  EXPECT_TRUE(run.services().load("more", std::make_shared<Sine>(std::vector<std::size_t>{0}),
                                  no_parameters(), kNow));
}

TEST(ControllerLoad, OfALoopThatStandsStillWaitsAndThenIsRefused) {
  SwitchRun run;
  run.run();
  for (std::size_t i = 0; i < LoopMailbox::kCapacity; ++i) {
    const auto asked =
        run.change(i % 2 == 0 ? Names{"left"} : Names{}, i % 2 == 0 ? Names{} : Names{"left"});
    ASSERT_TRUE(asked) << i;
    EXPECT_FALSE(asked->done);
  }
  EXPECT_FALSE(run.change({"left"}, {}));
  run.steps(1);
  EXPECT_EQ(run.left->stops, 8);
  EXPECT_EQ(run.left->starts, 9);
  EXPECT_EQ(run.active(), Names{"left"});
}

/// State, command and truth of the next `count` cycles.
std::vector<std::byte> bytes_of(SwitchRun& run, int count) {
  std::vector<std::byte> all;
  for (int i = 0; i < count; ++i) {
    run.cycle->step();
    for (const auto bytes :
         {std::as_const(*run.cycle).state().bytes(), run.cycle->command().bytes(),
          std::as_const(run.backend.truth).bytes()}) {
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
  }
  return all;
}

TEST(ControllerSnapshot, HoldsWhoIsActiveAndWhatIsLedOver) {
  SwitchRun run;
  run.run();
  ASSERT_TRUE(run.change({"left"}, {"right"}));
  run.steps(30);
  const auto snapshot = run.cycle->save();
  ASSERT_TRUE(snapshot);
  const auto first = bytes_of(run, 150);
  ASSERT_TRUE(run.change({"right"}, {"left"}));
  run.steps(10);
  ASSERT_TRUE(run.cycle->restore(*snapshot));
  EXPECT_EQ(run.active(), Names{"right"});
  EXPECT_TRUE(bytes_of(run, 150) == first);
}

TEST(ControllerSnapshot, OfOtherControllersIsRefusedAndChangesNothing) {
  SwitchRun run;
  run.run();
  const auto snapshot = run.cycle->save();
  ASSERT_TRUE(snapshot);
  ASSERT_TRUE(run.services().load("late", std::make_shared<Sine>(std::vector<std::size_t>{2}),
                                  no_parameters(), kNow));
  run.steps(50);
  const std::uint64_t cycle = run.cycle->state().cycle()[0];
  const Status restored = run.cycle->restore(*snapshot);
  ASSERT_FALSE(restored);
  EXPECT_NE(restored.error().message.find("other controllers"), std::string::npos);
  EXPECT_EQ(run.cycle->state().cycle()[0], cycle);
  ASSERT_TRUE(run.services().unload("late", kNow));
  run.steps(1);
  EXPECT_TRUE(run.cycle->restore(*snapshot));
}

/// What the asking side and the loop make of random requests is what a simple model says.
TEST(ControllerSwitch, KeepsClaimsExclusiveInAThousandRandomSequences) {
  const std::vector<std::vector<std::size_t>> claims{{0, 1}, {1, 2}, {2}};
  const Names names{"left", "right", "wrist"};
  std::mt19937 random(7);
  int switched = 0, refused = 0;
  for (int sequence = 0; sequence < 1000; ++sequence) {
    SwitchRun run;
    std::vector<bool> active{true, false, false};
    run.steps(15 + static_cast<int>(random() % 10));  // some before the controllers run
    for (int i = 0; i < 8; ++i) {
      Names stop, start;
      std::vector<bool> after = active;
      bool possible = false;
      for (std::size_t c = 0; c < names.size(); ++c) {
        const auto what = random() % 3;
        if (what == 0) stop.push_back(names[c]);
        if (what == 1) start.push_back(names[c]);
        if (what != 2) after[c] = what == 1;
        possible = possible || what != 2;
      }
      for (std::size_t c = 0; c < names.size(); ++c) {
        const bool named = std::ranges::count(stop, names[c]) + std::ranges::count(start, names[c]);
        possible = possible && (!named || after[c] != active[c]);
      }
      possible = possible && !(after[1] && (after[0] || after[2]));
      ASSERT_EQ(run.change(stop, start).has_value(), possible);
      (possible ? switched : refused) += 1;
      if (possible) active = after;
      run.steps(static_cast<int>(random() % 5));  // 0: the next one is judged before this is done
    }
    run.steps(1);
    std::vector<std::string> owner(3);
    for (std::size_t c = 0; c < names.size(); ++c) {
      for (const std::size_t joint : claims[c]) {
        if (!active[c]) continue;
        EXPECT_EQ(owner[joint], "") << "two have joint " << joint;
        owner[joint] = names[c];
      }
    }
    for (std::size_t j = 0; j < 3; ++j) EXPECT_EQ(run.services().joints()[j].owner, owner[j]);
    EXPECT_TRUE(run.cycle->faults().empty());
  }
  EXPECT_GT(switched, 1000);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace tandem::runtime
