// What a controller declared goes over to its next build by name: samples of inputs, signals,
// marks, live parameters. Linked with the real-time trap.
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

using test::kNow;

/// Joint 0 stands where it stood at the start, and as far beside it as its input "offset" says.
struct Offset : Controller {
  struct Declares {
    std::vector<std::string> inputs{"offset"};
    InputOptions options{.names = {"a", "b"},
                         .unit = "rad",
                         .max = {0.1, 0.2},
                         .timeout_s = 0.0,
                         .after = AfterTimeout::kLast};
    std::vector<std::string> signals{"once"};
    std::vector<std::string> marks{"way"};
    double most_gain = 100.0;
    std::size_t more = 0;  ///< numbers of state
  };
  explicit Offset(Declares its) : declares(std::move(its)), more(declares.more) {}

  Status configure(ControllerSetup& setup) override {
    for (const std::string& name : declares.inputs) {
      inputs.push_back(setup.input(name, InputKind::kNumbers, declares.options));
      if (name == "offset") offset = inputs.back();
    }
    for (const std::string& name : declares.signals)
      signals.push_back(setup.signal(name, "rad", "a number"));
    for (const std::string& name : declares.marks)
      marks.push_back(
          setup.mark(name, {.shape = hal::MarkShape::kArrow, .frame = "base", .points = 2}));
    (void)setup.parameter("gain", {.max = declares.most_gain, .otherwise = 5.0, .live = true});
    setup.claim(0, hal::ControlMode::kPosition);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept override {
    middle_rad = state.position_rad()[0];
  }
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    command.position_rad()[0] = middle_rad + (declares.inputs.empty() ? 0.0 : offset[0]);
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(middle_rad, more); }

  Declares declares;
  std::vector<Input> inputs;
  Input offset;
  std::vector<Signal> signals;
  std::vector<Mark> marks;
  double middle_rad = 0.0;
  std::vector<double> more;
};

struct OffsetRun : test::JointRun {
  explicit OffsetRun(const Offset::Declares& declares = {}) {
    now = std::make_shared<Offset>(declares);
    add("arm", now);
    begin({.running_cycles = 200'000});
    (void)until(RunPhase::kRunning);
  }
  void set(double a) {
    ASSERT_TRUE(services().set_input("arm/offset", {.components = {"a"}, .numbers = {a}}, kNow));
  }
  /// Done by a cycle of its own.
  Reloaded reload(const Offset::Declares& declares, bool fresh = false) {
    const auto next = std::make_shared<Offset>(declares);
    const auto asked =
        while_cycling([&] { return services().reload("arm", ControllerSource(next), fresh); });
    EXPECT_TRUE(asked) << asked.error().to_string();
    now = next;
    return asked ? *asked : Reloaded{};
  }
  /// Asked for, and done in the next step, as in a paused run.
  void ask(const Offset::Declares& declares) {
    now = std::make_shared<Offset>(declares);
    ASSERT_TRUE(services().reload("arm", ControllerSource(now), false, kNow));
  }
  [[nodiscard]] InputLook look() {
    for (const InputReport& one : services().inputs())
      if (one.port->input().name == "offset") return one.look;
    return {};
  }
  std::shared_ptr<Offset> now;
};

// A signal, an input or a mark more, fewer or of another name: all inputs were back at zero, and
// the joint moved by 0.1 rad.
TEST(ReloadInputs, KeepTheirSampleWhateverElseIsDeclared) {
  const Offset::Declares all[]{{.signals = {"once", "more"}},
                               {.signals = {"other"}},
                               {.signals = {}},
                               {.inputs = {"first", "offset"}},
                               {.inputs = {"offset", "second"}},
                               {.marks = {}},
                               {.marks = {"other", "way"}},
                               {}};
  OffsetRun run({.inputs = {"offset", "gone"}});
  run.set(0.1);
  run.steps(500);
  const double before_rad = run.reference(0);
  const InputLook before = run.look();
  ASSERT_EQ(before.value[0], 0.1);
  for (const Offset::Declares& declares : all) {
    const Reloaded done = run.reload(declares);
    EXPECT_EQ(done.kept, Kept::kState);
    EXPECT_TRUE(done.left.empty()) << done.left.front();
    EXPECT_EQ(run.now->offset[0], 0.1);
    EXPECT_EQ(run.now->offset.sequence(), 1U);
    EXPECT_TRUE(run.now->offset.fresh());
    const InputLook look = run.look();
    EXPECT_EQ(look.value, before.value) << "what `tandem input list` shows";
    EXPECT_EQ(look.fresh, before.fresh);
    EXPECT_EQ(look.sequence, before.sequence);
    EXPECT_EQ(look.cycle, before.cycle);
    EXPECT_EQ(look.counts.arrived, 1U) << "since it was loaded first";
    for (int i = 0; i < 300; ++i) {
      run.steps(1);
      EXPECT_NEAR(run.reference(0), before_rad, 1e-6);
    }
  }
  run.set(0.05);
  run.steps(1);
  EXPECT_EQ(run.now->offset.sequence(), 2U);
  EXPECT_EQ(run.look().counts.arrived, 2U);
}

TEST(ReloadInputs, AreAsOldAsTheyWereForTheTimeOutOfTheNewBuild) {
  Offset::Declares timed;
  timed.options.timeout_s = 2.0;
  timed.options.after = AfterTimeout::kZero;
  OffsetRun run(timed);
  run.set(0.1);
  run.steps(1);
  const std::uint64_t arrived = run.look().cycle;
  (void)run.reload(timed);
  while (run.now->offset.fresh()) run.steps(1);
  EXPECT_EQ(run.services().joints()[0].look.cycle, arrived + 2001);
  EXPECT_EQ(run.now->offset[0], 0.0);
  run.set(0.1);
  run.steps(300);
  timed.options.timeout_s = 0.2;
  (void)run.reload(timed);
  run.steps(1);
  EXPECT_FALSE(run.now->offset.fresh()) << "300 ms are more than its 200";
  EXPECT_EQ(run.look().counts.timed_out, 2U);
}

TEST(ReloadInputs, OfAnotherMeaningBeginAnewAndAreNamed) {
  const auto changed = [](const std::function<void(Offset::Declares&)>& change) {
    OffsetRun run;
    run.set(0.1);
    run.steps(1);
    Offset::Declares next;
    change(next);
    const Reloaded done = run.reload(next);
    EXPECT_EQ(run.now->offset[0], 0.0);
    EXPECT_EQ(run.now->offset.sequence(), 0U);
    EXPECT_FALSE(run.look().fresh);
    return done.left.empty() ? "" : done.left.front();
  };
  const auto expect = [](const std::string& what, const std::string& why) {
    EXPECT_EQ(what, "input offset: its sample is gone, as " + why);
  };
  const char* other = "there is no input of this name, kind, components and units any more";
  expect(changed([](auto& next) { next.options.unit = "deg"; }), other);
  expect(changed([](auto& next) { next.options.names = {"a", "c"}; }), other);
  expect(changed([](auto& next) {
           next.options.max = {0.05, 0.2};
         }),
         "it is beyond the new bounds");
  expect(changed([](auto& next) { next.more = 3; }), "the controller starts afresh");
}

TEST(ReloadInputs, ASetValueThatDoesNotGoOverIsNamed) {
  OffsetRun run;
  const auto set = run.while_cycling([&] {
    return run.services().set_parameters(
        {{.controller = "arm", .parameter = "gain", .value = 40.0}});
  });
  ASSERT_TRUE(set);
  EXPECT_TRUE(run.reload({}).left.empty());
  const Reloaded done = run.reload({.most_gain = 20.0});
  ASSERT_EQ(done.left.size(), 1U);
  EXPECT_EQ(done.left[0], "parameter gain: was set to 40, which is out of its range now: it is 5");
}

// Time stands between what is accepted and what the loop does.
TEST(ReloadInputs, ASampleThatWasAcceptedReachesTheNewBuild) {
  for (const std::size_t more : {0U, 3U}) {  // with its state, and afresh
    OffsetRun run;
    run.set(0.1);
    run.ask({.signals = {"once", "more"}, .more = more});
    run.steps(1);
    EXPECT_EQ(run.now->offset[0], 0.1) << more;
    EXPECT_TRUE(run.now->offset.arrived());
    EXPECT_EQ(run.look().value[0], 0.1);
  }
  OffsetRun run;  // what the new bounds do not admit does not
  run.set(0.1);
  Offset::Declares narrow;
  narrow.options.max = {0.05, 0.2};
  run.ask(narrow);
  run.steps(1);
  EXPECT_EQ(run.now->offset[0], 0.0);
  EXPECT_EQ(run.look().counts.refused, 1U);
}

// Whoever feeds an input has its port from before: until it is told, and while it is.
TEST(ReloadInputs, WhatIsOfferedToTheFormerBuildReachesTheNewOne) {
  OffsetRun run;
  const auto port = run.services().inputs_of(InputFeeder::kCommand).front();
  run.ask({});
  run.steps(1);  // done, and nobody has asked since
  const double early[]{0.03, 0.0}, late[]{0.04, 0.0};
  ASSERT_TRUE(port->offer(InputFeeder::kCommand, early));
  run.steps(1);
  EXPECT_EQ(run.now->offset[0], 0.03);
  (void)run.services().controllers();
  EXPECT_NE(port->heir(), nullptr) << "nobody waited for the answer, and it is told all the same";
  ASSERT_TRUE(port->offer(InputFeeder::kCommand, late));
  run.steps(1);
  EXPECT_EQ(run.now->offset[0], 0.04);
  EXPECT_EQ(run.now->offset.sequence(), 2U);
}

TEST(ReloadInputs, NoSampleIsLostWhileBuildsChange) {
  OffsetRun run;
  const auto port = run.services().inputs_of(InputFeeder::kCommand).front();
  std::atomic<bool> more{true};
  std::uint64_t accepted = 0;
  double last = 0.0;
  std::thread feeder([&] {
    while (more) {
      last = last < 0.09 ? last + 1e-5 : 0.0;
      const double sample[]{last, 0.0};
      EXPECT_TRUE(port->offer(InputFeeder::kCommand, sample));
      ++accepted;
    }
  });
  for (int i = 0; i < 50; ++i) (void)run.reload({});
  more = false;
  feeder.join();
  run.steps(1);
  EXPECT_EQ(run.now->offset[0], last);
  const InputCounts counts = run.look().counts;
  EXPECT_EQ(counts.arrived + counts.superseded, accepted);
}

TEST(ReloadInputs, SignalsAndMarksStayByName) {
  OffsetRun run;
  run.now->signals[0] = 4.0;
  run.now->marks[0].set(1, {1.0, 2.0, 3.0});
  run.steps(1);
  (void)run.reload({.signals = {"more", "once"}, .marks = {"more", "way"}});
  run.steps(100);  // viewers are shown less often
  const auto signals = run.services().signals().front();
  EXPECT_TRUE(std::isnan(signals.block->look().values[0]));
  EXPECT_EQ(signals.block->look().values[1], 4.0);
  const auto marks = run.services().marks().front().block->look();
  EXPECT_EQ(marks.marks[0].points, 0U);
  EXPECT_EQ(marks.marks[1].points, 2U);
  EXPECT_EQ(marks.place_m[3], (std::array<double, 3>{1.0, 2.0, 3.0}));
}

}  // namespace
}  // namespace tandem::runtime
