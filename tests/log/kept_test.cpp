// What a recording keeps: decimated topics, fields, several files, and room on the disk.
#include <sys/statvfs.h>

#include "hal/truth.hpp"
#include "log/compare.hpp"
#include "log/log_file.hpp"
#include "log/recorder.hpp"
#include "log/schema.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kKeptCycle_ns = 1'000'000;

/// Cycles of a state of many joints, with a command of one and an event now and then.
RecordingResult record_kept(const std::string& path, std::uint64_t cycles, RecorderOptions options,
                            std::uint64_t seed = 1) {
  const std::size_t joints = 40;
  RunInfo info{.robot = "many",
               .seed = seed,
               .period_ns = kKeptCycle_ns,
               .configuration = {{"a.toml", "text"}}};
  for (std::size_t j = 0; j < joints; ++j) info.joints.push_back("j" + std::to_string(j));
  auto recorder = Recorder::open(path, info, options);
  EXPECT_TRUE(recorder) << recorder.error().to_string();
  hal::StateImage state({.joints = joints, .sensor_channels = {}});
  hal::CommandImage command({.joints = joints, .sensor_channels = {}});
  const auto states = (*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
  const auto commands =
      (*recorder)->add_channel("/tandem/command", "tandem/msg/Command", command.layout());
  (*recorder)->start();
  for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
    const auto time_ns = static_cast<std::int64_t>(cycle) * kKeptCycle_ns;
    state.cycle()[0] = command.cycle()[0] = cycle;
    state.time_ns()[0] = command.time_ns()[0] = time_ns;
    for (std::size_t j = 0; j < joints; ++j) {
      state.position_rad()[j] = static_cast<double>(100 * cycle + j);
      state.torque_Nm()[j] = -state.position_rad()[j];
      state.homing()[j] = static_cast<std::uint8_t>(j);
      command.position_rad()[j] = 0.5 * state.position_rad()[j];
    }
    (*recorder)->wait_for_space(3);
    if (cycle % 1000 == 0) (*recorder)->push(Event{.cycle = cycle, .time_ns = time_ns});
    (*recorder)->push(states, time_ns, state.bytes());
    (*recorder)->push(commands, time_ns, command.bytes());
  }
  return (*recorder)->close();
}

LogFile opened(const std::string& path) {
  auto log = LogFile::open(path);
  EXPECT_TRUE(log) << log.error().to_string();
  return log ? std::move(*log) : LogFile();
}

/// What is left out takes nothing away from what stays.
TEST(Kept, HasEveryNthCycleAndTheFieldsThatAreWanted) {
  const ScratchFolder folder;
  const auto whole = record_kept(folder / "whole.mcap", 1000, {});
  const auto less = record_kept(
      folder / "less.mcap", 1000,
      {.shares = {{"state", 10, {"velocity_rad_s", "torque_nm", "statusword"}}, {"command", 0}}});
  const LogFile all = opened(whole.path), log = opened(less.path);
  EXPECT_EQ(log.find("/tandem/command"), nullptr);
  const LoggedTopic* state = log.find("/tandem/state");
  ASSERT_NE(state, nullptr);
  EXPECT_EQ(state->messages, 100U);
  EXPECT_EQ(state->layout.find("torque_nm"), nullptr);
  EXPECT_EQ(state->layout.bytes(), all.find("/tandem/state")->layout.bytes() - 40 * (8 + 8 + 2));
  const std::vector<Column> columns{
      {"cycle", 0}, {"position_rad", 39}, {"acceleration_rad_s2", 1}, {"homing", 39}};
  const auto kept = log.read("/tandem/state", columns);
  const auto expected = all.read("/tandem/state", columns, 10);
  ASSERT_TRUE(kept) << kept.error().to_string();
  ASSERT_TRUE(expected);
  EXPECT_EQ(kept->time_s, expected->time_s);
  EXPECT_EQ(kept->columns, expected->columns);
  EXPECT_EQ(kept->columns[1].back(), 99'039.0);
  EXPECT_EQ(kept->columns[3].back(), 39.0);
  EXPECT_LT(less.bytes, whole.bytes / 10);
}

RecorderOptions in_parts() {
  return {.limits = {.file_bytes = 4'000'000},
          .viewed = {.urdf = "<robot/>", .fixed_root = "base"}};
}

/// Nothing is lost and nothing is twice where one file ends and the next begins.
TEST(Kept, GoesOnInFilesThatAreWholeLogs) {
  const ScratchFolder folder;
  const auto whole = record_kept(folder / "whole.mcap", 5000, {});
  const auto parts = record_kept(folder / "run.mcap", 5000, in_parts());
  EXPECT_GE(parts.parts, 5U);
  EXPECT_EQ(parts.removed, 0U);
  EXPECT_EQ(parts.path, folder / "run.mcap");
  std::vector<double> cycles, events;
  std::uint64_t messages = 0, bytes = 0;
  for (std::uint64_t part = 1; part <= parts.parts; ++part) {
    const std::string name = part == 1 ? "run.mcap" : "run." + std::to_string(part) + ".mcap";
    const LogFile log = opened(folder / (part == 1 ? "run.1.mcap" : name));
    EXPECT_FALSE(log.truncated());
    EXPECT_EQ(log.info().part, part);
    EXPECT_EQ(log.remarks(), std::vector{"this is part " + std::to_string(part) +
                                         " of a log in several files: " + (folder / "run.mcap") +
                                         " opens all of them"});
    EXPECT_EQ(log.info().joints.size(), 40U);
    EXPECT_EQ(log.info().configuration.size(), 1U);
    for (const char* topic : {"/robot_description", "/tf_static"})
      EXPECT_EQ(log.find(topic)->messages, 1U) << topic << " of " << name;
    EXPECT_EQ(value_of(log.result(), "data_sha256"), log.data_sha256());
    const std::string next = "run." + std::to_string(part + 1) + ".mcap";
    EXPECT_EQ(value_of(log.result(), "continued"), part < parts.parts ? next : "");
    EXPECT_LE(log.bytes(), 4'200'000U) << name;
    const auto states = log.read("/tandem/state", {{"cycle", 0}});
    const auto commands = log.read("/tandem/command", {{"cycle", 0}});
    ASSERT_TRUE(states && commands);
    EXPECT_EQ(states->time_s, commands->time_s) << "a cycle is in one file";
    cycles.insert(cycles.end(), states->columns[0].begin(), states->columns[0].end());
    const auto texts = log.events();
    ASSERT_TRUE(texts);
    for (const EventText& event : *texts) {
      events.push_back(static_cast<double>(event.event.cycle));
    }
    messages += log.messages();
    bytes += log.bytes();
  }
  EXPECT_EQ(cycles, opened(whole.path).read("/tandem/state", {{"cycle", 0}})->columns[0]);
  EXPECT_EQ(events, (std::vector<double>{0, 1000, 2000, 3000, 4000}));
  EXPECT_EQ(messages, parts.messages);
  EXPECT_EQ(bytes, parts.bytes);
}

/// Whoever reads a log need not know whether it is in one file.
TEST(Kept, OpensAllFilesAsOneLogThatIsTheSameBitForBit) {
  const ScratchFolder folder;
  RecorderOptions one_file = in_parts();
  one_file.limits = {};
  const auto whole = record_kept(folder / "whole.mcap", 5000, one_file);
  const auto parts = record_kept(folder / "run.mcap", 5000, in_parts());
  std::ofstream(folder / "run.77.mcap") << "another's";
  ASSERT_GE(parts.parts, 5U);
  const LogFile expected = opened(whole.path), log = opened(parts.path);
  EXPECT_EQ(log.parts().size(), parts.parts);
  EXPECT_TRUE(log.missing().empty());
  EXPECT_TRUE(log.remarks().empty());
  EXPECT_FALSE(log.truncated());
  EXPECT_EQ(log.bytes(), parts.bytes);
  EXPECT_EQ(log.info().part, 0U);
  EXPECT_EQ(log.messages(), expected.messages());
  EXPECT_EQ(value_of(log.result(), "messages"), std::to_string(log.messages()));
  EXPECT_EQ(log.data_sha256(), expected.data_sha256());
  EXPECT_EQ(log.data_sha256(), parts.data_sha256);
  const auto compared = compare(expected, log);
  ASSERT_TRUE(compared) << compared.error().to_string();
  EXPECT_TRUE(compared->equal());
  EXPECT_EQ(compared->topics.size(), expected.topics().size());
  ASSERT_EQ(log.topics().size(), expected.topics().size());
  for (std::size_t i = 0; i < log.topics().size(); ++i) {
    const LoggedTopic &a = log.topics()[i], &b = expected.topics()[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.messages, b.messages) << a.name;
    EXPECT_EQ(a.first_ns, b.first_ns) << a.name;
    EXPECT_EQ(a.last_ns, b.last_ns) << a.name;
  }
}

/// What is gone is said, with the time of what is there.
TEST(Kept, SaysWhichPartsAreMissing) {
  const ScratchFolder folder;
  const auto parts = record_kept(folder / "run.mcap", 5000, in_parts());
  ASSERT_GE(parts.parts, 5U);
  const auto part = [&](std::uint64_t number) { return part_path(folder / "run.mcap", number); };
  const std::int64_t third_ns = opened(part(3)).parts().front().first_ns;
  fs::remove(part(1));
  fs::remove(part(2));
  LogFile log = opened(folder / "run.mcap");
  EXPECT_EQ(log.parts().front().number, 3U);
  ASSERT_EQ(log.missing().size(), 1U);
  EXPECT_EQ(to_string(log.missing()[0]), "parts 1 to 2");
  ASSERT_EQ(log.remarks().size(), 1U);
  EXPECT_EQ(log.remarks()[0].find("the log lacks parts 1 to 2; what is here is from " +
                                  std::to_string(third_ns / 1'000'000'000) + "."),
            0U)
      << log.remarks()[0];
  const auto rows = log.read("/tandem/state", {{"cycle", 0}});
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->columns[0].back(), 4999.0);
  EXPECT_EQ(rows->columns[0].size(), 5000.0 - rows->columns[0].front());

  fs::remove(part(parts.parts));
  fs::remove(part(4));
  log = opened(folder / "run.mcap");
  ASSERT_EQ(log.missing().size(), 3U);
  EXPECT_EQ(to_string(log.missing()[1]), "part 4");
  EXPECT_EQ(to_string(log.missing()[2]),
            "part " + std::to_string(parts.parts) + " and what follows");
  EXPECT_NE(log.remarks()[0].find(" s and from "), std::string::npos) << log.remarks()[0];
  for (std::uint64_t i = 3; i < parts.parts; ++i) fs::remove(part(i));
  EXPECT_FALSE(LogFile::open(folder / "run.mcap"));
}

/// The last part of a run that was killed ends where it was cut; a file of another run that has the
/// name of a part is none.
TEST(Kept, ReadsACutLastPartAndNoOtherRuns) {
  const ScratchFolder folder;
  const auto parts = record_kept(folder / "run.mcap", 5000, in_parts());
  const std::string last = part_path(folder / "run.mcap", parts.parts);
  fs::resize_file(last, fs::file_size(last) / 2);
  LogFile log = opened(folder / "run.mcap");
  EXPECT_TRUE(log.truncated());
  EXPECT_EQ(log.parts().size(), parts.parts);
  EXPECT_TRUE(log.remarks().empty());
  // One that is cut in the middle of the run was not told: whoever computed with it saw no gap.
  const ScratchFolder copy;
  for (std::uint64_t i = 1; i <= parts.parts; ++i)
    fs::copy_file(part_path(folder / "run.mcap", i), part_path(copy / "run.mcap", i));
  const std::string second = part_path(copy / "run.mcap", 2);
  fs::resize_file(second, fs::file_size(second) / 2);
  const std::vector<std::string> told = opened(copy / "run.mcap").remarks();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_TRUE(told[0].starts_with(second + " is cut: nothing is here from ")) << told[0];
  fs::resize_file(last, 0);  // killed before a byte of it
  EXPECT_EQ(to_string(opened(folder / "run.mcap").missing().at(0)),
            "part " + std::to_string(parts.parts) + " and what follows");
  const ScratchFolder other;
  (void)record_kept(other / "run.mcap", 5000, in_parts(), 2);
  fs::copy_file(part_path(other / "run.mcap", 2), part_path(folder / "run.mcap", 2),
                fs::copy_options::overwrite_existing);
  log = opened(folder / "run.mcap");
  EXPECT_EQ(to_string(log.missing().at(0)), "part 2");
  EXPECT_EQ(log.parts().size(), parts.parts - 2);
}

TEST(Kept, KnowsThePartThatAPathNames) {
  EXPECT_EQ(part_of("runs/a-001.12.mcap")->all, "runs/a-001.mcap");
  EXPECT_EQ(part_of("runs/a-001.12.mcap")->number, 12U);
  for (const char* none : {"a.mcap", "a.2", "a.0.mcap", "a.02.mcap", "a.x.mcap", "a..mcap",
                           "a.2x.mcap", ".2.mcap", "a.99999999999999999999.mcap", "a.-1.mcap"})
    EXPECT_FALSE(part_of(none)) << none;
}

/// Where files end does not depend on the machine, nor on what it says of itself.
TEST(Kept, EqualRunsHaveEqualParts) {
  const ScratchFolder folder;
  RecorderOptions slow = in_parts();
  slow.ring_slots = 8;
  const auto one = record_kept(folder / "one.mcap", 3000, in_parts());
  const auto two = record_kept(folder / "a_much_longer_name.mcap", 3000, slow);
  EXPECT_EQ(one.parts, two.parts);
  EXPECT_EQ(one.data_sha256, two.data_sha256);
}

TEST(Kept, RemovesTheOldestFilesOfTheRunAndNoOthers) {
  const ScratchFolder folder;
  std::ofstream(folder / "run.0.mcap") << "another's";
  RecorderOptions options = in_parts();
  options.limits.total_bytes = 12'000'000;
  const auto result = record_kept(folder / "run.mcap", 10'000, options);
  EXPECT_GT(result.removed, 3U);
  EXPECT_LE(result.bytes, 12'000'000U);
  EXPECT_EQ(result.failed, 0U);
  std::uint64_t bytes = 0, files = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    if (entry.path().filename() == "run.0.mcap") continue;
    bytes += entry.file_size();
    ++files;
  }
  EXPECT_EQ(files, result.parts - result.removed);
  EXPECT_EQ(bytes, result.bytes);
  EXPECT_TRUE(fs::exists(folder / "run.0.mcap"));
  EXPECT_FALSE(fs::exists(folder / "run.mcap"));
  const LogFile all = opened(result.path);
  EXPECT_EQ(all.parts().front().number, result.removed + 1);
  EXPECT_EQ(all.parts().size(), files);
  const LogFile last = opened(folder / ("run." + std::to_string(result.parts) + ".mcap"));
  EXPECT_EQ(value_of(last.result(), "removed_parts"), std::to_string(result.removed));
  EXPECT_EQ(last.read("/tandem/state", {{"cycle", 0}})->columns[0].back(), 9999.0);
}

/// More than the disk has: the recording ends at once, whole, and says so.
TEST(Kept, EndsBeforeTheDiskHasLessThanItShall) {
  const ScratchFolder folder;
  RecorderOptions options;
  options.limits.keep_free_bytes = std::uint64_t{1} << 60;
  const auto result = record_kept(folder / "run.mcap", 5000, options);
  EXPECT_GT(result.failed, 5000U);
  EXPECT_EQ(
      result.error,
      "the log is incomplete: the disk has less than [log] keep_free_MB = 1152921504606 free");
  const LogFile log = opened(result.path);
  EXPECT_FALSE(log.truncated());
  EXPECT_EQ(log.messages(), result.messages);
  EXPECT_EQ(log.messages() + result.failed, 10'005U);
  EXPECT_EQ(value_of(log.result(), "data_sha256"), log.data_sha256());
}

TEST(Kept, SaysWhenTheNextFileCannotBeMade) {
  const ScratchFolder folder;
  std::ofstream(folder / "run.2.mcap") << "another's";
  const auto result = record_kept(folder / "run.mcap", 5000, {.limits = {.file_bytes = 4'000'000}});
  EXPECT_NE(result.error.find("run.2.mcap: File exists"), std::string::npos) << result.error;
  EXPECT_GT(result.failed, 1000U);
  EXPECT_EQ(opened(folder / "run.mcap").messages(), result.messages);
  EXPECT_EQ(result.messages + result.failed, 10'005U);
  EXPECT_EQ(result.parts, 1U);
  EXPECT_EQ(fs::file_size(folder / "run.2.mcap"), 9U);
}

}  // namespace
}  // namespace tandem::log
