// The topics for ROS viewers, by literal bytes and by their rate. tests/apps/log_decoded_test.cpp
// has another project decode them.
#include "log/robot_view.hpp"

#include "hal/truth.hpp"
#include "log/log_file.hpp"
#include "log/recorder.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

constexpr std::int64_t kCycle_ns = 3'000'000;

struct Counts {
  std::uint64_t joint_states = 0, tf = 0, descriptions = 0;
  bool operator==(const Counts&) const = default;
};

/// A log of two joints on a base, `cycles` long.
struct View {
  explicit View(ViewedRobot robot, bool has_truth = true, std::uint64_t cycles = 100,
                std::uint64_t first_answer = 0) {
    auto recorder =
        Recorder::open(path, {.robot = "two", .joints = {"hip", "knee"}, .period_ns = kCycle_ns},
                       {.viewed = std::move(robot)});
    EXPECT_TRUE(recorder);
    const auto state_channel =
        (*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
    const auto truth_channel =
        has_truth ? (*recorder)->add_channel("/tandem/truth", "tandem/msg/Truth", truth.layout())
                  : state_channel;
    (*recorder)->start();
    for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
      const auto time_ns = static_cast<std::int64_t>(cycle) * kCycle_ns;
      state.cycle()[0] = cycle;
      state.age_cycles()[1] =
          cycle < first_answer ? static_cast<std::uint32_t>(cycle) + 1 : std::uint32_t{0};
      state.position_rad()[0] = truth.base_position_m()[2] = static_cast<double>(cycle);
      (*recorder)->wait_for_space(2);
      (*recorder)->push(state_channel, time_ns, state.bytes());
      if (has_truth) (*recorder)->push(truth_channel, time_ns, truth.bytes());
    }
    messages = (*recorder)->close().messages;
    auto opened = LogFile::open(path);
    EXPECT_TRUE(opened) << opened.error().to_string();
    log = std::move(*opened);
  }

  [[nodiscard]] Counts counts() const {
    const auto of = [this](const char* topic) {
      const LoggedTopic* found = log.find(topic);
      return found == nullptr ? 0 : found->messages;
    };
    return {of("/joint_states"), of("/tf"), of("/robot_description")};
  }
  [[nodiscard]] std::vector<std::pair<std::int64_t, std::string>> of(const char* topic) const {
    std::vector<std::pair<std::int64_t, std::string>> all;
    EXPECT_TRUE(log.for_each(topic, [&](std::int64_t time_ns, std::span<const std::byte> body) {
      all.emplace_back(time_ns,
                       std::string(reinterpret_cast<const char*>(body.data()), body.size()));
    }));
    return all;
  }

  const ScratchFolder folder;
  const std::string path = folder / "view.mcap";
  hal::StateImage state{{.joints = 2, .sensor_channels = {}}};
  hal::TruthImage truth{2, 0};
  LogFile log;
  std::uint64_t messages = 0;
};

TEST(RobotView, WritesJointStatesFiftyTimesASecondAndTheDescriptionOnce) {
  const View view({.urdf = "<robot/>", .base_link = "pelvis"});
  EXPECT_EQ(view.counts(), (Counts{15, 15, 1})) << "of 0.3 s";
  EXPECT_EQ(view.messages, 100u + 100u + 31u);
  std::int64_t period = -1;
  for (const auto& [time_ns, body] : view.of("/joint_states")) {
    EXPECT_EQ(time_ns / RobotView::kPeriod_ns, ++period);
    EXPECT_LT(time_ns % RobotView::kPeriod_ns, kCycle_ns) << "not the first cycle of its 20 ms";
  }
  const auto description = view.of("/robot_description");
  EXPECT_EQ(description[0], std::pair(std::int64_t{0}, std::string("\x09\0\0\0<robot/>\0", 13)));
}

TEST(RobotView, SaysNothingOfJointsThatHaveNotAnsweredYet) {
  const View view({.urdf = "<robot/>"}, true, 100, 40);
  EXPECT_EQ(view.counts(), (Counts{9, 0, 1})) << "of 0.12 to 0.3 s";
}

TEST(RobotView, EncodesAJointStateAsCdrHasIt) {
  const View view({.urdf = "<robot/>"});
  const auto [time_ns, body] = view.of("/joint_states")[1];
  EXPECT_EQ(time_ns, 21'000'000) << "cycle 7, the first one behind 20 ms";
  const std::string zero(8, '\0');
  const std::string two("\x02\0\0\0\0\0\0\0", 8);                   // elements; padding to 8
  std::string expected("\0\0\0\0\x40\x6f\x40\x01", 8);              // stamp: 0 s, 21,000,000 ns
  expected += std::string("\x01\0\0\0\0\0\0\0", 8);                 // ""; padding to 4
  expected += std::string("\x02\0\0\0\x04\0\0\0hip\0", 12);         // two names
  expected += std::string("\x05\0\0\0knee\0\0\0\0", 12);            // and padding to 4
  expected += two + std::string("\0\0\0\0\0\0\x1c\x40", 8) + zero;  // positions 7, 0
  expected += two + zero + zero;                                    // velocities
  expected += two + zero + zero;                                    // torques
  EXPECT_EQ(body, expected);
}

TEST(RobotView, HasTheJointsThatFollowOthers) {
  const View view({.urdf = "<robot/>", .followers = {{"toe", 0, -2.0, 0.5}}});
  const auto [time_ns, body] = view.of("/joint_states")[1];
  EXPECT_EQ(time_ns, 21'000'000) << "cycle 7: hip at 7";
  const auto number = [&](std::size_t from_end) {
    double value = 0.0;
    std::memcpy(&value, body.data() + body.size() - from_end, sizeof value);
    return value;
  };
  EXPECT_NE(body.find(std::string("\x04\0\0\0toe\0", 8)), std::string::npos);
  EXPECT_TRUE(std::isnan(number(8))) << "its torque, the last number";
  EXPECT_EQ(number(8 + 8 + 3 * 8), -0.0) << "its velocity, before a length, padding and 3 torques";
  EXPECT_EQ(number(8 + 8 + 3 * 8 + 8 + 3 * 8), -2.0 * 7.0 + 0.5);
}

TEST(RobotView, LeavesOutWhatNobodyKnows) {
  EXPECT_EQ(View({.urdf = "<robot/>"}).counts(), (Counts{15, 0, 1})) << "a fixed base";
  EXPECT_EQ(View({.urdf = "<robot/>", .base_link = "pelvis"}, false).counts(), (Counts{15, 0, 1}))
      << "no truth";
  EXPECT_EQ(View({}).counts(), (Counts{0, 0, 0})) << "no description";
}

/// One transform of a TFMessage that has it alone.
struct Transform {
  std::string parent, link;
  std::array<double, 7> place;  // x y z, quaternion x y z w
};
Transform transform_of(const std::string& body) {
  std::size_t at = 12;  // count, stamp
  const auto text = [&] {
    at = (at + 3) / 4 * 4;
    std::uint32_t length = 0;
    std::memcpy(&length, body.data() + at, 4);
    const std::string found = body.substr(at + 4, length - 1);
    at += 4 + length;
    return found;
  };
  Transform found{text(), text(), {}};
  at = (at + 7) / 8 * 8;
  EXPECT_EQ(body.size(), at + 56);
  std::memcpy(found.place.data(), body.data() + at, 56);
  return found;
}

/// A robot on a fixed base had no frame at all, and a viewer showed every link at its zero.
TEST(RobotView, SaysWhereEveryLinkStands) {
  const double half = std::sqrt(0.5);
  const ViewedLink turns{.parent = "base",
                         .name = "thigh",
                         .xyz_m = {1, 2, 3},
                         .quaternion = {half, 0, 0, half},  // x to x, y to z
                         .axis = {0, 1, 0},
                         .joint = 0};
  ViewedLink slides = turns;
  slides.slides = true;
  slides.multiplier = 2.0;
  slides.offset = 1.0;
  const View fixed({.urdf = "<robot/>", .fixed_root = "base"});
  ASSERT_EQ(fixed.of("/tf_static").size(), 1U);
  const Transform root = transform_of(fixed.of("/tf_static")[0].second);
  EXPECT_EQ(root.parent, "odom");
  EXPECT_EQ(root.link, "base");
  EXPECT_EQ(root.place, (std::array<double, 7>{0, 0, 0, 0, 0, 0, 1}));

  const View view({.urdf = "<robot/>", .links = {turns}});
  EXPECT_EQ(view.counts(), (Counts{15, 15, 1})) << "of 0.3 s";
  EXPECT_EQ(view.log.find("/tf_static"), nullptr);
  const auto [time_ns, body] = view.of("/tf")[1];
  const Transform thigh = transform_of(body);
  EXPECT_EQ(time_ns, 21'000'000) << "cycle 7: hip at 7 rad";
  EXPECT_EQ(thigh.parent, "base");
  EXPECT_EQ(thigh.link, "thigh");
  const double s = std::sin(3.5) * half, c = std::cos(3.5) * half;
  const std::array<double, 7> turned{1, 2, 3, c, s, s, c};  // (x, 1) times (y s, c)
  for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(thigh.place[i], turned[i], 1e-12) << i;

  const Transform moved =
      transform_of(View({.urdf = "<robot/>", .links = {slides}}).of("/tf")[1].second);
  const std::array<double, 7> along{1, 2, 3 + 2.0 * 7.0 + 1.0, half, 0, 0, half};  // its y is z
  for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(moved.place[i], along[i], 1e-12) << i;
}

TEST(RobotView, LeavesOutABaseWhosePlaceIsNoNumber) {
  hal::TruthImage truth(2, 0);
  truth.base_quaternion()[3] = std::numeric_limits<double>::quiet_NaN();
  RobotView view({.urdf = "<robot/>", .base_link = "pelvis"}, {"hip", "knee"});
  view.take_channel(3, "/tandem/truth", truth.layout());
  view.follow(3, 0, truth.bytes(), [](auto, auto) { ADD_FAILURE() << "a message"; });
  truth.base_quaternion()[3] = 1.0;
  int messages = 0;
  view.follow(3, 20'000'000, truth.bytes(), [&](auto, auto) { ++messages; });
  EXPECT_EQ(messages, 1);
}

}  // namespace
}  // namespace tandem::log
