#include "log/recorder.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "log/log_file.hpp"
#include "log/schema.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

hal::StateImage image() { return hal::StateImage({.joints = 3, .sensor_channels = {6}}); }

RunInfo run_info() {
  return {.version = "test",
          .robot = "three",
          .hal = "sim",
          .joints = {"a", "b", "c"},
          .sensors = {{"foot", 6}},
          .seed = 42,
          .period_ns = 1'000'000,
          .engine = "mujoco 2.2.2",
          .integrator = "leapfrog, 250 us steps",
          .kernel_variant = "baseline",
          .description_hash = "00",
          .configuration = {{"robot.toml", "name = \"three\"\n"}}};
}

/// A state whose numbers depend on the cycle alone.
void fill(hal::StateImage& state, std::uint64_t cycle) {
  state.cycle()[0] = cycle;
  state.time_ns()[0] = static_cast<std::int64_t>(cycle) * 1'000'000;
  for (std::size_t j = 0; j < 3; ++j) {
    state.position_rad()[j] = 0.001 * static_cast<double>(cycle) + static_cast<double>(j);
  }
}

/// Records `cycles` states and an event in the middle; the RT part is under the trap.
RecordingResult record(const std::string& path, std::uint64_t cycles,
                       const RecorderOptions& options = {}) {
  auto recorder = Recorder::open(path, run_info(), options);
  EXPECT_TRUE(recorder) << recorder.error().to_string();
  hal::StateImage state = image();
  const auto channel =
      (*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
  (*recorder)->start();
  for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
    (*recorder)->wait_for_space(2);
    const rt::ScopedRealtime in_cycle;
    fill(state, cycle);
    (*recorder)->push(channel, state.time_ns()[0], state.bytes());
    if (cycle == cycles / 2) {
      (*recorder)->push(Event{.cycle = cycle,
                              .time_ns = state.time_ns()[0],
                              .code = 0x7310,
                              .joint = 1,
                              .kind = EventKind::kFault});
    }
  }
  return (*recorder)->close({{"wall_seconds", "1.5"}});
}

/// A recording of `cycles` states that goes on; its writer has taken them all.
std::unique_ptr<Recorder> recording(const std::string& path, std::uint64_t cycles) {
  auto recorder = Recorder::open(path, run_info(), {});
  EXPECT_TRUE(recorder) << recorder.error().to_string();
  hal::StateImage state = image();
  const auto channel =
      (*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
  (*recorder)->start();
  for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
    (*recorder)->wait_for_space(1);
    fill(state, cycle);
    (*recorder)->push(channel, state.time_ns()[0], state.bytes());
  }
  (*recorder)->wait_for_space(2048);
  return std::move(*recorder);
}

TEST(Recorder, WritesEveryCycleWithoutADropWhenTheLoopMayWait) {
  const ScratchFolder folder;
  const RecordingResult result = record(folder / "run.mcap", 20'000, {.ring_slots = 64});
  EXPECT_EQ(result.messages, 20'001U);
  EXPECT_EQ(result.dropped, 0U);
  EXPECT_EQ(result.failed, 0U);
  EXPECT_EQ(result.error, "");
  EXPECT_EQ(result.bytes, std::filesystem::file_size(folder / "run.mcap"));
}

TEST(Recorder, ReadsBackTheSameNumbersNamesAndHash) {
  const ScratchFolder folder;
  const RecordingResult result = record(folder / "run.mcap", 1000);
  const auto log = LogFile::open(folder / "run.mcap");
  ASSERT_TRUE(log) << log.error().to_string();
  EXPECT_FALSE(log->truncated());
  EXPECT_EQ(log->data_sha256(), result.data_sha256);
  EXPECT_EQ(value_of(log->result(), "data_sha256"), result.data_sha256);
  EXPECT_EQ(value_of(log->result(), "wall_seconds"), "1.5");
  EXPECT_EQ(log->info().joints, run_info().joints);
  EXPECT_EQ(log->info().sensors.at(0).channels, 6U);
  EXPECT_EQ(log->info().seed, 42U);
  EXPECT_EQ(log->info().engine, "mujoco 2.2.2");
  EXPECT_EQ(log->info().integrator, "leapfrog, 250 us steps");
  EXPECT_EQ(log->info().configuration, run_info().configuration);
  const auto table = log->read("/tandem/state", {{"position_rad", 2}, {"cycle", 0}});
  ASSERT_TRUE(table) << table.error().to_string();
  ASSERT_EQ(table->time_s.size(), 1000U);
  for (std::size_t i = 0; i < 1000; ++i) {
    ASSERT_EQ(table->columns[0][i], 0.001 * static_cast<double>(i) + 2.0);
    ASSERT_EQ(table->columns[1][i], static_cast<double>(i));
  }
  const auto events = log->events();
  ASSERT_TRUE(events);
  ASSERT_EQ(events->size(), 1U);
  EXPECT_EQ(events->at(0).text, "fault of b (0x7310)");
  EXPECT_EQ(events->at(0).event.cycle, 500U);
}

TEST(Recorder, HashesTheDataAndNothingElse) {
  const ScratchFolder folder;
  const RecordingResult one = record(folder / "one.mcap", 500);
  const RecordingResult other =
      record(folder / "other.mcap", 500,
             {.writer = {.compression = Compression::kZstd, .chunk_bytes = 3000}, .ring_slots = 8});
  const RecordingResult shorter = record(folder / "shorter.mcap", 499);
  EXPECT_EQ(one.data_sha256.size(), 64U);
  EXPECT_EQ(one.data_sha256, other.data_sha256);
  EXPECT_NE(one.data_sha256, shorter.data_sha256);
}

TEST(Recorder, DropsAndCountsWhenTheRingIsFull) {
  const ScratchFolder folder;
  auto recorder = Recorder::open(folder / "run.mcap", run_info(), {.ring_slots = 4});
  ASSERT_TRUE(recorder);
  (*recorder)->start();
  std::uint64_t pushed = 0;
  for (int i = 0; i < 200'000; ++i) {
    if ((*recorder)->push(Event{.time_ns = i})) ++pushed;
  }
  const RecordingResult result = (*recorder)->close();
  EXPECT_GT(result.dropped, 0U);
  EXPECT_EQ(result.dropped + pushed, 200'000U);
  EXPECT_EQ(result.messages, pushed);
}

/// Longer than a slot: an input's sample wrote beyond its slot, and over what is not the ring's.
TEST(Recorder, WritesMessagesOfEveryLength) {
  const ScratchFolder folder;
  auto recorder = Recorder::open(folder / "run.mcap", run_info(), {.ring_slots = 8});
  ASSERT_TRUE(recorder);
  std::vector<std::size_t> lengths;
  std::size_t wrong = 0;
  const auto channel = (*recorder)->add_late_channel(
      "/long", "tandem/msg/Long", "uint8[] bytes",
      [&](std::int64_t time_ns, std::span<const std::byte> body, Bytes& out) {
        lengths.push_back(body.size());
        for (std::size_t i = 0; i < body.size(); ++i)
          wrong +=
              body[i] == static_cast<std::byte>(i * 7 + static_cast<std::size_t>(time_ns)) ? 0 : 1;
        out.assign(8, std::byte{});
      });
  (*recorder)->start();
  constexpr std::size_t kSlot = Recorder::kLateSlotBytes;
  const std::vector<std::size_t> all{0,         1, kSlot, kSlot + 1, 2 * kSlot, 2 * kSlot + 1,
                                     5 * kSlot, 3};
  for (std::size_t round = 0; round < 50; ++round) {
    for (const std::size_t length : all) {
      (*recorder)->wait_for_space(8);
      std::vector<std::byte> body(length);
      for (std::size_t i = 0; i < length; ++i) body[i] = static_cast<std::byte>(i * 7 + round);
      ASSERT_TRUE((*recorder)->push(channel, static_cast<std::int64_t>(round), body));
    }
  }
  EXPECT_FALSE((*recorder)->push(channel, 50, std::vector<std::byte>(100 * kSlot)));
  const RecordingResult result = (*recorder)->close();
  EXPECT_EQ(result.dropped, 1U);
  ASSERT_EQ(lengths.size(), 50 * all.size());
  for (std::size_t i = 0; i < lengths.size(); ++i) ASSERT_EQ(lengths[i], all[i % all.size()]) << i;
  EXPECT_EQ(wrong, 0U);
}

TEST(Recorder, CountsWhatADiskThatFillsUpLoses) {
  const ScratchFolder folder;
  const pid_t child = fork();
  if (child == 0) {  // its own limit on a file's size stands for the full disk
    const rlimit limit{300'000, 300'000};
    setrlimit(RLIMIT_FSIZE, &limit);
    signal(SIGXFSZ, SIG_IGN);
    const RecordingResult result = record(folder / "run.mcap", 5000);
    const auto log = LogFile::open(folder / "run.mcap");
    const bool right = result.failed > 0 && !result.error.empty() && result.dropped == 0 && log &&
                       log->messages() == result.messages;
    _exit(right ? 0 : 1);
  }
  int status = 1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  const auto log = LogFile::open(folder / "run.mcap");
  ASSERT_TRUE(log) << log.error().to_string();
  EXPECT_TRUE(log->truncated());
  EXPECT_GT(log->messages(), 100U);
}

// Whoever emptied a log that was being written made a run without one end with status 0.
TEST(Recorder, CountsWhatIsLostWhenItsFileIsCut) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{200'000}}) {
    const ScratchFolder folder;
    const auto recorder = recording(folder / "run.mcap", 3000);
    std::filesystem::resize_file(folder / "run.mcap", size);
    const RecordingResult result = recorder->close();
    EXPECT_NE(result.error.find("its file was cut to " + std::to_string(size) + " bytes"),
              std::string::npos)
        << result.error;
    EXPECT_EQ(result.messages + result.failed, 3000U);
    const auto log = LogFile::open(folder / "run.mcap");
    if (size == 0) {
      EXPECT_EQ(result.failed, 3000U);
      continue;
    }
    ASSERT_TRUE(log) << log.error().to_string();
    EXPECT_EQ(log->messages(), result.messages);
    EXPECT_GT(result.messages, 100U);
  }
}

// It said what the run had begun with.
TEST(Recorder, ABranchHasTheParametersAndControllersOfItsBegin) {
  const ScratchFolder folder;
  const std::string path = folder / "run.mcap";
  RunInfo info = run_info();
  info.parameters = {"squat.depth = 1"};
  auto recorder = Recorder::open(path, info, {});
  ASSERT_TRUE(recorder);
  std::string depth = "2";
  (*recorder)->name_beginnings([&] {
    return Recorder::Beginning{.parameters = {"squat.depth = " + depth}, .active = {"rest"}};
  });
  (*recorder)->start();
  (*recorder)->branch({.cycle = 3});
  depth = "5";
  (*recorder)->branch({.cycle = 1});
  EXPECT_EQ((*recorder)->close().branches, 3U);
  const auto parameters = [&](const char* file) {
    const auto log = LogFile::open(folder / file);
    return log ? log->info().parameters : std::vector{log.error().to_string()};
  };
  EXPECT_EQ(parameters("run.mcap"), std::vector<std::string>{"squat.depth = 1"});
  EXPECT_EQ(parameters("run.branch-2.mcap"), std::vector<std::string>{"squat.depth = 2"});
  EXPECT_EQ(parameters("run.branch-3.mcap"), std::vector<std::string>{"squat.depth = 5"});
  const auto branch = LogFile::open(folder / "run.branch-2.mcap");
  ASSERT_TRUE(branch);
  EXPECT_EQ(branch->info().active, std::vector<std::string>{"rest"});
}

TEST(Recorder, LeavesAReadableFileWhenItIsKilled) {
  const ScratchFolder folder;
  int pipes[2];
  ASSERT_EQ(pipe(pipes), 0);
  const pid_t child = fork();
  if (child == 0) {
    const auto recorder = recording(folder / "run.mcap", 3000);
    (void)!::write(pipes[1], "x", 1);
    pause();
  }
  char ready = 0;
  ASSERT_EQ(read(pipes[0], &ready, 1), 1);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  const auto log = LogFile::open(folder / "run.mcap");
  ASSERT_TRUE(log) << log.error().to_string();
  EXPECT_TRUE(log->truncated());
  EXPECT_GE(log->messages(), 2800U);  // all but the last 200 ms
  EXPECT_EQ(log->info().robot, "three");
}

}  // namespace
}  // namespace tandem::log
