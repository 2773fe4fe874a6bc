// A robot and one beside it that gets the same: equal to the last bit, or late alone.
#include <nlohmann/json.hpp>

#include "log/log_file.hpp"
#include "tests/internal_model/swing_run.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/lockstep.hpp"

namespace tandem::internal_model {
namespace {

using runtime::RunPhase;
using test::RunOptions;
using test::SwingRun;

void expect_same(const Differences& differences) {
  EXPECT_EQ(differences.unequal(), 0U) << "first in cycle " << differences.first_unequal();
  for (const JointDifference& joint : differences.joints()) {
    EXPECT_EQ(joint.position_rad.max, 0.0);
    EXPECT_EQ(joint.velocity_rad_s.max, 0.0);
    EXPECT_EQ(joint.torque_Nm.max, 0.0);
  }
  for (const SignalDifference& channel : differences.channels()) EXPECT_EQ(channel.max, 0.0);
}

TEST(ParallelRobot, IsItsExactTwinToTheLastBitFromPowerOnToShutDown) {
  SwingRun run;
  run.cycle->run();
  const ParallelResult result = run.beside->finish();
  EXPECT_EQ(result.cycles, run.cycle->loop().cycles);
  EXPECT_EQ(result.missed, 0U);
  EXPECT_LE(result.most_behind, DuplicatingBackend::kMostBehind + 1);
  EXPECT_EQ(result.fault, "");
  EXPECT_EQ(run.beside->differences().compared(), result.cycles);
  EXPECT_GT(run.beside->differences().cycles(), 599U);
  expect_same(run.beside->differences());
}

TEST(Differences, OfBasesAreADistanceAndAnAngle) {
  Differences differences(hal::ImageShape{});
  EXPECT_EQ(differences.base_position_m(), nullptr);
  const double half = 0.05;  // rad, about y; both turned by another rotation before
  const std::array<double, 7> a{0.0, 0.0, 0.5, 0.6, 0.0, 0.0, 0.8};
  const std::array<double, 7> b{0.03,
                                0.04,
                                0.5,
                                0.6 * std::cos(half),
                                0.8 * std::sin(half),
                                0.6 * std::sin(half),
                                0.8 * std::cos(half)};
  differences.take_base(a, a);
  EXPECT_EQ(differences.base_angle_rad()->max, 0.0);
  differences.take_base(a, b);
  EXPECT_NEAR(differences.base_position_m()->max, 0.05, 1e-12);
  EXPECT_NEAR(differences.base_angle_rad()->max, 2.0 * half, 1e-12);
}

/// Calls that a loop makes before and after write(), and parameters.
TEST(ParallelRobot, GetsStopsResetsAndGainsAsTheFirstDoes) {
  SwingRun run;
  run.run_to(RunPhase::kRunning);
  run.steps(50);
  run.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  run.steps(300);
  ASSERT_EQ(run.cycle->phase(), RunPhase::kFaulted);
  run.host->gains().set_gains(0, hal::PidLoop::kPosition, {.kp = 500.0, .ki = 200.0, .kd = 20.0});
  run.cycle->inbox().reset_faults();
  run.steps(600);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kHeld);
  const std::uint64_t cycles = run.cycle->loop().cycles;
  EXPECT_EQ(run.beside->finish().cycles, cycles);
  expect_same(run.beside->differences());
}

TEST(ParallelRobot, IsHomedWithTheFirst) {
  SwingRun run({.homing = hal::HomingConfig{.method = 17,
                                            .speed_rad_s = 1.5,
                                            .zero_speed_rad_s = 0.1,
                                            .acceleration_rad_s2 = 5.0,
                                            .position_rad = -2.995,
                                            .timeout_s = 10.0,
                                            .required = true,
                                            .at_start = true}});
  for (int i = 0; i < 6000 && run.cycle->phase() != RunPhase::kRunning; ++i) run.cycle->step();
  ASSERT_EQ(run.first->homing(0).state, hal::HomingState::kHomed) << run.first->status_text();
  run.steps(100);
  const std::uint64_t cycles = run.cycle->loop().cycles;
  EXPECT_EQ(run.beside->finish().cycles, cycles);
  EXPECT_EQ(run.second->homing(0).state, hal::HomingState::kHomed);
  expect_same(run.beside->differences());
}

TEST(ParallelRobot, OfOtherGainsDiffersAndTheFirstIsNotChanged) {
  SwingRun alone({.beside = false});
  SwingRun run({.kp = 300.0});
  for (int i = 0; i < 900; ++i) {
    alone.cycle->step();
    run.cycle->step();
    ASSERT_TRUE(std::ranges::equal(alone.cycle->state().bytes(), run.cycle->state().bytes())) << i;
  }
  (void)run.beside->finish();
  const Differences& differences = run.beside->differences();
  EXPECT_GT(differences.joints()[0].position_rad.max, 1e-4);
  EXPECT_LT(differences.joints()[0].position_rad.max, 0.5);
  EXPECT_GE(differences.joints()[0].torque_Nm.max,
            differences.rms(differences.joints()[0].torque_Nm));
  EXPECT_GT(differences.unequal(), 100U);
  EXPECT_GE(differences.first_unequal(), 0);
}

TEST(ParallelRobot, BesideARobotOnAWireIsTheSameToTheLastBit) {
  const hal::RobotConfig robot = tandem::test::swing_robot();
  const sim::SimRobotConfig sim{.posture = "up", .release_ns = 100'000'000};
  runtime::test::LockstepRobot wire(robot, tandem::test::swing_kernels(2), sim);
  auto second = sim::SimRobot::create(robot, tandem::test::swing_kernels(2), sim);
  ASSERT_TRUE(second);
  runtime::test::LoopRun run(robot, tandem::test::swing_kernels(2));
  run.add_sine({0}, "sine", true, "amplitude_rad = 0.1");
  ParallelRobot beside({*wire.backend, **second}, robot.shape(), run.host->gains(),
                       test::kPeriod_ns);
  beside.start();
  run.begin(beside.backend(), {.running_cycles = 600});
  run.cycle->run();
  EXPECT_EQ(beside.finish().cycles, run.cycle->loop().cycles);
  EXPECT_GT(beside.differences().cycles(), 599U);
  expect_same(beside.differences());
}

std::string logged(const std::string& path, std::chrono::microseconds slow) {
  auto recorder = log::Recorder::open(path, {.joints = {"swing"}}, {});
  EXPECT_TRUE(recorder);
  SwingRun run({.cycles = 300, .kp = 300.0, .slow = slow, .recorder = recorder->get()});
  run.cycle->run();
  (void)run.beside->finish();
  const log::RecordingResult result = (*recorder)->close();
  EXPECT_EQ(result.dropped, 0U);
  return result.data_sha256;
}

TEST(ParallelRobot, IsLoggedInAnOrderThatDoesNotDependOnThreads) {
  const log::ScratchFolder folder;
  const std::string first = logged(folder / "1.mcap", {});
  EXPECT_EQ(logged(folder / "2.mcap", {}), first);
  EXPECT_EQ(logged(folder / "3.mcap", std::chrono::microseconds(300)), first);
  const auto file = log::LogFile::open(folder / "3.mcap");
  ASSERT_TRUE(file);
  const auto one = file->read("/tandem/state", {{"position_rad", 0}});
  const auto other = file->read("/tandem/parallel/state", {{"position_rad", 0}});
  const auto truth = file->read("/tandem/parallel/truth", {{"position_rad", 0}});
  ASSERT_TRUE(one && other && truth);
  EXPECT_EQ(one->time_s, other->time_s);
  EXPECT_EQ(one->time_s, truth->time_s);
  EXPECT_NE(one->columns, other->columns);
}

/// On a clock, with a second robot that is far too slow: the loop waits for nobody.
TEST(ParallelRobot, ThatIsLateIsLateAlone) {
  SwingRun run(
      {.cycles = 300, .pace = hal::Pace::kWallClock, .slow = std::chrono::milliseconds(1)});
  run.run_to(RunPhase::kRunning);
  run.steps(300);
  const std::uint64_t cycles = run.cycle->loop().cycles;
  const hal::ParallelView* view = nullptr;
  hal::ParallelSource& shown = run.beside->shown_to(ParallelReader::kDds);
  while ((view = shown.newest()) == nullptr) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_NE(view, nullptr);
  EXPECT_GT(view->behind_cycles, 10U);
  ASSERT_TRUE(view->truth);
  EXPECT_EQ(view->truth->time_ns()[0], view->state.time_ns()[0]) << "of one cycle";
  EXPECT_EQ(run.cycle->faults().size(), 0U);
  EXPECT_GT(cycles, 300U);
}

/// Two readers at once, each on a thread of its own, beside the second robot's.
TEST(ParallelRobot, IsShownWholeToEachOfItsReaders) {
  SwingRun run({.cycles = 3000});
  std::atomic<bool> over{false};
  struct Seen {
    std::size_t views = 0, torn = 0, backwards = 0;
    std::uint64_t last = 0;
  };
  const auto look = [&](ParallelReader reader, Seen& seen) {
    hal::ParallelSource& shown = run.beside->shown_to(reader);
    for (bool last = false; !last;) {
      last = over.load();  // and look once more
      const hal::ParallelView* view = shown.newest();
      if (view == nullptr) continue;
      const std::uint64_t cycle = view->state.cycle()[0];
      ++seen.views;
      if (view->truth->time_ns()[0] != view->state.time_ns()[0]) ++seen.torn;
      if (cycle < seen.last) ++seen.backwards;
      seen.last = cycle;
    }
  };
  std::array<Seen, 2> seen;
  std::thread dds([&] { look(ParallelReader::kDds, seen[0]); });
  std::thread studio([&] { look(ParallelReader::kStudio, seen[1]); });
  run.cycle->run();
  const ParallelResult result = run.beside->finish();
  over = true;
  dds.join();
  studio.join();
  for (const Seen& one : seen) {
    EXPECT_GT(one.views, 1U);
    EXPECT_EQ(one.torn, 0U) << "state and truth are of one cycle";
    EXPECT_EQ(one.backwards, 0U);
    EXPECT_EQ(one.last, run.cycle->loop().cycles - 1) << "the last of all";
  }
  EXPECT_EQ(result.missed, 0U);
}

/// Cycles that found no place on the tape: the second robot makes them up with its last command,
/// and the first has not noticed.
TEST(ParallelRobot, MakesUpWhatItMissed) {
  SwingRun run(
      {.cycles = 1500, .pace = hal::Pace::kWallClock, .slow = std::chrono::milliseconds(1)});
  for (int i = 0; i < 1400; ++i) {  // faster than the second robot's 1 ms
    ASSERT_TRUE(run.cycle->step());
  }
  const std::uint64_t made = run.cycle->loop().cycles;
  hal::ParallelSource& shown = run.beside->shown_to(ParallelReader::kStudio);
  while (shown.newest() == nullptr || shown.newest()->behind_cycles > 400) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));  // there is a place again
  }
  run.steps(1);
  const ParallelResult result = run.beside->finish();
  EXPECT_GT(result.missed, 400U);
  EXPECT_EQ(result.cycles + result.missed, made + 1) << "each is played, or made up";
  EXPECT_EQ(run.second->truth().time_ns()[0], run.first->truth().time_ns()[0])
      << "it is where the first is in time";
  EXPECT_EQ(result.fault, "");
  EXPECT_EQ(run.cycle->faults().size(), 0U);
  EXPECT_LT(std::abs(run.second->truth().position_rad()[0] - run.first->truth().position_rad()[0]),
            0.25)
      << "its command was old, not none";
}

}  // namespace
}  // namespace tandem::internal_model
