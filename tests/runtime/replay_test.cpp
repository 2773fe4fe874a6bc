// A run played again from its log: bundled robots, everything that can be asked of a run, changed
// controllers, and logs that are not what they were.
#include "runtime/replay/replay.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>

#include "runtime/run/run.hpp"
#include "runtime/run/run_log.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

using test::kNow;

constexpr std::uint64_t kStart = 1217;  // the cycle in which the controllers of a run start
const std::string kConfig = TANDEM_SOURCE_DIR "/config/";
const std::string kSways = TANDEM_SWAYS_FOLDER "/sways.so";

using log::content;

void write(const std::string& path, std::string_view text) {
  log::overwrite(path, std::string(text));
}

/// A run with its log, as `tandem run` makes it.
struct Recording {
  Recording(const std::string& experiment, const std::string& folder, Overrides overrides = {}) {
    overrides.no_build = true;
    auto made = composed(experiment, overrides);
    if (!made) throw std::runtime_error(made.error().front().to_string());
    composition = std::move(*made);
    auto log = open_log(*composition, folder, "run.mcap");
    if (!log) throw std::runtime_error(log.error().to_string());
    recorder = std::move(*log);
    run.emplace(*composition, overrides, RunParts{.recorder = recorder.get()});
    path = folder + "/run.mcap";
  }
  [[nodiscard]] RobotCycle& cycle() { return run->cycle(); }
  void until(RunPhase phase) {
    for (int most = 3000; most > 0 && cycle().phase() != phase && cycle().step(); --most) {
    }
    ASSERT_EQ(cycle().phase(), phase) << cycle().state().cycle()[0];
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) (void)cycle().step();
  }
  /// To its end. @return its log
  const std::string& finish() {
    cycle().run();
    cycles = cycle().state().cycle()[0] + 1;
    (void)recorder->close();
    return path;
  }

  std::unique_ptr<Composition> composition;
  std::unique_ptr<log::Recorder> recorder;
  std::optional<Run> run;
  std::string path;
  std::uint64_t cycles = 0;
};

ReplayResult replayed(const std::string& log, ReplayOptions options = {}) {
  options.kernels.missing = robot::MissingKernels::kRefuse;
  auto result = replay(log, options);
  if (!result) throw std::runtime_error(result.error().front().to_string());
  return std::move(*result);
}

void expect_equal(const ReplayResult& result, std::uint64_t cycles) {
  EXPECT_TRUE(result.equal()) << result.why_short;
  if (result.first) {
    ADD_FAILURE() << "cycle " << result.first->cycle << " " << result.first->joint << " "
                  << result.first->field << " " << result.first->recorded << " "
                  << result.first->replayed;
  }
  EXPECT_EQ(result.cycles, cycles);
  EXPECT_EQ(result.compared, cycles);
  EXPECT_EQ(result.differ, 0U);
}

struct Bundled {
  const char* experiment;
  double duration_s;
};
class ReplayOf : public testing::TestWithParam<Bundled> {};

TEST_P(ReplayOf, ABundledExperimentIsEqual) {
  const tandem::test::ScratchFolder folder;
  Recording run(kConfig + GetParam().experiment, folder.path(),
                {.duration_s = GetParam().duration_s});
  const ReplayResult result = replayed(run.finish());
  expect_equal(result, run.cycles);
  EXPECT_TRUE(result.notes.empty()) << result.notes.front().to_string();
}

INSTANTIATE_TEST_SUITE_P(Robots, ReplayOf,
                         testing::Values(Bundled{"coman/squat.toml", 2.5},
                                         Bundled{"panda/trajectory.toml", 1.0},
                                         Bundled{"double_pendulum_ethercat/trajectory.toml", 1.0},
                                         Bundled{"double_pendulum/follow.toml", 1.5}));

/// Two controllers of one joint, and one of the other.
struct Replay : testing::Test {
  void SetUp() override {
    write(experiment,
          "robot = \"" + kConfig +
              "double_pendulum/robot.toml\"\nposture = \"ready\"\nduration_s = 0.6\nseed = 1\n"
              "[faults]\nafter_stop = \"wait\"\nafter_reset = \"continue\"\n"
              "[[controller]]\nname = \"one\"\nplugin = \"" +
              kSways + "\"\n[[controller]]\nname = \"other\"\nplugin = \"" + kSways +
              "\"\nactive = false\n[[controller]]\nname = \"second\"\nplugin = \"" + kSways +
              "\"\n[controller.parameters]\njoint = 1\n");
  }
  [[nodiscard]] Recording record() const { return Recording(experiment, folder.path()); }
  /// The log of a run without anything special.
  std::string recorded() {
    Recording run = record();
    std::string path = run.finish();
    cycles = run.cycles;
    return path;
  }
  [[nodiscard]] static std::string build(const std::string& what) {
    return TANDEM_SWAYS_FOLDER "/sways_" + what + ".so";
  }

  const tandem::test::ScratchFolder folder;
  const std::string experiment = folder / "sways.toml";
  std::uint64_t cycles = 0;
};

TEST_F(Replay, TakesWhatWasAskedInItsCycles) {
  Recording run = record();
  RunServices& services = run.cycle().services();
  run.until(RunPhase::kRunning);
  run.steps(100);
  ASSERT_TRUE(
      services.set_parameters({{"one", "size_rad", 0.2}, {"second", "size_rad", 0.05}}, kNow));
  run.steps(50);
  ASSERT_TRUE(services.set_input("one/add", {{"rad"}, {0.11}}, kNow));
  run.steps(80);
  ASSERT_TRUE(services.switch_controllers({"one"}, {"other"}, kNow));
  run.steps(60);
  ASSERT_TRUE(services.switch_controllers({"other"}, {}, kNow));
  run.steps(150);
  ASSERT_TRUE(services.move_joint("joint1", {.target_rad = 0.3, .speed_rad_s = 0.7}, kNow));
  run.steps(30);
  ASSERT_TRUE(services.set_gains("joint1", hal::PidLoop::kPosition, {.kp = 5.0}, kNow));
  const std::string& log = run.finish();
  EXPECT_GT(run.cycles, 470U);
  expect_equal(replayed(log), run.cycles);
}

TEST_F(Replay, RunsAShadowAlongAndSwitchesWhereItAgreed) {
  Recording run = record();
  RunServices& services = run.cycle().services();
  run.until(RunPhase::kRunning);
  run.steps(50);
  ASSERT_TRUE(services.begin_shadow("other", kNow));
  run.steps(50);
  ASSERT_TRUE(services.switch_when({"one"}, {"other"}, 0.02, 400'000'000, kNow));
  run.steps(5);
  const std::string& log = run.finish();
  EXPECT_EQ(services.last_switch().state, SwitchState::kDone);
  expect_equal(replayed(log), run.cycles);
}

TEST_F(Replay, GoesThroughAFaultItsResetAndAnEmergencyStop) {
  Recording run = record();
  run.until(RunPhase::kRunning);
  run.steps(100);
  sim::ScenarioFault fault;
  fault.kind = hal::FaultKind::kEncoderUnplug;
  fault.joint = 1;
  fault.duration_ns = 5'000'000;
  ASSERT_EQ(run.run->robot().robot().inject(fault), Code::kOk);
  run.until(RunPhase::kFaulted);
  run.steps(400);
  run.cycle().inbox().reset_faults();
  run.until(RunPhase::kRunning);
  run.steps(50);
  (void)run.cycle().inbox().emergency_stop(hal::StopCategory::kCategory0);
  run.until(RunPhase::kFaulted);
  run.steps(300);
  run.cycle().inbox().end_run();
  const std::string& log = run.finish();
  EXPECT_EQ(run.cycle().progress().resets.load(), 1U);
  expect_equal(replayed(log), run.cycles);
}

TEST_F(Replay, OfAChangedControllerSaysWhereItPartsAndWritesItsLog) {
  const std::string log = recorded();
  const std::string output = folder / "changed.mcap";
  const ReplayResult result =
      replayed(log, {.plugins = {{"one", build("more")}}, .output = output});
  ASSERT_TRUE(result.first);
  // This build's sway is larger from its 300th cycle on.
  EXPECT_EQ(result.first->cycle, kStart + 300U);
  EXPECT_EQ(result.first->joint, "joint1");
  EXPECT_EQ(result.first->field, "position_rad");
  EXPECT_EQ(result.first->controller, "one");
  EXPECT_NEAR(result.first->replayed - result.first->recorded, 2.0923733332e-4, 1e-12);
  for (const CommandSpread& one : result.spreads) EXPECT_NE(one.joint, "joint2") << one.field;
  const auto file = log::LogFile::open(output);
  ASSERT_TRUE(file) << file.error().to_string();
  ASSERT_NE(file->find("/tandem/controller/one"), nullptr);
  EXPECT_EQ(file->find("/tandem/command")->messages, cycles);
  EXPECT_EQ(log::value_of(file->result(), "replay_of"), log);
}

TEST_F(Replay, FindsAControllerThatActsByChance) {
  const std::string text = content(experiment);
  write(experiment,
        std::string(text).replace(text.find(kSways), kSways.size(), build("by_chance")));
  const ReplayResult result = replayed(recorded());
  ASSERT_TRUE(result.first);
  EXPECT_EQ(result.first->joint, "joint1");
  EXPECT_EQ(result.first->cycle, kStart + 2U);  // its first sine is 0, its second is braked to it
  EXPECT_TRUE(result.notes.empty()) << result.notes.front().to_string();
}

TEST_F(Replay, OfAnotherBuildUnderTheSameNameIsNoted) {
  const std::string log = recorded();
  const std::string text = content(log);
  const auto file = log::LogFile::open(log);
  const std::string& line = file->info().controllers.front();
  std::string sha = line.substr(line.find(' ') + 1, 64), other = text;
  for (std::size_t at = 0; (at = other.find(sha, at)) != std::string::npos; at += 64)
    other[at] = sha[0] == '0' ? '1' : '0';
  write(folder / "other.mcap", other);
  const ReplayResult result = replayed(folder / "other.mcap");
  EXPECT_FALSE(result.first);
  const auto noted = [&](const std::string& words) {
    return std::ranges::any_of(result.notes, [&](const Error& note) {
      return note.to_string().find(words) != std::string::npos;
    });
  };
  EXPECT_TRUE(noted("the controller 'one' is another build than the one that was recorded"));
  EXPECT_TRUE(noted("--plugin one=FILE"));
}

TEST_F(Replay, OfAnExperimentThatHasChangedSinceIsThatOfTheLog) {
  const std::string log = recorded();
  write(experiment, "robot = \"nowhere.toml\"\n");
  const ReplayResult result = replayed(log);
  expect_equal(result, cycles);
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_EQ(result.notes[0].file, experiment);
  EXPECT_EQ(result.notes[0].message, "has changed since: the log's text of it is replayed");
}

TEST_F(Replay, OfALogThatIsCutComparesWhatIsThere) {
  const std::string log = recorded();
  const std::string text = content(log);
  write(folder / "cut.mcap", std::string_view(text).substr(0, text.size() * 2 / 3));
  const ReplayResult result = replayed(folder / "cut.mcap");
  EXPECT_TRUE(result.equal()) << result.why_short;
  EXPECT_GT(result.compared, 50U);
  EXPECT_LT(result.compared, cycles);
  ASSERT_FALSE(result.notes.empty());
}

TEST_F(Replay, OfALogWithAGapEndsBeforeIt) {
  Recording run = record();
  run.until(RunPhase::kRunning);
  run.steps(100);
  const std::uint64_t before = run.cycle().next_cycle();
  run.cycle().replay(true);  // as it does not log then
  run.steps(3);
  run.cycle().replay(false);
  const ReplayResult result = replayed(run.finish());
  EXPECT_FALSE(result.equal());
  EXPECT_FALSE(result.first);
  EXPECT_EQ(result.compared, before);
  EXPECT_NE(result.why_short.find("3 cycles before it are not in the log"), std::string::npos)
      << result.why_short;
}

TEST_F(Replay, EndsWhereAControllerStartsThatCameDuringTheRun) {
  Recording run = record();
  run.until(RunPhase::kRunning);
  run.steps(50);
  RunServices& services = run.cycle().services();
  auto late = load_controller(kSways, {});
  ASSERT_TRUE(late) << late.error().to_string();
  const auto nothing = TomlDocument::parse("", "late.toml");
  ASSERT_TRUE(services.load("late", std::move(*late), *nothing, kNow));
  run.steps(50);
  const std::uint64_t before = run.cycle().next_cycle();
  ASSERT_TRUE(services.switch_controllers({"one"}, {"late"}, kNow));
  const ReplayResult result = replayed(run.finish());
  EXPECT_FALSE(result.equal());
  EXPECT_FALSE(result.first);
  EXPECT_EQ(result.compared, before);
  EXPECT_NE(result.why_short.find("was loaded while the run went on"), std::string::npos)
      << result.why_short;
}

TEST_F(Replay, EndsAtTheTimeThatIsAsked) {
  const ReplayResult result = replayed(recorded(), {.to_ns = 299'000'000});
  expect_equal(result, 300);
}

TEST(ReplayedOverrun, IsWhatThePolicyMadeOfIt) {
  rt::WallClock clock;
  rt::CyclicLoop holds({.on_overrun = rt::OverrunPolicy::kHold}, clock);
  rt::Tick tick = holds.wait();
  holds.skip(tick, 3);
  EXPECT_EQ(tick.cycle, 3U);
  EXPECT_EQ(tick.time_ns, 3'000'000);
  EXPECT_TRUE(tick.hold);
  EXPECT_FALSE(holds.wait().hold);
  rt::CyclicLoop stops({.on_overrun = rt::OverrunPolicy::kStop, .stop_late = 2, .stop_window = 3},
                       clock);
  const auto late = [&] {
    rt::Tick one = stops.wait();
    stops.skip(one, 1);
    return one.stop;
  };
  EXPECT_FALSE(late());
  (void)stops.wait();
  EXPECT_TRUE(late());  // two of the last three
  (void)stops.wait();
  (void)stops.wait();
  EXPECT_FALSE(late());
}

TEST_F(Replay, RefusesWhatItCannotPlay) {
  const std::string log = recorded();
  const auto error = [](const std::string& path, const ReplayOptions& options) {
    const auto result = replay(path, options);
    return result ? std::string() : result.error().front().to_string();
  };
  EXPECT_NE(error(log, {.plugins = {{"ones", kSways}}}).find("had no controller 'ones'"),
            std::string::npos);
  EXPECT_NE(error(log, {.plugins = {{"one", "nowhere.so"}}}).find("nowhere.so"), std::string::npos);
  EXPECT_NE(error(folder / "none.mcap", {}).find("none.mcap"), std::string::npos);
}

}  // namespace
}  // namespace tandem::runtime
