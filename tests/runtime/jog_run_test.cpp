// config/double_pendulum/jog.toml: a joint that follows an input from a timeline, through the whole
// chain.
#include <algorithm>
#include <cmath>
#include <fstream>

#include "log/log_file.hpp"
#include "tests/runtime/bundled_run.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::runtime {
namespace {

struct JogRun : testing::Test {
  /// Where the lower joint is after each tenth of a second, and its reference.
  struct Path {
    std::vector<double> rad, reference_rad;
  };
  static Path path(BundledRun& jog) {
    Path path;
    jog.run_to(RunPhase::kRunning);
    for (int tenth = 0; tenth < 48; ++tenth) {
      jog.steps(100);
      path.rad.push_back(jog.run->state().position_rad()[1]);
      path.reference_rad.push_back(jog.run->command().position_rad()[1]);
    }
    return path;
  }
  /// The lower joint's timeline as another one.
  static Overrides with(std::vector<std::vector<double>> rows) {
    return {.change = [rows = std::move(rows)](Experiment& e) {
      e.controllers.front().inputs.front().timeline = rows;
    }};
  }
};

TEST_F(JogRun, MovesTimesOutHoldsAndGoesBack) {
  BundledRun jog("double_pendulum", "jog");
  const auto [rad, reference] = path(jog);
  EXPECT_EQ(reference[3], reference[2]) << "nothing is told yet";
  // 0.4 rad/s for 1.001 s, and back; then the drive settles what gravity pulls.
  EXPECT_NEAR(reference[20] - reference[3], 0.4004, 1e-6);
  EXPECT_NEAR(rad[20] - rad[3], 0.4, 0.01);
  EXPECT_NEAR(rad[9] - rad[8], 0.04, 0.004);
  EXPECT_EQ(reference[28], reference[20]) << "it holds after its time-out";
  EXPECT_NEAR(reference.back(), reference[3], 1e-6);
  EXPECT_NEAR(rad.back(), rad[3], 0.01);
  const auto inputs = jog.cycle->services().inputs();
  ASSERT_EQ(inputs.size(), 1U);
  EXPECT_EQ(inputs[0].look.counts.arrived, 2U);
  EXPECT_EQ(inputs[0].look.counts.timed_out, 2U);
}

TEST_F(JogRun, IsTheSameToTheLastBitAgainAndFromASnapshot) {
  BundledRun one("double_pendulum", "jog"), other("double_pendulum", "jog");
  one.run_to(RunPhase::kRunning);
  other.run_to(RunPhase::kRunning);
  EXPECT_EQ(one.bytes(400), other.bytes(400));
  const auto saved = one.cycle->save();
  ASSERT_TRUE(saved);
  const auto first = one.bytes(1500);
  ASSERT_TRUE(one.cycle->restore(*saved));
  EXPECT_EQ(one.bytes(1500), first);
  EXPECT_EQ(other.bytes(1500), first);
}

/// What the replay of a log is for: its samples instead of the timeline.
TEST_F(JogRun, ALogOfItFeedsItAgain) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "jog.mcap";
  std::vector<std::byte> first;
  {
    auto recorder = log::Recorder::open(path, {.joints = {"joint1", "joint2"}}, {});
    ASSERT_TRUE(recorder) << recorder.error().to_string();
    BundledRun jog("double_pendulum", "jog", {}, {.recorder = recorder->get()});
    jog.run_to(RunPhase::kRunning);
    first = jog.bytes(3600);
    (void)(*recorder)->close();
  }
  BundledRun again("double_pendulum", "jog", {.change = [&](Experiment& e) {
                     InputSource& source = e.controllers.front().inputs.front();
                     source.feeder = InputFeeder::kFile;
                     source.file = path;
                     source.timeline.clear();
                   }});
  again.run_to(RunPhase::kRunning);
  EXPECT_EQ(again.bytes(3600), first);
}

/// It would pass the limit with 2.4 rad/s: it comes to rest there instead.
TEST_F(JogRun, BrakesBeforeALimitOfItsPosition) {
  std::vector<std::vector<double>> rows;
  for (int i = 0; i < 10; ++i) rows.push_back({0.1 + 0.4 * i, 2.4});
  BundledRun jog("double_pendulum", "jog", with(rows));
  jog.run_to(RunPhase::kRunning);
  jog.steps(4000);
  const double limit = jog.experiment->robot.joints[1].max_position_rad;
  EXPECT_LT(jog.run->command().position_rad()[1], limit + 1e-9);
  EXPECT_NEAR(jog.run->command().position_rad()[1], limit, 1e-3);
  EXPECT_EQ(jog.cycle->faults().size(), 0U);
}

/// The largest step of a reference is that of its speed: nothing jumps where one trajectory
/// replaces another.
TEST_F(JogRun, ATrajectoryReplacesAnotherFromTheReference) {
  BundledRun follow("double_pendulum", "follow");
  follow.run_to(RunPhase::kRunning);
  const auto reference = [&](std::size_t joint) {
    return follow.run->command().position_rad()[joint];
  };
  double before = reference(0), largest = 0.0;
  std::vector<double> seconds;
  for (int i = 1; i <= 4500; ++i) {
    follow.steps(1);
    largest = std::max(largest, std::abs(reference(0) - before));
    before = reference(0);
    if (i % 500 == 0) seconds.push_back(before);
  }
  EXPECT_NEAR(seconds[0], 0.5, 0.02) << "0.5 s: it stands";
  EXPECT_NEAR(seconds[2], 0.7, 2e-3) << "1.5 s: the first way-point";
  EXPECT_GT(seconds[3], 0.75) << "2 s: on the way to the second";
  EXPECT_LT(seconds[3], 0.9);
  EXPECT_NEAR(seconds[6], 0.5, 1e-3) << "3.5 s: the end of the second trajectory";
  EXPECT_NEAR(seconds.back(), 0.5, 1e-6);
  EXPECT_LT(largest, 0.6e-3) << "rad a millisecond";
  EXPECT_NEAR(follow.run->state().position_rad()[0], 0.5, 0.05);
  EXPECT_EQ(follow.cycle->faults().size(), 0U);
}

/// The warnings of a run with this timeline.
std::string warned(const Overrides& overrides) {
  Composition c;
  EXPECT_TRUE(compose(c, TANDEM_SOURCE_DIR "/config/double_pendulum/jog.toml", overrides).empty());
  std::string all;
  for (const Error& warning : c.warnings) all += warning.to_string() + "\n";
  return all;
}

// Nothing was said of either.
TEST_F(JogRun, ATimelineWithoutRowsOrWithRowsAfterTheEndIsWarnedOf) {
  EXPECT_EQ(warned(with({{0.5, 0.4}, {5.0, 0.0}})), "");
  const std::string empty = warned(with({}));
  for (const char* part : {"jog.toml:", "the timeline of the input 'rate' has no row"})
    EXPECT_NE(empty.find(part), std::string::npos) << empty;
  const std::string late = warned(with({{0.5, 0.4}, {6.0, 0.0}, {8.5, 0.1}}));
  for (const char* part :
       {"jog.toml:", "row 2 of the timeline of the input 'rate' arrives 6 s after", "and 1 more",
        "the run ends after 5 s", "duration_s = 8.5"})
    EXPECT_NE(late.find(part), std::string::npos) << late;
  Overrides asked = with({{0.5, 0.4}, {6.0, 0.0}});
  asked.duration_s = 2.0;
  EXPECT_EQ(warned(asked), "") << "who says how long knows it";
}

TEST_F(JogRun, ARowOfAFileAfterTheEndIsWarnedOfAtItsLine) {
  const test::ScratchFolder folder;
  const std::string file = folder / "rates.csv";
  std::ofstream(file) << "time_s,joint2\n0.5,0.4\n60,0\n";
  const std::string late = warned({.change = [&](Experiment& e) {
    InputSource& source = e.controllers.front().inputs.front();
    source.feeder = InputFeeder::kFile;
    source.file = file;
    source.timeline.clear();
  }});
  EXPECT_NE(late.find("rates.csv:3: this row of the input 'rate' arrives 60 s after"),
            std::string::npos)
      << late;
}

// Nothing was said of it.
TEST_F(JogRun, AFileWithoutRowsIsWarnedOf) {
  const test::ScratchFolder folder;
  const std::string file = folder / "rates.csv";
  std::ofstream(file) << "time_s,joint2\n";
  const std::string empty = warned({.change = [&](Experiment& e) {
    InputSource& source = e.controllers.front().inputs.front();
    source.feeder = InputFeeder::kFile;
    source.file = file;
    source.timeline.clear();
  }});
  for (const char* part : {"rates.csv: ", "the file of the input 'rate' has no row"})
    EXPECT_NE(empty.find(part), std::string::npos) << empty;
}

TEST_F(JogRun, ATimelineBeyondItsBoundsIsAnErrorWithItsPlace) {
  Composition c;
  const Diagnostics errors =
      compose(c, TANDEM_SOURCE_DIR "/config/double_pendulum/jog.toml", with({{0.5, 99.0}}));
  ASSERT_FALSE(errors.empty());
  const std::string text = errors.front().to_string();
  for (const char* part : {"jog.toml:", "row 1", "joint2", "99", "2.5"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace tandem::runtime
