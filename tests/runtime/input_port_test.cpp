// Inputs of controllers: what they may be told, by whom, and what holds without it.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <thread>

#include "log/log_file.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::runtime {
namespace {

using test::kNow;

/// Joint 0 is where its inputs say: their sum.
class Follower : public Controller {
 public:
  struct Declared {
    std::string name;
    InputKind kind;
    InputOptions options;
  };
  explicit Follower(std::vector<Declared> declared) : declared_(std::move(declared)) {}
  Status configure(ControllerSetup& setup) override {
    for (const Declared& one : declared_)
      inputs.push_back(setup.input(one.name, one.kind, one.options));
    setup.claim(0, hal::ControlMode::kPosition);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept override {
    from_ = state.position_rad()[0];
  }
  Code update(const hal::CycleTime& time, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    double sum = from_;
    for (const Input& input : inputs) sum += 1e-3 * input[0];
    if (inputs.front().arrived()) arrived_in = time.cycle;
    command.position_rad()[0] = sum;
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(from_); }

  std::vector<Input> inputs;
  std::uint64_t arrived_in = 0;

 private:
  std::vector<Declared> declared_;
  double from_ = 0.0;
};

const InputOptions kRate{
    .names = {"a", "b"}, .unit = "rad/s", .max = {1.0, 2.0}, .timeout_s = 0.005};

InputSource timeline(std::vector<std::vector<double>> rows, double repeat_s = 0.0) {
  return {.name = "rate",
          .feeder = InputFeeder::kTimeline,
          .timeline = std::move(rows),
          .repeat_s = repeat_s};
}

struct InputLoop : test::JointRun {
  Status add(std::vector<Follower::Declared> declared, std::vector<InputSource> sources = {},
             bool active = true) {
    auto made = std::make_shared<Follower>(std::move(declared));
    follower = made.get();
    return host->add("one", std::move(made), test::parameters(), active, sources);
  }
  void run(std::vector<InputSource> sources = {}, InputOptions options = kRate) {
    const Status added =
        add({{"rate", InputKind::kNumbers, std::move(options)}}, std::move(sources));
    ASSERT_TRUE(added) << added.error().to_string();
    begin();
    (void)until(RunPhase::kRunning);
  }
  std::string set(const InputRequest& wish, const std::string& name = "rate") {
    return text(services().set_input(name, wish, kNow));
  }
  [[nodiscard]] const Input& input() const { return follower->inputs.front(); }
  [[nodiscard]] InputReport look() { return services().inputs().front(); }
  Follower* follower = nullptr;
};
struct InputRun : testing::Test, InputLoop {};

TEST_F(InputRun, ASampleArrivesBetweenTwoCyclesAndHoldsUntilItsTimeOut) {
  run();
  EXPECT_FALSE(input().fresh());
  EXPECT_EQ(set({.components = {"b", "a"}, .numbers = {2.0, 0.5}}), "accepted");
  EXPECT_EQ(input()[0], 0.0);
  steps(1);
  EXPECT_TRUE(input().fresh());
  EXPECT_TRUE(input().arrived());
  EXPECT_EQ(input()[0], 0.5);
  EXPECT_EQ(input()[1], 2.0);
  EXPECT_EQ(input().sequence(), 1U);
  EXPECT_EQ(input().cycle(), follower->arrived_in);
  steps(5);
  EXPECT_TRUE(input().fresh());
  EXPECT_FALSE(input().arrived());
  steps(1);
  EXPECT_FALSE(input().fresh());
  EXPECT_EQ(input()[0], 0.0);
  const InputReport report = look();
  EXPECT_EQ(report.look.counts.arrived, 1U);
  EXPECT_EQ(report.look.counts.timed_out, 1U);
  EXPECT_FALSE(report.look.fresh);
}

TEST_F(InputRun, AfterTheTimeOutItHoldsWhatTheControllerDeclared) {
  for (const auto& [after, held] : {std::pair{AfterTimeout::kZero, 0.0},
                                    {AfterTimeout::kLast, 0.7},
                                    {AfterTimeout::kDefault, 0.3}}) {
    of(hal::test::fake_robot());
    InputOptions options = kRate;
    options.after = after;
    options.otherwise = {0.3, 0.0};
    run({}, options);
    EXPECT_EQ(input()[0], after == AfterTimeout::kZero ? 0.0 : 0.3);
    EXPECT_EQ(set({.components = {"a"}, .numbers = {0.7}}), "accepted");
    steps(1);
    EXPECT_EQ(input()[0], 0.7);
    steps(10);
    EXPECT_EQ(input()[0], held);
  }
}

TEST_F(InputRun, WhatIsOutOfBoundsIsRefusedByNameAndCounted) {
  run();
  constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double wrong : {1.001, -1.001, kNotANumber, kInfinity, -kInfinity}) {
    EXPECT_NE(set({.components = {"a"}, .numbers = {wrong}}).find("a:"), std::string::npos)
        << wrong;
  }
  EXPECT_NE(set({.components = {"c"}, .numbers = {0.0}}).find("no component 'c'"),
            std::string::npos);
  EXPECT_NE(set({}, "rat").find("'rate'"), std::string::npos) << set({}, "rat");
  steps(2);
  EXPECT_EQ(input().sequence(), 0U);
  EXPECT_EQ(look().look.counts.refused, 6U);
}

TEST_F(InputRun, AFloodIsOneSampleACycleTheNewest) {
  run();
  for (int i = 1; i <= 1000; ++i) {
    EXPECT_EQ(set({.components = {"a"}, .numbers = {i * 1e-3}}), "accepted");
  }
  steps(3);
  EXPECT_EQ(input()[0], 1.0);
  EXPECT_EQ(input().sequence(), 1U);
  EXPECT_EQ(look().look.counts.superseded, 999U);
}

/// Never half of one and half of another, and none twice.
TEST_F(InputRun, SamplesOfAnotherThreadArriveWhole) {
  InputOptions options = kRate;
  options.max = {1e9};
  run({}, options);
  const auto port = services().inputs_of(InputFeeder::kCommand).front();
  std::atomic<bool> more{true};
  std::thread feeder([&] {
    for (double i = 1.0; more; ++i) {
      const double sample[]{i, i};
      EXPECT_TRUE(port->offer(InputFeeder::kCommand, sample));
    }
  });
  double before = 0.0;
  for (int i = 0; i < 2000 || input().sequence() == 0; ++i) {  // until the thread has begun
    steps(1);
    EXPECT_EQ(input()[0], input()[1]);
    if (!input().arrived()) continue;
    EXPECT_GT(input()[0], before);
    before = input()[0];
  }
  more = false;
  feeder.join();
  EXPECT_GT(input().sequence(), 0U);
}

TEST_F(InputRun, ATimelineArrivesInExactCycles) {
  run({timeline({{0.0, 0.1, 0.0}, {0.010, 0.2, 0.0}, {0.0125, 0.3, 0.0}})});
  const std::uint64_t start = input().cycle();
  EXPECT_EQ(input()[0], 0.1);
  steps(9);
  EXPECT_FALSE(input().fresh());
  steps(1);
  EXPECT_EQ(input()[0], 0.2);
  EXPECT_EQ(input().cycle(), start + 10);
  steps(3);
  EXPECT_EQ(input()[0], 0.3);
  EXPECT_EQ(input().cycle(), start + 13);
}

TEST_F(InputRun, ARowThatRepeatsStaysFresh) {
  run({timeline({{0.001, 0.1, 0.0}, {0.050, 0.2, 0.0}}, 0.004)});
  steps(1);
  for (int i = 0; i < 40; ++i) {
    EXPECT_TRUE(input().fresh()) << i;
    steps(1);
  }
  EXPECT_EQ(input().sequence(), 11U);
}

TEST_F(InputRun, OnlyOneSourceFeedsAnInput) {
  run({timeline({{1.0, 0.1, 0.0}})});
  EXPECT_NE(set({.components = {"a"}, .numbers = {0.5}}).find("is fed by its timeline"),
            std::string::npos);
  steps(5);
  EXPECT_EQ(input().sequence(), 0U);
}

TEST_F(InputRun, WhatCameBeforeTheControllerStartedDoesNotCount) {
  ASSERT_TRUE(add({{"rate", InputKind::kNumbers, kRate}}, {}, false));
  begin();
  (void)until(RunPhase::kRunning);
  EXPECT_NE(set({.components = {"a"}, .numbers = {0.5}}).find("not active"), std::string::npos);
  const double sample[]{0.5, 0.5};
  EXPECT_TRUE(
      services().inputs_of(InputFeeder::kCommand).front()->offer(InputFeeder::kCommand, sample));
  steps(2);
  EXPECT_TRUE(services().switch_controllers({}, {"one"}, kNow));
  steps(3);
  EXPECT_EQ(input().sequence(), 0U);
  EXPECT_EQ(look().look.counts.superseded, 1U);
  EXPECT_EQ(set({.components = {"a"}, .numbers = {0.5}}), "accepted");
  steps(1);
  EXPECT_EQ(input()[0], 0.5);
}

TEST_F(InputRun, AStopIsFirst) {
  run();
  cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  EXPECT_EQ(set({.components = {"a"}, .numbers = {0.5}}), "accepted");
  steps(2);
  EXPECT_EQ(input().sequence(), 0U);
}

TEST_F(InputRun, DeclarationsThatMakeNoSenseAreErrorsByName) {
  using Kind = InputKind;
  const auto why = [this](std::vector<Follower::Declared> declared,
                          std::vector<InputSource> sources = {}) {
    of(hal::test::fake_robot());
    const Status added = add(std::move(declared), std::move(sources));
    return added ? std::string() : added.error().to_string();
  };
  const auto has = [&](const std::string& text, const char* word) {
    EXPECT_NE(text.find(word), std::string::npos) << text;
  };
  has(why({{"a", Kind::kTwist, {}}, {"a", Kind::kTwist, {}}}), "'a' twice");
  has(why({{"a b", Kind::kTwist, {}}}), "letters");
  has(why({{"a", Kind::kNumbers, {}}}), "names no components");
  has(why({{"a", Kind::kNumbers, {.names = {"x", "x"}}}}), "twice");
  has(why({{"a", Kind::kTwist, {.max = {1.0, 2.0}}}}), "2 numbers for 6");
  has(why({{"a", Kind::kTwist, {.min = {2.0}, .max = {1.0}}}}), "no range");
  has(why({{"a", Kind::kTwist, {.timeout_s = std::nan("")}}}), "no time-out");
  has(why({{"a", Kind::kTwist, {.max = {1.0}, .otherwise = {9, 0, 0, 0, 0, 0}}}}), "beyond");
  has(why({{"a", Kind::kTrajectory, {.names = {"nobody"}}}}), "nobody");
  has(why({{"a", Kind::kTrajectory, {.names = {"shoulder"}, .most_points = 2000}}}), "too large");
  has(why(std::vector<Follower::Declared>(17, {"a", Kind::kTwist, {}})), "17 inputs");
  has(why({{"rate", Kind::kNumbers, kRate}}, {timeline({{0.0, 3.0, 0.0}})}), "a 3 is beyond");
  has(why({{"rate", Kind::kNumbers, kRate}}, {timeline({{0.0, 1.0}})}), "1 numbers");
  has(why({{"rate", Kind::kNumbers, kRate}}, {timeline({{1.0, 0, 0}, {0.5, 0, 0}})}), "not later");
  has(why({{"rote", Kind::kNumbers, kRate}}, {timeline({})}), "'rote'");
}

TEST_F(InputRun, ATrajectoryIsCheckedPointByPoint) {
  ASSERT_TRUE(add({{"way", InputKind::kTrajectory, {.names = {"shoulder", "elbow"}}}}));
  begin();
  (void)until(RunPhase::kRunning);
  const auto way = [&](std::vector<InputRequest::Point> points) {
    return set({.points = std::move(points)}, "way");
  };
  EXPECT_EQ(way({{0.5, {0.1, 0.2}}, {1.0, {0.3, 0.4}}}), "accepted");
  steps(1);
  ASSERT_EQ(input().points(), 2U);
  EXPECT_FALSE(input().has_velocities());
  EXPECT_EQ(input().time_s(1), 1.0);
  EXPECT_EQ(input().position_rad(1)[1], 0.4);
  EXPECT_NE(way({{0.5, {0.1}}}).find("each joint"), std::string::npos);
  EXPECT_NE(way({{0.5, {0.1, 0.2}}, {0.5, {0.1, 0.2}}}).find("does not grow"), std::string::npos);
  EXPECT_NE(way({{0.5, {1e3, 0.2}}}).find("shoulder"), std::string::npos);
  EXPECT_NE(way({{0.5, {0.1, 0.2}, {1e6, 0.0}}}).find("velocity"), std::string::npos);
  EXPECT_NE(way(std::vector<InputRequest::Point>(17)).find("too many"), std::string::npos);
  EXPECT_EQ(way({}), "accepted");
  steps(1);
  EXPECT_EQ(input().points(), 0U);
}

/// A quaternion of no length would turn the robot anywhere.
TEST_F(InputRun, APoseHasAUnitQuaternion) {
  ASSERT_TRUE(add({{"goal", InputKind::kPose, {.max = {2.0}}}}));
  begin();
  (void)until(RunPhase::kRunning);
  EXPECT_EQ(input()[6], 1.0);
  EXPECT_NE(set({.components = {"qw"}, .numbers = {0.5}}, "goal").find("norm"), std::string::npos);
  EXPECT_EQ(set({.components = {"x", "qx", "qw"}, .numbers = {0.2, 0.6, 0.8}}, "goal"), "accepted");
}

/// Every command of the run, with what was told live, and of its replay from the log.
TEST_F(InputRun, AReplayFromTheLogIsTheSameToTheLastBit) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "live.mcap";
  const auto commands = [](log::Recorder* to, std::vector<InputSource> sources, bool live) {
    InputLoop loop;
    loop.recorder = to;
    loop.run(std::move(sources));
    std::vector<std::byte> all;
    for (int i = 0; i < 100; ++i) {
      if (live && i % 7 == 3) {
        EXPECT_EQ(loop.set({.components = {"a"}, .numbers = {std::sin(i * 0.1)}}), "accepted");
      }
      loop.steps(1);
      const auto bytes = loop.cycle->command().bytes();
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
    return all;
  };
  auto recording = log::Recorder::open(path, {.joints = {"shoulder", "elbow", "wrist"}}, {});
  ASSERT_TRUE(recording) << recording.error().to_string();
  const auto live = commands(recording->get(), {}, true);
  (void)(*recording)->close();
  const auto log = log::LogFile::open(path);
  ASSERT_TRUE(log) << log.error().to_string();
  ASSERT_NE(log->find("/tandem/input/one/rate"), nullptr);
  EXPECT_EQ(log->find("/tandem/input/one/rate")->messages, 14U);
  const auto replayed =
      commands(nullptr, {{.name = "rate", .feeder = InputFeeder::kFile, .file = path}}, false);
  EXPECT_EQ(live, replayed);
  const auto without = commands(nullptr, {}, false);
  EXPECT_NE(live, without);
}

// What is left of the samples would have been played as if it were all.
TEST_F(InputRun, AReplayFromALogThatLostSomethingIsRefused) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "live.mcap";
  auto recording = log::Recorder::open(path, {.joints = {"shoulder", "elbow", "wrist"}}, {});
  ASSERT_TRUE(recording) << recording.error().to_string();
  recorder = recording->get();
  run();
  EXPECT_EQ(set({.components = {"a"}, .numbers = {0.3125}}), "accepted");
  steps(5);
  (void)recorder->close();
  cycle.reset();
  std::string bytes = log::content(path);
  const double sample = 0.3125;
  const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&sample), 8));
  ASSERT_NE(at, std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  log::overwrite(path, bytes);
  InputLoop loop;
  const Status added = loop.add({{"rate", InputKind::kNumbers, kRate}},
                                {{.name = "rate", .feeder = InputFeeder::kFile, .file = path}});
  ASSERT_FALSE(added);
  EXPECT_NE(
      added.error().to_string().find("is damaged, so its inputs cannot be replayed: chunk of"),
      std::string::npos)
      << added.error().to_string();
}

/// An input of each kind, and a sample of it that is no other.
struct OfAKind {
  Follower::Declared declared;
  std::function<std::vector<double>(double)> sample;
};
std::vector<OfAKind> every_kind() {
  const auto six = [](double x) {
    return std::vector{x, -x, 0.5 * x, 0.1, x * x, 1.0 / (3.0 + x)};
  };
  return {
      {{"twist", InputKind::kTwist, {.max = {9.0}}}, six},
      {{"wrench", InputKind::kWrench, {.max = {9.0}, .timeout_s = 0.0}}, six},
      {{"pose", InputKind::kPose, {.max = {9.0}}},
       [](double x) { return std::vector{x, 0.1, -x, std::sin(x), 0.0, 0.0, std::cos(x)}; }},
      {{"numbers", InputKind::kNumbers, {.names = {"a", "b"}, .timeout_s = 0.004}},
       [](double x) {
         return std::vector{std::exp(x), -x};
       }},
      {{"buttons", InputKind::kButtons, {.names = {"go", "halt"}, .timeout_s = 0.002}},
       [](double x) {
         return std::vector{x > 0.0 ? 1.0 : 0.0, x > 0.5 ? 1.0 : 0.0};
       }},
      {{"way", InputKind::kTrajectory, {.names = {"shoulder"}, .most_points = 2}},
       [](double x) { return std::vector{2.0, 1.0, 0.1, 0.01 * x, 0.02, 0.3, -0.01 * x, 0.0}; }}};
}

/// Joint 0 is where the sum of all that its inputs hold says: one bit of one of them shows.
class SumOfAll final : public Follower {
 public:
  using Follower::Follower;
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    double sum = 0.0, weight = 1e-4;
    for (const Input& input : inputs) {
      for (const double value : input.values()) sum += (weight *= 0.97) * value;
      sum += 1e-7 * static_cast<double>(input.sequence() + (input.fresh() ? 1 : 0));
    }
    command.position_rad()[0] = sum;
    return Code::kOk;
  }
};

TEST_F(InputRun, AReplayOfEveryKindIsTheSameToTheLastBit) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "kinds.mcap";
  const auto kinds = every_kind();
  ASSERT_EQ(kinds.size(), std::size(kInputKinds));
  const auto commands = [&](log::Recorder* to, InputFeeder feeder) {
    std::vector<Follower::Declared> declared;
    std::vector<InputSource> sources;
    for (const OfAKind& one : kinds) {
      declared.push_back(one.declared);
      if (feeder == InputFeeder::kFile)
        sources.push_back({.name = one.declared.name, .feeder = feeder, .file = path});
    }
    InputLoop loop;
    loop.recorder = to;
    EXPECT_TRUE(loop.host->add("one", std::make_shared<SumOfAll>(declared), test::parameters(),
                               true, sources));
    loop.begin();
    (void)loop.until(RunPhase::kRunning);
    const auto ports = loop.services().inputs_of(InputFeeder::kCommand);
    std::vector<std::byte> all;
    for (int i = 0; i < 200; ++i) {
      for (std::size_t k = 0; k < ports.size(); ++k) {
        if ((i * 7 + static_cast<int>(k) * 3) % 11 != 0) continue;
        const auto taken = ports[k]->offer(feeder, kinds[k].sample(std::sin(i * 0.37 + 1.0)));
        EXPECT_TRUE(taken) << taken.error().to_string();
      }
      loop.steps(1);
      const auto bytes = loop.cycle->command().bytes();
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
    for (const InputReport& report : loop.services().inputs()) {
      EXPECT_GE(report.look.counts.arrived, 18U) << report.port->full_name();
      EXPECT_EQ(report.look.counts.refused, 0U) << report.look.why;
    }
    return all;
  };
  auto recording = log::Recorder::open(path, {.joints = {"shoulder", "elbow", "wrist"}}, {});
  ASSERT_TRUE(recording) << recording.error().to_string();
  const auto live = commands(recording->get(), InputFeeder::kCommand);
  (void)(*recording)->close();
  EXPECT_EQ(live, commands(nullptr, InputFeeder::kFile));
}

/// Its channel is made while the log is written.
TEST_F(InputRun, AControllerThatIsLoadedLaterIsInTheLogToo) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "late.mcap";
  auto recording = log::Recorder::open(path, {.joints = {"shoulder", "elbow", "wrist"}}, {});
  ASSERT_TRUE(recording) << recording.error().to_string();
  recorder = recording->get();
  begin();
  (void)until(RunPhase::kRunning);
  const auto nothing = TomlDocument::parse("", "none");
  for (const std::string name : {"late", "later"}) {
    auto made = std::make_shared<Follower>(
        std::vector<Follower::Declared>{{"rate", InputKind::kNumbers, kRate}});
    EXPECT_TRUE(services().load(name, std::move(made), *nothing, kNow));
  }
  steps(1);
  EXPECT_TRUE(services().switch_controllers({}, {"later"}, kNow));
  steps(1);
  EXPECT_NE(set({.components = {"a"}, .numbers = {0.5}}).find("2 controllers"), std::string::npos);
  EXPECT_EQ(set({.components = {"a"}, .numbers = {0.5}}, "later/rate"), "accepted");
  steps(3);
  (void)recorder->close();
  cycle.reset();
  const auto log = log::LogFile::open(path);
  ASSERT_TRUE(log) << log.error().to_string();
  const auto read = log->read("/tandem/input/later/rate", {{"cycle", 0}, {"a", 0}, {"b", 0}});
  ASSERT_TRUE(read) << read.error().to_string();
  ASSERT_EQ(read->time_s.size(), 1U);
  EXPECT_EQ(read->columns[1][0], 0.5);
}

TEST_F(InputRun, ASnapshotHasTheSampleAndThePlaceInTheTimeline) {
  run({timeline({{0.001, 0.1, 0.0}, {0.020, 0.2, 0.0}, {0.022, 0.4, 0.0}})});
  steps(3);
  const auto saved = cycle->save();
  ASSERT_TRUE(saved) << saved.error().to_string();
  const auto values = [this] {
    std::vector<double> all;
    for (int i = 0; i < 40; ++i) {
      steps(1);
      all.push_back(input()[0]);
      all.push_back(static_cast<double>(input().sequence()));
    }
    return all;
  };
  const auto first = values();
  ASSERT_TRUE(cycle->restore(*saved));
  EXPECT_EQ(values(), first);
}

TEST_F(InputRun, AFileOfRowsIsATimeline) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "rows.csv";
  const auto why = [&](const std::string& text) {
    std::ofstream(path) << text;
    of(hal::test::fake_robot());
    const Status added = add({{"rate", InputKind::kNumbers, kRate}},
                             {{.name = "rate", .feeder = InputFeeder::kFile, .file = path}});
    return added ? std::string() : added.error().to_string();
  };
  EXPECT_NE(why("time_s,b\n0.001,9\n").find("rows.csv:2: b"), std::string::npos) << why("");
  EXPECT_NE(why("time_s,b\n0.001,1,2\n").find(":2:"), std::string::npos);
  EXPECT_NE(why("time_s,b\n0.001,nan\n").find("no finite number"), std::string::npos);
  EXPECT_NE(why("time_s,c\n0.001,1\n").find("no component 'c'"), std::string::npos);
  EXPECT_NE(why("b\n").find(":1:"), std::string::npos);
  EXPECT_EQ(why("time_s,b\n0.001,1.5\n0.002,-1.5\n"), "");
  begin();
  (void)until(RunPhase::kRunning);
  steps(1);
  EXPECT_EQ(input()[1], 1.5);
  steps(1);
  EXPECT_EQ(input()[1], -1.5);
}

// The first read beyond the rows, the second wrote beyond the sample.
TEST_F(InputRun, AFileWithoutRowsAndALongWayPointAreErrors) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "rows.csv";
  std::ofstream(path) << "time_s,after_,shoulder,elbow\n";
  const auto why = [&](InputSource source) {
    source.name = "way";
    of(hal::test::fake_robot());
    const Status added =
        add({{"way", InputKind::kTrajectory, {.names = {"shoulder", "elbow"}}}}, {source});
    return added ? std::string() : added.error().to_string();
  };
  const std::string file = why({.name = {}, .feeder = InputFeeder::kFile, .file = path});
  EXPECT_NE(file.find("rows.csv:1: a way-point is not"), std::string::npos) << file;
  std::vector<double> longer(100, 0.1);
  longer[0] = 0.5;
  const std::string row = why(
      {.name = {}, .feeder = InputFeeder::kTimeline, .timeline = {{0.5, 1.0, 0.1, 0.2}, longer}});
  EXPECT_NE(row.find("row 2 of its timeline has 99 numbers"), std::string::npos) << row;
}

/// JointRun's loop runs under the traps; this one says that a flood, a repeat and an expiry do too.
TEST_F(InputRun, TakesNoHeapInTheCycle) {
  run({timeline({{0.001, 0.1, 0.0}}, 0.002)});
  const auto port = services().inputs_of(InputFeeder::kTimeline).front();
  hal::CycleTime time{.cycle = 1000, .time_ns = 0, .period_ns = 1'000'000};
  hal::Outside outside;
  const rt::ScopedRealtime now;
  port->begin(time, true, outside);
  for (int i = 0; i < 20; ++i, ++time.cycle) {
    (void)port->take(time, i < 10, outside);
    (void)port->message();
  }
}

}  // namespace
}  // namespace tandem::runtime
