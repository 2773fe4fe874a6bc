// Which files of a log stay: by age, on a nearly full disk, before a fault, after a new start, and
// when the process is killed while one file follows another.
#include "log/kept_files.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <iterator>

#include "log/log_file.hpp"
#include "log/log_parts.hpp"
#include "log/recorder.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// A minute of log time in each file, as far as the rules go.
class KeptFilesRules : public ::testing::Test {
 protected:
  /// One more file of `seconds`, with a stop `stop_s` after its beginning.
  void file(KeptFiles& files, std::int64_t seconds, std::int64_t stop_s = -1) {
    const std::string path = folder_ / ("a-001." + std::to_string(++number_) + ".mcap");
    std::ofstream(path) << std::string(1000, 'x');
    files.note(time_ns_);
    if (stop_s >= 0) files.note_stop(time_ns_ + stop_s * kSecond_ns);
    time_ns_ += seconds * kSecond_ns;
    files.note(time_ns_);
    files.end(path, 1000);
  }
  /// The numbers of those that are there.
  [[nodiscard]] std::vector<int> there() const {
    std::vector<int> all;
    for (int i = 1; i <= number_; ++i)
      if (fs::exists(folder_ / ("a-001." + std::to_string(i) + ".mcap"))) all.push_back(i);
    return all;
  }
  const ScratchFolder folder_;
  int number_ = 0;
  std::int64_t time_ns_ = 0;
};

TEST_F(KeptFilesRules, AFileGoesWhenItsEndIsSoMuchLogTimeAgo) {
  KeptFiles files({.total_ns = 150 * kSecond_ns});
  for (int i = 0; i < 5; ++i) file(files, 60);
  files.keep_totals(0);
  EXPECT_EQ(there(), (std::vector{3, 4, 5})) << "3 ended 120 s ago, 2 180 s";
  files.note(time_ns_);
  files.note(time_ns_ + 30 * kSecond_ns);  // the present file counts, too
  files.keep_totals(0);
  EXPECT_EQ(there(), (std::vector{4, 5}));
  EXPECT_EQ(files.removed(), 3U);
  EXPECT_EQ(files.ended_bytes(), 2000U);
}

TEST_F(KeptFilesRules, TheMinutesBeforeAFaultStayHoweverManyFilesCome) {
  KeptFiles files({.total_bytes = 3000,
                   .total_ns = 300 * kSecond_ns,
                   .keep_before_fault_ns = 100 * kSecond_ns});
  for (int i = 0; i < 3; ++i) file(files, 60);
  file(files, 60, 10);  // 90 s of what was before are in files 2 and 3
  for (int i = 0; i < 40; ++i) {
    file(files, 60);
    files.keep_totals(0);
  }
  EXPECT_EQ(there(), (std::vector{2, 3, 4, 42, 43, 44}));
}

TEST_F(KeptFilesRules, WhatFollowsAFaultAtOnceStays) {
  KeptFiles files({.total_bytes = 1000, .keep_before_fault_ns = kSecond_ns});
  file(files, 60, 59);  // the robot still brakes in the next file
  for (int i = 0; i < 5; ++i) file(files, 60);
  files.keep_totals(0);
  EXPECT_EQ(there(), (std::vector{1, 2, 6}));
}

TEST_F(KeptFilesRules, WithoutThatKeyAFaultKeepsNothing) {
  KeptFiles files({.total_bytes = 1000});
  file(files, 60, 30);
  file(files, 60);
  files.keep_totals(0);
  EXPECT_EQ(there(), std::vector{2});
}

/// A disk of 100,000 bytes, on which each file that goes gives back its own.
TEST_F(KeptFilesRules, OnANearlyFullDiskTheOldestGoButThoseOfAFault) {
  KeptFiles files(
      {.total_bytes = 1'000'000, .keep_free_share = 0.05, .keep_before_fault_ns = kSecond_ns});
  file(files, 60, 30);
  for (int i = 0; i < 3; ++i) file(files, 60);
  std::uint64_t others = 92'500;
  const auto room = [&]() -> std::optional<DiskRoom> {
    return DiskRoom{100'000 - others - 1000 * there().size(), 100'000};
  };
  EXPECT_TRUE(files.keep_free(room));  // 3,500 bytes are free: two files go
  EXPECT_EQ(there(), (std::vector{1, 4}));
  others = 97'000;
  EXPECT_FALSE(files.keep_free(room)) << "the file of the fault is not for sale";
  EXPECT_EQ(there(), std::vector{1});
  EXPECT_TRUE(files.keep_free([] { return std::optional<DiskRoom>(); })) << "a disk that is silent";
  KeptFiles none({.keep_free_bytes = 1});
  file(none, 60);
  EXPECT_FALSE(none.keep_free([] {
    return std::optional(DiskRoom{0, 100});
  })) << "nothing says that files may go";
  EXPECT_EQ(there(), (std::vector{1, 5}));
}

TEST(KeptFiles, KnowsTheRunOfAFile) {
  EXPECT_EQ(run_number("arm-hold-012.mcap", "arm-hold"), 12U);
  EXPECT_EQ(run_number("arm-hold-012.3.mcap", "arm-hold"), 12U);
  for (const char* none : {"arm-hold-.mcap", "arm-hold-12", "arm-hold-x.mcap", "arm-hold-12mcap",
                           "arm-12.mcap", "arm-hold-1-2.mcap", "arm-hold--1.mcap"})
    EXPECT_EQ(run_number(none, "arm-hold"), 0U) << none;
}

// --- whole recordings ---

constexpr std::int64_t kMillisecond_ns = 1'000'000;

RecorderOptions by_time(std::int64_t file_s, std::int64_t total_s) {
  RecorderOptions options;
  options.ring_slots = 256;
  options.limits.file_ns = file_s * kSecond_ns;
  options.limits.total_ns = total_s * kSecond_ns;
  options.limits.keep_before_fault_ns = 3 * kSecond_ns;
  return options;
}

struct Recording {
  std::unique_ptr<Recorder> recorder;
  Recorder::Channel states = 0;
  hal::StateImage state{{.joints = 3, .sensor_channels = {}}};
  std::uint64_t cycle = 0;

  /// @param earlier  whether it counts what is in the folder
  Recording(const std::string& folder, int run, RecorderOptions options, bool earlier) {
    options.earlier.emplace(options.limits);
    if (earlier) options.earlier->take_over(folder, "a");
    auto opened = Recorder::open(
        folder + "/a-00" + std::to_string(run) + ".mcap",
        {.robot = "a", .joints = {"x", "y", "z"}, .period_ns = kMillisecond_ns}, options);
    EXPECT_TRUE(opened) << opened.error().to_string();
    recorder = std::move(*opened);
    states = recorder->add_channel("/tandem/state", "tandem/msg/State", state.layout());
    recorder->start();
  }
  void go_on(std::uint64_t cycles) {
    for (const std::uint64_t end = cycle + cycles; cycle < end; ++cycle) {
      const auto time_ns = static_cast<std::int64_t>(cycle) * kMillisecond_ns;
      state.cycle()[0] = cycle;
      state.time_ns()[0] = time_ns;
      recorder->wait_for_space(2);
      recorder->push(states, time_ns, state.bytes());
    }
  }
  void stop() {
    recorder->wait_for_space(1);
    recorder->push(Event{.cycle = cycle,
                         .time_ns = static_cast<std::int64_t>(cycle) * kMillisecond_ns,
                         .kind = EventKind::kFault});
  }
};

/// [s] of all logs of the folder, each file by itself: how much, and whether it can be read.
double readable_s(const std::string& folder) {
  double seconds = 0.0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string path = entry.path().string();
    const auto log =
        LogFile::open(part_of(path) ? path : part_path(path, 1).insert(path.size() - 5, ".1"));
    if (!log) continue;  // killed before its first byte
    const auto* topic = log->find("/tandem/state");
    if (topic == nullptr || topic->messages == 0) continue;
    EXPECT_TRUE(log->damage().empty()) << log->damage().front();
    seconds += static_cast<double>(topic->last_ns - topic->first_ns) * 1e-9;
  }
  return seconds;
}

TEST(KeptFiles, FilesFollowEachOtherByLogTime) {
  const ScratchFolder folder;
  Recording run(folder.path(), 1, by_time(2, 6), false);
  run.go_on(30'000);
  const RecordingResult result = run.recorder->close();
  EXPECT_GE(result.parts, 14U);
  EXPECT_LE(result.parts, 18U);
  EXPECT_GT(result.removed, 8U);
  const auto log = LogFile::open(result.path);
  ASSERT_TRUE(log) << log.error().to_string();
  EXPECT_EQ(log->find("/tandem/state")->last_ns, 29'999 * kMillisecond_ns);
  EXPECT_GE(log->find("/tandem/state")->first_ns, 20'000 * kMillisecond_ns);
  EXPECT_LE(log->find("/tandem/state")->first_ns, 24'000 * kMillisecond_ns);
}

/// The service was started again: the old files count, by size and age, and faults stay known.
TEST(KeptFiles, ANewRunGoesOnWithTheSameBudget) {
  const ScratchFolder folder;
  RecordingResult first;
  {
    Recording run(folder.path(), 1, by_time(2, 8), true);
    run.go_on(12'000);
    run.stop();
    run.go_on(1'000);
    first = run.recorder->close();
  }
  const auto size = [&] { return std::distance(fs::directory_iterator(folder.path()), {}); };
  std::uint64_t earlier_removed = 0;
  for (int number = 2; number <= 6; ++number) {
    Recording run(folder.path(), number, by_time(2, 8), true);
    run.go_on(7'000);
    const RecordingResult result = run.recorder->close();
    EXPECT_EQ(result.failed, 0U) << result.error;
    earlier_removed += result.earlier_removed;
  }
  EXPECT_GT(earlier_removed, 5U);
  EXPECT_LE(size(), 12) << "six of the last 8 s, and those of the fault";
  const auto log = LogFile::open(first.path);
  ASSERT_TRUE(log) << "the fault's files are there: " << log.error().to_string();
  EXPECT_LE(log->find("/tandem/state")->first_ns, 9'000 * kMillisecond_ns);
  EXPECT_EQ(log->find("/tandem/state")->last_ns, 12'999 * kMillisecond_ns);
  const auto events = log->events();
  ASSERT_TRUE(events);
  ASSERT_EQ(events->size(), 1U);
  EXPECT_TRUE(is_stop(events->front().event));
}

/// Another run that still writes keeps its file; a run that does not count others leaves theirs.
TEST(KeptFiles, WhatIsStillWrittenAndWhatIsOfOthersStays) {
  const ScratchFolder folder;
  std::ofstream(folder / "a-009.mcap") << "no log";
  std::ofstream(folder / "b-001.mcap") << "another robot's";
  Recording writing(folder.path(), 1, by_time(1000, 2000), true);
  writing.go_on(100);
  Recording run(folder.path(), 2, by_time(1, 2), true);
  run.go_on(9'000);
  EXPECT_EQ(run.recorder->close().earlier_removed, 0U);
  Recording alone(folder.path(), 3, by_time(1, 2), false);
  alone.go_on(9'000);
  EXPECT_EQ(alone.recorder->close().earlier_removed, 0U);
  EXPECT_TRUE(fs::exists(folder / "a-009.mcap"));
  EXPECT_TRUE(fs::exists(folder / "b-001.mcap"));
  EXPECT_TRUE(fs::exists(folder / "a-001.mcap"));
  EXPECT_EQ(writing.recorder->close().failed, 0U);
}

/// kill -9 at any moment: every file can be read, and the next run still keeps to the limits.
TEST(KeptFiles, AKillWhileFilesFollowEachOtherLeavesReadableOnes) {
  const ScratchFolder folder;
  for (int number = 1; number <= 9; ++number) {
    int gone_on[2];
    ASSERT_EQ(::pipe(gone_on), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      Recording run(folder.path(), number, by_time(1, 5), true);
      for (;;) {
        run.go_on(200);
        if (::write(gone_on[1], "x", 1) != 1) ::_exit(1);
      }
    }
    ::close(gone_on[1]);
    char any = 0;  // after 4 to 7 s of log time, anywhere in a file
    for (int i = 0; i < 20 + 2 * number; ++i) EXPECT_EQ(::read(gone_on[0], &any, 1), 1);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ::close(gone_on[0]);
    EXPECT_GT(readable_s(folder.path()), 2.0) << number;
  }
  Recording last(folder.path(), 10, by_time(1, 5), true);
  last.go_on(6'000);
  EXPECT_EQ(last.recorder->close().failed, 0U);
  EXPECT_LE(readable_s(folder.path()), 9.0) << "of 5 s, and a file before and behind";
}

}  // namespace
}  // namespace tandem::log
