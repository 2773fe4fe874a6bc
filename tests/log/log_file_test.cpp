#include "log/log_file.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "log/csv.hpp"
#include "log/mcap_writer.hpp"
#include "log/recorder.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

/// Two joints and one sensor of two channels; three messages.
class LogFileOfThree : public testing::Test {
 protected:
  void SetUp() override {
    const RunInfo info{
        .robot = "two", .joints = {"hip", "knee"}, .sensors = {{"imu", 2}}, .period_ns = 1000};
    auto recorder = Recorder::open(path_, info, {});
    ASSERT_TRUE(recorder);
    hal::Layout layout;
    layout.add("cycle", hal::FieldType::kU64, 1, "");
    layout.add("position_rad", hal::FieldType::kF64, 2, "");
    layout.add("sensor", hal::FieldType::kF64, 2, "");
    const auto channel = (*recorder)->add_channel("/tandem/state", "tandem/msg/State", layout);
    (*recorder)->start();
    for (std::uint64_t cycle = 0; cycle < 3; ++cycle) {
      struct {
        std::uint64_t cycle;
        double numbers[4];
      } message{cycle, {0.1, -2.5e-300, 1.0 / 3.0, static_cast<double>(cycle)}};
      (*recorder)->push(channel, static_cast<std::int64_t>(cycle) * 250'000'000,
                        std::as_bytes(std::span(&message, 1)));
    }
    (*recorder)->push(Event{.cycle = 2, .time_ns = 500'000'000, .kind = EventKind::kShutDown});
    EXPECT_EQ((*recorder)->close().messages, 4U);
  }

  LogFile open() const {
    auto log = LogFile::open(path_);
    EXPECT_TRUE(log);
    return std::move(*log);
  }

  const ScratchFolder folder_;
  const std::string path_ = folder_ / "run.mcap";
};

TEST_F(LogFileOfThree, ListsItsTopicsWithCountsAndTimes) {
  const LogFile log = open();
  ASSERT_EQ(log.topics().size(), 2U);
  const LoggedTopic* state = log.find("/tandem/state");
  ASSERT_NE(state, nullptr);
  EXPECT_EQ(state->type, "tandem/msg/State");
  EXPECT_EQ(state->messages, 3U);
  EXPECT_EQ(state->first_ns, 0);
  EXPECT_EQ(state->last_ns, 500'000'000);
  EXPECT_EQ(log.messages(), 4U);
}

TEST_F(LogFileOfThree, SuggestsTheNearestNameOfATopicOrField) {
  const LogFile log = open();
  EXPECT_EQ(log.read("/tandem/stat", {}).error().hint, "did you mean '/tandem/state'?");
  EXPECT_EQ(log.read("/tandem/state", {{"positon_rad", 0}}).error().hint,
            "did you mean 'position_rad'?");
  EXPECT_FALSE(log.read("/tandem/state", {{"position_rad", 2}}));
}

// "squat" was as near to "/tandem/state" as to anything.
TEST(LogFileOfController, FindsItsTopicsByTheirLastParts) {
  const ScratchFolder folder;
  auto recorder = Recorder::open(folder / "run.mcap", {.robot = "two"}, {});
  ASSERT_TRUE(recorder);
  hal::Layout layout;
  layout.add("cycle", hal::FieldType::kU64, 1, "");
  for (const char* topic : {"/tandem/state", "/tandem/controller/squat", "/tf", "/a/one", "/b/one"})
    (void)(*recorder)->add_channel(topic, "tandem/msg/X", layout);
  (*recorder)->start();
  const auto log = LogFile::open((*recorder)->close().path);
  ASSERT_TRUE(log);
  EXPECT_EQ(log->full_name("state"), "/tandem/state");
  EXPECT_EQ(log->full_name("squat"), "/tandem/controller/squat");
  EXPECT_EQ(log->full_name("controller/squat"), "/tandem/controller/squat");
  EXPECT_EQ(log->full_name("tf"), "/tf");
  EXPECT_EQ(log->full_name("one"), "/tandem/one") << "there are two";
  const auto hint = [&](const char* name) { return log->read(name, {}).error().hint; };
  EXPECT_EQ(hint("/tandem/squat"), "did you mean '/tandem/controller/squat'?");
  EXPECT_EQ(hint("/tandem/squta"), "did you mean '/tandem/controller/squat'?");
  EXPECT_EQ(hint("/tandem/tf"), "did you mean '/tf'?");
  EXPECT_EQ(hint("/tandem/stat"), "did you mean '/tandem/state'?");
}

TEST_F(LogFileOfThree, ReadsEverySecondMessage) {
  const auto table = open().read("/tandem/state", {{"sensor", 1}}, 2);
  ASSERT_TRUE(table);
  EXPECT_EQ(table->time_s, (std::vector<double>{0.0, 0.5}));
  EXPECT_EQ(table->columns[0], (std::vector<double>{0.0, 2.0}));
}

TEST_F(LogFileOfThree, WritesCsvWithTheNamesOfJointsAndSensors) {
  std::ostringstream out;
  const Status done = write_csv(open(), "/tandem/state", 1, out);
  ASSERT_TRUE(done);
  EXPECT_EQ(out.str(),
            "time_s,cycle,position_rad.hip,position_rad.knee,sensor.imu.0,sensor.imu.1\n"
            "0,0,0.1,-2.5e-300,0.3333333333333333,0\n"
            "0.25,1,0.1,-2.5e-300,0.3333333333333333,1\n"
            "0.5,2,0.1,-2.5e-300,0.3333333333333333,2\n");
}

/// Until a joint or a sensor was heard, its zeros are no measurements: the first rows had them.
/// Rows without any measurement are left out.
TEST(LogFileOfAStart, LeavesTheCellsOfWhatWasNeverMeasuredEmpty) {
  const ScratchFolder folder;
  const RunInfo info{
      .robot = "two", .joints = {"hip", "knee"}, .sensors = {{"imu", 1}}, .period_ns = 1000};
  auto recorder = Recorder::open(folder / "run.mcap", info, {});
  ASSERT_TRUE(recorder);
  hal::Layout layout, commanded;
  layout.add("cycle", hal::FieldType::kU64, 1, "");
  layout.add("position_rad", hal::FieldType::kF64, 2, "");
  layout.add("sensor", hal::FieldType::kF64, 1, "");
  layout.add("age_cycles", hal::FieldType::kU32, 2, "");
  layout.add("sensor_age_cycles", hal::FieldType::kU32, 1, "");
  commanded.add("cycle", hal::FieldType::kU64, 1, "");
  commanded.add("position_rad", hal::FieldType::kF64, 2, "");
  commanded.add("torque_nm", hal::FieldType::kF64, 2, "");
  const auto channel = (*recorder)->add_channel("/tandem/state", "tandem/msg/State", layout);
  const auto command = (*recorder)->add_channel("/tandem/command", "tandem/msg/Command", commanded);
  (*recorder)->start();
  for (std::uint32_t cycle = 0; cycle < 3; ++cycle) {
    struct {
      std::uint64_t cycle;
      double numbers[3];
      std::uint32_t ages[4];
    } message{cycle,
              {0.5, 0.0, 0.25},
              {cycle < 1 ? cycle + 1 : 0, cycle + 1, cycle < 2 ? cycle + 1 : 1, 0}};
    (*recorder)->push(channel, cycle * 1'000'000,
                      std::as_bytes(std::span(&message, 1)).first(layout.bytes()));
    const struct {
      std::uint64_t cycle;
      double numbers[4];
    } sent{cycle, {cycle < 1 ? 0.0 : 0.5, 0.0, 0.0, 1.0}};
    (*recorder)->push(command, cycle * 1'000'000, std::as_bytes(std::span(&sent, 1)));
  }
  const std::string path = (*recorder)->close().path;
  const auto log = LogFile::open(path);
  ASSERT_TRUE(log);
  std::ostringstream out;
  ASSERT_TRUE(write_csv(*log, "/tandem/state", 1, out));
  EXPECT_EQ(
      out.str(),
      "time_s,cycle,position_rad.hip,position_rad.knee,sensor.imu.0,age_cycles.hip,age_cycles.knee,"
      "sensor_age_cycles.imu\n"
      "0.001,1,0.5,,,0,2,2\n"
      "0.002,2,0.5,,0.25,0,3,1\n");
  // A command repeats what is measured: its zeros stood for it before anything was.
  out.str("");
  ASSERT_TRUE(write_csv(*log, "/tandem/command", 1, out));
  EXPECT_EQ(out.str(),
            "time_s,cycle,position_rad.hip,position_rad.knee,torque_nm.hip,torque_nm.knee\n"
            "0.001,1,0.5,,0,1\n"
            "0.002,2,0.5,,0,1\n");
}

TEST_F(LogFileOfThree, WritesOnlyTheFieldsAskedFor) {
  std::ostringstream out;
  const std::vector<std::string> fields{"position_rad"};
  ASSERT_TRUE(write_csv(open(), "/tandem/state", 2, out, fields));
  EXPECT_EQ(out.str(),
            "time_s,position_rad.hip,position_rad.knee\n0,0.1,-2.5e-300\n0.5,0.1,-2.5e-300\n");
  const std::vector<std::string> misspelt{"positon_rad"};
  EXPECT_EQ(write_csv(open(), "/tandem/state", 1, out, misspelt).error().hint,
            "did you mean 'position_rad'?");
}

TEST_F(LogFileOfThree, WritesEventsAsCsv) {
  std::ostringstream out;
  ASSERT_TRUE(write_csv(open(), "/tandem/event", 1, out));
  EXPECT_EQ(out.str(), "time_s,cycle,kind,joint,code,text\n0.5,2,shut down,-1,0,\"shut down\"\n");
  EXPECT_FALSE(write_csv(open(), "/nothing", 1, out));
}

std::string read_bytes(const std::string& log) {
  std::ifstream in(log, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// `size` bytes of the log.
std::string cut(const std::string& log, const std::string& to, std::size_t size) {
  const std::string bytes = read_bytes(log).substr(0, size);
  std::ofstream(to, std::ios::binary) << bytes;
  return to;
}

// A log without a robot, and status 0.
TEST_F(LogFileOfThree, IsRefusedWhenItIsCutBeforeAnythingOfItsRun) {
  const auto log = LogFile::open(cut(path_, folder_ / "cut.mcap", 20));
  ASSERT_FALSE(log);
  EXPECT_EQ(log.error().message, "the log is cut after 20 bytes, before anything of its run");
  EXPECT_NE(log.error().hint.find("the copy is not whole"), std::string::npos);
}

// "its run was killed": of a run that goes on. Whoever writes a log has a lock on it.
TEST_F(LogFileOfThree, SaysThatItsRunIsStillWritingIt) {
  const std::string file = cut(path_, folder_ / "now.mcap", read_bytes(path_).size() / 2);
  EXPECT_NE(LogFile::open(file)->cut_reason().find("was killed"), std::string::npos);
  const std::string written = folder_ / "other.mcap";
  McapWriter writer;
  ASSERT_TRUE(writer.open(written, {}));
  std::filesystem::resize_file(written, 0);
  std::ofstream(written, std::ios::binary | std::ios::app) << read_bytes(file);
  const auto log = LogFile::open(written);
  ASSERT_TRUE(log) << log.error().to_string();
  EXPECT_TRUE(log->truncated());
  EXPECT_EQ(log->cut_reason(), "its run is still writing it");
  EXPECT_TRUE(log->cut_remark().starts_with("the log is cut: its run is still writing it; "))
      << log->cut_remark();
  EXPECT_EQ(LogFile::open(path_)->cut_remark(), "");
}

// "has no topic '/tandem/state'": whoever reads that looks for another topic.
TEST_F(LogFileOfThree, SaysThatItIsCutWhereATopicIsMissing) {
  const std::size_t chunk = read_bytes(path_).find("tandem/msg/State");
  ASSERT_NE(chunk, std::string::npos);
  const auto log = LogFile::open(cut(path_, folder_ / "cut.mcap", chunk));
  ASSERT_TRUE(log) << log.error().to_string();
  EXPECT_TRUE(log->truncated());
  EXPECT_EQ(log->info().robot, "two");
  const auto events = log->events();
  ASSERT_FALSE(events);
  EXPECT_EQ(events.error().message, "the log is cut after " + std::to_string(chunk) +
                                        " bytes, before a message of '/tandem/event'");
  std::ostringstream csv;
  const Status written = write_csv(*log, "/tandem/state", 1, csv, {});
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message.find("is cut after"), std::string::npos);
}

}  // namespace
}  // namespace tandem::log
