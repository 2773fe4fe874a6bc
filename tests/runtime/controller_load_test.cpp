// Controllers that come and go while a run goes on; snapshots of them; requests at random and from
// many threads. Linked with the real-time trap.
#include <algorithm>
#include <atomic>
#include <random>
#include <thread>

#include "tests/runtime/switch_run.hpp"

namespace tandem::runtime {
namespace {

using test::document_of;
using test::kNow;
using test::Names;
using test::Sine;
using test::SwitchRun;

TEST(ControllerLoad, MakesAControllerThatCanBeStartedAndUnloaded) {
  SwitchRun run;
  run.run();
  auto made = std::make_shared<Sine>(std::vector<std::size_t>{2});
  const std::weak_ptr<Sine> alive = made;
  ASSERT_TRUE(run.services().load("late", std::move(made), document_of(), kNow));
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
    return run.services().load(name, std::make_shared<Sine>(std::move(joints)), document_of(text),
                               kNow);
  };
  EXPECT_EQ(load("left", {0}).error().key, "left");
  EXPECT_FALSE(load("", {0}));
  EXPECT_NE(load("a\033[2Jb", {0}).error().message.find("has other characters"), std::string::npos);
  EXPECT_NE(load("a,b", {0}).error().message.find("has other characters"), std::string::npos);
  EXPECT_NE(load(std::string(65, 'a'), {0}).error().message.find("longer than 64"),
            std::string::npos);
  const auto none = run.services().load(
      "odd", std::make_shared<Sine>(std::vector<std::size_t>{0}, static_cast<hal::ControlMode>(77)),
      document_of(""), kNow);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("in mode 77, which does not exist"), std::string::npos);
  EXPECT_FALSE(load("late", {3}));
  EXPECT_FALSE(load("late", {1, 1}));
  const auto unknown = load("late", {0}, "amplitude_rd = 1");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("amplitude_rd"), std::string::npos);
  run.steps(10);
  EXPECT_EQ(run.services().controllers().size(), 3U);
}

/// What it does in configure() never comes back.
class Lost : public Controller {
 public:
  explicit Lost(bool exits) : exits_(exits) {}
  Status configure(ControllerSetup&) override {
    if (exits_) std::exit(0);
    for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
  }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {}
  Code update(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {
    return Code::kOk;
  }

 private:
  bool exits_;
};

TEST(ControllerLoad, LeavesAControllerBehindThatDoesNotComeBack) {
  SwitchRun run;
  run.run();
  for (const bool exits : {false, true}) {
    const auto made =
        run.host->configure("lost", std::make_shared<Lost>(exits), document_of("").root(),
                            std::chrono::milliseconds(exits ? 60'000 : 100));
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().key, "lost");
    EXPECT_EQ(made.error().message, exits ? "the controller called exit()"
                                          : "the controller did not return within 100 ms");
  }
  run.steps(10);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
}

TEST(ControllerLoad, HasRoomForSoManyAndSaysSo) {
  SwitchRun run;
  run.run();
  for (std::size_t i = 3; i < kMostControllers; ++i) {
    ASSERT_TRUE(run.services().load("c" + std::to_string(i),
                                    std::make_shared<Sine>(std::vector<std::size_t>{0}),
                                    document_of(), kNow));
    run.steps(1);
  }
  EXPECT_FALSE(run.services().load("more", std::make_shared<Sine>(std::vector<std::size_t>{0}),
                                   document_of(), kNow));
  ASSERT_TRUE(run.services().unload("c5", kNow));
  run.steps(1);
  EXPECT_TRUE(run.services().load("more", std::make_shared<Sine>(std::vector<std::size_t>{0}),
                                  document_of(), kNow));
}

TEST(ControllerLoad, OfALoopThatStandsStillWaitsAndThenIsRefused) {
  SwitchRun run;
  run.run();
  for (std::size_t i = 0; i < Inbox::kCapacity; ++i) {
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
                                  document_of(), kNow));
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

/// Loads, starts, stops and unloads a controller of its own, a hundred times.
void play(RunServices& services, std::size_t joint, unsigned seed, std::atomic<int>& done) {
  std::mt19937 random(seed);
  const std::string name = "of_joint_" + std::to_string(joint);
  for (int i = 0; i < 100; ++i) {
    const RunServices::Patience patience{random() % 2 == 0 ? 0 : 1000};
    auto made = std::make_shared<Sine>(std::vector<std::size_t>{joint});
    if (services.load(name, std::move(made), document_of(), patience)) ++done;
    if (services.switch_controllers({}, {name}, patience)) ++done;
    if (services.switch_controllers({name}, {}, patience)) ++done;
    if (services.unload(name)) ++done;  // waits, so that the mailbox cannot be full
    for (const JointInfo& one : services.joints()) {
      EXPECT_TRUE(one.owner.empty() || one.owner.starts_with("of_joint_")) << one.owner;
    }
  }
}

TEST(ControllerSwitch, IsAskedForByManyThreadsAtOnce) {
  SwitchRun run(1'000'000'000);
  run.run();
  ASSERT_TRUE(run.change({"left"}, {}));
  std::atomic<bool> over{false};
  std::thread loop([&] {
    while (!over.load() && run.cycle->step()) std::this_thread::yield();
  });
  std::atomic<int> done{0};
  std::vector<std::thread> askers;
  for (std::size_t joint = 0; joint < 3; ++joint) {
    askers.emplace_back(
        [&, joint] { play(run.services(), joint, static_cast<unsigned>(joint), done); });
  }
  for (std::thread& one : askers) one.join();
  over = true;
  loop.join();
  EXPECT_EQ(done.load(), 3 * 100 * 4);
  run.steps(1);
  EXPECT_EQ(run.services().controllers().size(), 3U) << "all that came have left";
  EXPECT_TRUE(run.cycle->faults().empty());
}

}  // namespace
}  // namespace tandem::runtime
