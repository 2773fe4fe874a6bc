// Whole runs through the whole chain: cycle, controller, limits, drive master, frames, firmware,
// plant and log, of a robot with one joint. Linked with the real-time trap; the preset rtsan
// checks the same runs.
#include "log/log_file.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/played_clock.hpp"
#include "tests/runtime/swing_loop.hpp"

namespace tandem::runtime {
namespace {

using test::Sine;

constexpr std::uint64_t kRunning = 600;

/// The swing, moved on a sine for 0.6 s.
struct SimRun : test::SwingLoop {
  explicit SimRun(std::uint64_t seed = 1, double rate = 0.0, log::Recorder* its_recorder = nullptr,
                  bool start_paused = false) {
    recorder = its_recorder;
    add_sine({0}, "sine", true, "amplitude_rad = 0.1");
    begin({.loop = {.rate = rate, .start_paused = start_paused}, .running_cycles = kRunning},
          {.posture = "up", .release_ns = 100'000'000, .seed = seed});
  }
};

TEST(SimRun, BringsTheDriveUpFollowsAndShutsDown) {
  SimRun run;
  run.cycle->run();
  EXPECT_TRUE(run.cycle->faults().empty()) << run.cycle->faults()[0].text;
  EXPECT_EQ(run.cycle->running_cycles(), kRunning);
  const TrackingError error = run.cycle->statistics().tracking()[0];
  EXPECT_GT(error.max_rad, 0.0);
  EXPECT_LT(error.max_rad, 0.05);  // of a sine of 0.1 rad
  EXPECT_LE(error.rms_rad, error.max_rad);
}

/// State, command and truth of the next `count` cycles.
std::vector<std::byte> bytes_of(SimRun& run, int count) {
  std::vector<std::byte> all;
  for (int i = 0; i < count; ++i) {
    run.cycle->step();
    for (const auto bytes :
         {run.cycle->state().bytes(), run.cycle->command().bytes(), run.backend->truth().bytes()}) {
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
  }
  return all;
}

TEST(SimRun, RepeatsItsBytesAfterARestoreAtAnyPhase) {
  SimRun run;
  for (const RunPhase phase : {RunPhase::kBringUp, RunPhase::kRunning}) {
    run.run_to(phase);
    for (int i = 0; i < 37; ++i) EXPECT_TRUE(run.cycle->step());
    const auto snapshot = run.cycle->save();
    ASSERT_TRUE(snapshot) << snapshot.error().to_string();
    const auto first = bytes_of(run, 300);
    ASSERT_TRUE(run.cycle->restore(*snapshot));
    EXPECT_TRUE(bytes_of(run, 300) == first) << to_string(phase);
  }
}

TEST(SimRun, RepeatsItsBytesAfterARestoreBetweenTheHalvesOfACycle) {
  SimRun run;
  for (const RunPhase phase : {RunPhase::kBringUp, RunPhase::kRunning}) {
    run.run_to(phase);
    for (int i = 0; i < 37; ++i) EXPECT_TRUE(run.cycle->step());
    ASSERT_TRUE(run.cycle->begin());
    const auto snapshot = run.cycle->save();
    ASSERT_TRUE(snapshot) << snapshot.error().to_string();
    EXPECT_TRUE(run.cycle->finish());
    const auto first = bytes_of(run, 300);
    ASSERT_TRUE(run.cycle->begin());  // it is restored where it was taken: between halves
    ASSERT_TRUE(run.cycle->restore(*snapshot));
    EXPECT_TRUE(run.cycle->finish());
    EXPECT_TRUE(bytes_of(run, 300) == first) << to_string(phase);
  }
}

TEST(SimRun, GoesOnFromASnapshotInAFreshRobot) {
  SimRun one;
  one.run_to(RunPhase::kRunning);
  const auto snapshot = one.cycle->save();
  ASSERT_TRUE(snapshot);
  SimRun other(99);  // even its noise goes on as the snapshot's
  ASSERT_TRUE(other.cycle->restore(*snapshot));
  EXPECT_TRUE(bytes_of(one, 200) == bytes_of(other, 200));
}

std::string hash_of_run(const std::string& path, std::uint64_t seed, double rate) {
  auto recorder = log::Recorder::open(path, {.joints = {"swing"}}, {});
  EXPECT_TRUE(recorder);
  SimRun run(seed, rate, recorder->get());
  run.cycle->run();
  const log::RecordingResult result = (*recorder)->close();
  EXPECT_EQ(result.dropped, 0U);
  EXPECT_EQ(result.data_sha256, log::LogFile::open(path)->data_sha256());
  return result.data_sha256;
}

TEST(SimRun, LogsTheSameDataForTheSameSeedWhateverTheRate) {
  const log::ScratchFolder folder;
  const std::string first = hash_of_run(folder / "1.mcap", 7, 0.0);
  EXPECT_EQ(hash_of_run(folder / "2.mcap", 7, 0.0), first);
  EXPECT_EQ(hash_of_run(folder / "3.mcap", 7, 5.0), first);
  EXPECT_NE(hash_of_run(folder / "4.mcap", 8, 0.0), first);
}

/// Played at random, with standing at the start and some cycles a hundred times slower than real
/// time.
TEST(SimRun, LogsTheSameDataHoweverItsClockIsPlayed) {
  const log::ScratchFolder folder;
  const std::string free = hash_of_run(folder / "free.mcap", 7, 0.0);
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const std::string path = folder / ("played" + std::to_string(seed) + ".mcap");
    auto recorder = log::Recorder::open(path, {.joints = {"swing"}}, {});
    ASSERT_TRUE(recorder);
    SimRun run(7, 1.0, recorder->get(), true);
    EXPECT_GE(test::run_with_played_clock(*run.cycle, seed), 6);
    EXPECT_EQ((*recorder)->close().data_sha256, free) << seed;
    EXPECT_EQ(run.cycle->running_cycles(), kRunning);
  }
}

TEST(SimRun, EndsInAFaultThatNamesTheJointWhenTheCableIsCut) {
  SimRun run;
  run.run_to(RunPhase::kRunning);
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(run.cycle->step());
  run.backend->robot().bus(0).set_connected(false);
  run.cycle->run();
  const auto faults = run.cycle->faults();
  ASSERT_FALSE(faults.empty());
  EXPECT_LT(run.cycle->running_cycles(), 250U);
  bool named = false;
  for (const FaultReport& fault : faults) {
    named = named || fault.joint == "swing" || fault.text.find("swing") != std::string::npos;
  }
  EXPECT_TRUE(named) << faults[0].text;
}

}  // namespace
}  // namespace tandem::runtime
