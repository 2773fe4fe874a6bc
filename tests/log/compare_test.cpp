#include "log/compare.hpp"

#include "hal/truth.hpp"
#include "log/recorder.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

struct Written {
  std::uint64_t messages = 3;
  std::uint64_t odd_message = 99;  ///< whose knee position is another
  std::int64_t late_message = 99;  ///< whose time is 1 ns later
  bool command = false;            ///< write a second topic
};

LogFile write(const std::string& path, const Written& what) {
  const RunInfo info{.robot = "two", .joints = {"hip", "knee"}, .sensors = {}, .period_ns = 1000};
  auto recorder = Recorder::open(path, info, {});
  EXPECT_TRUE(recorder);
  hal::Layout layout;
  layout.add("cycle", hal::FieldType::kU64, 1, "");
  layout.add("position_rad", hal::FieldType::kF64, 2, "");
  const auto state = (*recorder)->add_channel("/tandem/state", "tandem/msg/State", layout);
  const auto command = (*recorder)->add_channel("/tandem/command", "tandem/msg/Command", layout);
  (*recorder)->start();
  for (std::uint64_t cycle = 0; cycle < what.messages; ++cycle) {
    struct {
      std::uint64_t cycle;
      double position_rad[2];
    } message{cycle, {0.5, cycle == what.odd_message ? std::nextafter(0.25, 1.0) : 0.25}};
    const std::int64_t late_ns = static_cast<std::int64_t>(cycle) == what.late_message ? 1 : 0;
    const auto time_ns = static_cast<std::int64_t>(cycle) * 1000 + late_ns;
    (*recorder)->push(state, time_ns, std::as_bytes(std::span(&message, 1)));
    if (what.command) (*recorder)->push(command, time_ns, std::as_bytes(std::span(&message, 1)));
  }
  EXPECT_EQ((*recorder)->close().dropped, 0U);
  auto file = LogFile::open(path);
  EXPECT_TRUE(file);
  return std::move(*file);
}

class Compare : public testing::Test {
 protected:
  Comparison with(const Written& a, const Written& b) {
    const auto result = compare(write(folder_ / "a.mcap", a), write(folder_ / "b.mcap", b));
    EXPECT_TRUE(result);
    return *result;
  }
  const ScratchFolder folder_;
};

const TopicComparison& state_of(const Comparison& comparison) {
  for (const TopicComparison& topic : comparison.topics) {
    if (topic.topic == "/tandem/state") return topic;
  }
  ADD_FAILURE() << "the state was not compared";
  return comparison.topics.front();
}

TEST_F(Compare, TheSameRunIsEqual) {
  const Comparison result = with({.command = true}, {.command = true});
  EXPECT_TRUE(result.equal());
  EXPECT_EQ(state_of(result).messages_a, 3U);
}

TEST_F(Compare, NamesTheFirstCycleJointAndSignalThatDifferInTheLastBit) {
  const Comparison result = with({}, {.odd_message = 1});
  EXPECT_FALSE(result.equal());
  const auto& first = state_of(result).first;
  ASSERT_TRUE(first);
  EXPECT_EQ(first->message, 1U);
  EXPECT_EQ(first->time_ns, 1000);
  EXPECT_EQ(first->signal, "position_rad.knee");
  EXPECT_EQ(first->a, 0.25);
  EXPECT_EQ(first->b, std::nextafter(0.25, 1.0));
}

TEST_F(Compare, AShorterLogIsNotEqualThoughItsMessagesAre) {
  const Comparison result = with({}, {.messages = 2});
  EXPECT_FALSE(result.equal());
  EXPECT_FALSE(state_of(result).first);
  EXPECT_EQ(state_of(result).messages_b, 2U);
}

TEST_F(Compare, ATimeStampCountsToo) {
  const Comparison result = with({}, {.late_message = 2});
  ASSERT_TRUE(state_of(result).first);
  EXPECT_EQ(state_of(result).first->signal, "time");
  EXPECT_DOUBLE_EQ(state_of(result).first->a, 2.000e-6);
  EXPECT_DOUBLE_EQ(state_of(result).first->b, 2.001e-6);
  EXPECT_EQ(state_of(result).first->message, 2U);
}

// It was "length is 0 and 0".
TEST_F(Compare, MessagesOfOtherLengthsAreShownWithTheirBytes) {
  const auto log_of = [this](const char* name, std::size_t joints) {
    auto recorder = Recorder::open(folder_ / name, {.robot = name, .sensors = {}}, {});
    hal::Layout layout;
    layout.add("position_rad", hal::FieldType::kF64, joints, "");
    const auto state = (*recorder)->add_channel("/tandem/state", "tandem/msg/State", layout);
    (*recorder)->start();
    const std::vector<double> position_rad(joints);
    (*recorder)->push(state, 0, std::as_bytes(std::span(position_rad)));
    EXPECT_EQ((*recorder)->close().messages, 1U);
    return LogFile::open(folder_ / name);
  };
  const auto result = compare(*log_of("a.mcap", 2), *log_of("b.mcap", 3));
  ASSERT_TRUE(result);
  const auto& first = state_of(*result).first;
  ASSERT_TRUE(first);
  EXPECT_EQ(first->signal, "length");
  EXPECT_EQ(first->a, 16.0);
  EXPECT_EQ(first->b, 24.0);
}

// Over a wire nobody knows where the base is, and in process the log says it.
TEST_F(Compare, PassesOverFramesThatAreMadeFromTheRest) {
  const auto log_of = [this](const char* name, bool floating) {
    ViewedRobot robot{.urdf = "<robot/>", .links = {{.parent = "a", .name = "b", .joint = 0}}};
    if (floating) robot.base_link = "a";
    auto recorder = Recorder::open(folder_ / name, {.joints = {"hip"}}, {.viewed = robot});
    const hal::StateImage state({.joints = 1, .sensor_channels = {}});
    const hal::TruthImage truth(1, 0);
    const auto states =
        (*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
    const auto truths =
        (*recorder)->add_channel("/tandem/truth", "tandem/msg/Truth", truth.layout());
    (*recorder)->start();
    (*recorder)->push(states, 0, state.bytes());
    (*recorder)->push(truths, 0, truth.bytes());
    EXPECT_EQ((*recorder)->close().failed, 0U);
    return LogFile::open(folder_ / name);
  };
  const auto a = log_of("a.mcap", true), b = log_of("b.mcap", false);
  ASSERT_TRUE(a && b);
  EXPECT_NE(a->find("/tf")->messages, b->find("/tf")->messages);
  const auto result = compare(*a, *b);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->equal());
  EXPECT_EQ(result->made, std::vector<std::string>{"/tf"});
}

// It was "bytes is 0 and 0".
TEST_F(Compare, ByteByByteWhereNoFieldHasAFixedPlace) {
  const auto log_of = [this](const char* name, std::uint8_t last) {
    auto recorder = Recorder::open(folder_ / name, {.robot = name, .sensors = {}}, {});
    const auto state = (*recorder)->add_channel("/tandem/state", "tandem/msg/State", {});
    (*recorder)->start();
    const std::array<std::uint8_t, 3> body{7, 7, last};
    (*recorder)->push(state, 0, std::as_bytes(std::span(body)));
    EXPECT_EQ((*recorder)->close().messages, 1U);
    return LogFile::open(folder_ / name);
  };
  const auto result = compare(*log_of("a.mcap", 8), *log_of("b.mcap", 255));
  ASSERT_TRUE(result);
  const auto& first = state_of(*result).first;
  ASSERT_TRUE(first);
  EXPECT_EQ(first->signal, "byte 2");
  EXPECT_EQ(first->a, 8.0);
  EXPECT_EQ(first->b, 255.0);
}

}  // namespace
}  // namespace tandem::log
