// Topics that feed inputs, in one process: a loop, its feeds, and another participant that writes.
#include "apps/run/input_topics.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <thread>

#include "controllers/controller_io.hpp"
#include "dds/endpoint.hpp"
#include "dds/service.hpp"
#include "hal/config/capabilities.hpp"
#include "tests/dds/cdr_sample.hpp"
#include "tests/dds/fastdds.hpp"
#include "tests/dds/raw_topic.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::apps {
namespace {

using dds::geometry_msgs::PoseStamped;
using dds::geometry_msgs::Twist;
using dds::geometry_msgs::WrenchStamped;
using dds::sensor_msgs::Joy;
using dds::std_msgs::Float64MultiArray;
using runtime::InputFeeder;
using runtime::RunPhase;

/// Does nothing but have an input.
class Listener : public Controller {
 public:
  Listener(InputKind kind, InputOptions options) : kind_(kind), options_(std::move(options)) {}
  Status configure(ControllerSetup& setup) override {
    input = setup.input("wish", kind_, options_);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {}
  Code update(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {
    return Code::kOk;
  }
  void archive(Archive&) override {}
  Input input;

 private:
  InputKind kind_;
  InputOptions options_;
};

const InputOptions kOneTwist{.max = {1.0}, .timeout_s = 60.0};
const InputOptions kTwo{.names = {"a", "b"}, .max = {10.0}, .timeout_s = 60.0};

struct InputTopic : testing::Test, runtime::test::JointRun {
  std::unique_ptr<dds::Participant> join(const char* name) const {
    auto joined = dds::Participant::open(domain, name);
    return std::move(joined.value());
  }
  void begin_with(bool everybody, InputKind kind = InputKind::kTwist,
                  const InputOptions& options = kOneTwist, const std::string& type = {},
                  const std::string& frame = {}) {
    const runtime::InputSource source{.name = "wish",
                                      .feeder = InputFeeder::kTopic,
                                      .topic = "cmd_vel",
                                      .type = type,
                                      .frame = frame};
    auto made = std::make_shared<Listener>(kind, options);
    listener = made.get();
    ASSERT_TRUE(host->add("one", std::move(made), runtime::test::parameters(), true,
                          std::span(&source, 1)));
    begin();
    (void)until(RunPhase::kRunning);
    admission.emplace(everybody);
    const auto gate = [this](const std::string&, ControlEffect, const Json&) -> Status {
      return owned ? fail("somebody commands the robot") : Status();
    };
    auto opened = InputTopics::open(own.get(), services(), gate, *admission);
    ASSERT_TRUE(opened) << opened.error().to_string();
    topics = std::move(*opened);
  }
  [[nodiscard]] runtime::InputLook look() { return services().inputs().front().look; }
  [[nodiscard]] std::string why() { return look().why; }
  /// Cycles until `there`; `act` before each.
  template <class There, class Act>
  bool until_there(const There& there, const Act& act) {
    for (int i = 0; i < 1000; ++i) {
      act();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      steps(1);
      if (there()) return true;
    }
    return false;
  }
  /// Writes and cycles until `there`.
  template <class Message, class There>
  bool write_until(dds::Writer<Message>& writer, const Message& message, const There& there) {
    return until_there(there, [&] { EXPECT_TRUE(writer.write(message)); });
  }
  /// Whether `message` is refused with these words, and nothing reaches the controller.
  template <class Message>
  bool is_refused(dds::Writer<Message>& writer, const Message& message, const char* words) {
    const std::vector<double> before = values();
    const std::uint64_t refused = look().counts.refused;
    const bool told = write_until(writer, message, [&] { return why().contains(words); });
    EXPECT_TRUE(told) << words << ": " << why();
    EXPECT_GT(look().counts.refused, refused) << words;
    EXPECT_EQ(values(), before) << words;
    return told;
  }
  template <class Message>
  dds::Writer<Message> writer() {
    return dds::Writer<Message>::create(*peer, "rt/cmd_vel", {}).value();
  }
  [[nodiscard]] std::vector<double> values() const {
    const auto all = listener->input.values();
    return {all.begin(), all.end()};
  }
  static Twist yaw(double rad_s) { return {.linear = {}, .angular = {0.0, 0.0, rad_s}}; }

  std::shared_ptr<dds::Domain> domain = dds::Domain::open(dds::test::own_config()).value();
  std::unique_ptr<dds::Participant> own = join("run"), peer = join("teleop");
  std::optional<DdsAdmission> admission;
  std::atomic<bool> owned{false};
  Listener* listener = nullptr;
  std::unique_ptr<InputTopics> topics;
};

TEST_F(InputTopic, IsTakenOfOneNodeAtATime) {
  begin_with(true);
  auto writer = dds::Writer<Twist>::create(*peer, "rt/cmd_vel", {}).value();
  EXPECT_TRUE(write_until(writer, yaw(0.5), [&] { return listener->input.fresh(); }));
  EXPECT_EQ(listener->input[5], 0.5);
  auto other = dds::Writer<Twist>::create(*peer, "rt/cmd_vel", {}).value();
  EXPECT_TRUE(write_until(other, yaw(0.1), [&] { return why().contains("another node"); }));
  EXPECT_EQ(listener->input[5], 0.5);
  EXPECT_TRUE(
      write_until(writer, yaw(std::nan("")), [&] { return why().contains("yaw: is not"); }));
  EXPECT_TRUE(write_until(writer, yaw(2.0), [&] { return why().contains("yaw: 2 is beyond"); }));
  EXPECT_EQ(listener->input[5], 0.5);
  owned = true;
  EXPECT_TRUE(write_until(writer, yaw(0.2), [&] { return why().contains("commands the robot"); }));
  EXPECT_EQ(listener->input[5], 0.5);
  owned = false;
  EXPECT_TRUE(write_until(writer, yaw(0.2), [&] { return listener->input[5] == 0.2; }));
}

TEST_F(InputTopic, OfAStrangerIsRefusedUntilHeIsAdmitted) {
  begin_with(false);
  auto writer = dds::Writer<Twist>::create(*peer, "rt/cmd_vel", {}).value();
  EXPECT_TRUE(write_until(writer, yaw(0.5), [&] { return why().contains("stranger"); }));
  EXPECT_EQ(listener->input.sequence(), 0U);
  admission->admit(dds::id_of(*peer));
  EXPECT_TRUE(write_until(writer, yaw(0.5), [&] { return listener->input.fresh(); }));
}

const double kNaN = std::nan("");

TEST_F(InputTopic, APoseIsTakenInItsFrameWithAUnitQuaternion) {
  begin_with(true, InputKind::kPose, {.max = {2.0}, .timeout_s = 60.0}, {}, "base");
  auto poses = writer<PoseStamped>();
  std::string base = "base", hand = "hand", none;
  PoseStamped pose{};
  pose.header.frame_id = base.data();
  pose.pose = {.position = {0.1, -0.2, 0.3}, .orientation = {0.6, 0.0, 0.0, 0.8}};
  EXPECT_TRUE(write_until(poses, pose, [&] { return listener->input.fresh(); })) << why();
  const std::vector<double> taken{0.1, -0.2, 0.3, 0.6, 0.0, 0.0, 0.8};
  EXPECT_EQ(values(), taken);
  pose.pose.position.x = 0.2;
  pose.header.frame_id = hand.data();
  EXPECT_TRUE(is_refused(poses, pose, "'hand' is not the frame 'base'"));
  pose.header.frame_id = none.data();
  EXPECT_TRUE(is_refused(poses, pose, "'' is not the frame 'base'"));
  pose.header.frame_id = base.data();
  pose.pose.orientation.w = 0.0;
  EXPECT_TRUE(is_refused(poses, pose, "have a norm of 0.6"));
  pose.pose.orientation = {0.0, 0.0, 0.0, 0.0};
  EXPECT_TRUE(is_refused(poses, pose, "have a norm of 0,"));
  pose.pose.orientation = {0.0, kNaN, 0.0, 1.0};
  EXPECT_TRUE(is_refused(poses, pose, "qy: is not finite"));
  pose.pose.orientation = {0.0, 0.0, 0.0, 1.0};
  pose.pose.position.y = 2.5;
  EXPECT_TRUE(is_refused(poses, pose, "y: 2.5 is beyond its bounds"));
  EXPECT_EQ(values(), taken);
}

TEST_F(InputTopic, AWrenchIsTakenInItsFrame) {
  begin_with(true, InputKind::kWrench, {.max = {50.0}, .timeout_s = 60.0});
  auto wrenches = writer<WrenchStamped>();
  std::string frame;
  WrenchStamped wrench{};
  wrench.header.frame_id = frame.data();
  wrench.wrench = {.force = {1.0, 2.0, 3.0}, .torque = {4.0, 5.0, 6.0}};
  EXPECT_TRUE(write_until(wrenches, wrench, [&] { return listener->input.fresh(); })) << why();
  EXPECT_EQ(values(), (std::vector<double>{1, 2, 3, 4, 5, 6}));
  wrench.wrench.torque.z = -std::numeric_limits<double>::infinity();
  EXPECT_TRUE(is_refused(wrenches, wrench, "tz: is not finite"));
  frame = "tool";
  wrench.header.frame_id = frame.data();
  EXPECT_TRUE(is_refused(wrenches, wrench, "'tool' is not the frame ''"));
}

TEST_F(InputTopic, NumbersHaveTheInputsCount) {
  begin_with(true, InputKind::kNumbers, kTwo);
  auto arrays = writer<Float64MultiArray>();
  std::array<double, 3> numbers{1.5, -2.5, 3.5};
  Float64MultiArray array{};
  array.data = {2, 2, numbers.data(), false};
  EXPECT_TRUE(write_until(arrays, array, [&] { return listener->input.fresh(); })) << why();
  EXPECT_EQ(values(), (std::vector<double>{1.5, -2.5}));
  for (const std::uint32_t count : {0U, 1U, 3U}) {
    array.data._length = count;
    array.data._maximum = 3;
    const std::string words = "data: has " + std::to_string(count) + " numbers, and the input 2";
    EXPECT_TRUE(is_refused(arrays, array, words.c_str()));
  }
  array.data._length = 2;
  array.layout.data_offset = 1;
  EXPECT_TRUE(is_refused(arrays, array, "layout.data_offset"));
  array.layout.data_offset = 0;
  numbers[1] = kNaN;
  EXPECT_TRUE(is_refused(arrays, array, "b: is not finite"));
}

TEST_F(InputTopic, AJoysticksAxesAreNumbersAndItsButtonsButtons) {
  std::array<float, 3> axes{0.5F, -1.0F, 0.25F};
  std::array<std::int32_t, 3> down{1, 0, 1};
  std::string frame = "joy";
  Joy joy{};
  joy.header.frame_id = frame.data();
  joy.axes = {3, 3, axes.data(), false};
  joy.buttons = {3, 3, down.data(), false};
  begin_with(true, InputKind::kNumbers, kTwo, "sensor_msgs/msg/Joy");
  {
    auto pads = writer<Joy>();
    EXPECT_TRUE(write_until(pads, joy, [&] { return listener->input.fresh(); })) << why();
    EXPECT_EQ(values(), (std::vector<double>{0.5, -1.0})) << "the first ones";
    joy.axes._length = 1;
    EXPECT_TRUE(is_refused(pads, joy, "axes: has 1 numbers, and the input 2"));
  }
  topics.reset();
  of(hal::test::fake_robot());
  begin_with(true, InputKind::kButtons, {.names = {"go", "halt"}, .timeout_s = 60.0});
  auto pads = writer<Joy>();
  EXPECT_TRUE(write_until(pads, joy, [&] { return listener->input.fresh(); })) << why();
  EXPECT_EQ(values(), (std::vector<double>{1.0, 0.0}));
  down[1] = 2;
  EXPECT_TRUE(is_refused(pads, joy, "halt: 2 is beyond its bounds"));
  joy.buttons._length = 0;
  EXPECT_TRUE(is_refused(pads, joy, "buttons: has 0 numbers"));
}

/// Nobody here wrote the encoder: Fast DDS with types of its own generator.
TEST_F(InputTopic, OfAnotherImplementationIsTakenAndRefused) {
  if (!dds::test::have_fastdds()) GTEST_SKIP() << dds::test::kNoFastDds;
  const auto nothing = [] {};
  const auto peer_says = [](const std::string& type) {
    return std::vector<std::string>{"say", "best_effort", type, "rt/cmd_vel"};
  };
  {
    begin_with(true, InputKind::kWrench, {.max = {5.0}, .timeout_s = 60.0}, {}, "s3");
    const dds::test::FastDdsPeer other(peer_says("geometry_msgs/msg/WrenchStamped"));
    EXPECT_TRUE(until_there([&] { return listener->input.fresh(); }, nothing)) << why();
    EXPECT_EQ(values(), (std::vector<double>{1.0, 1.25, 1.5, 1.75, 2.0, 2.25}));
  }
  for (const InputKind kind : {InputKind::kNumbers, InputKind::kButtons}) {
    topics.reset();
    of(hal::test::fake_robot());
    begin_with(true, kind, kTwo, "sensor_msgs/msg/Joy");
    const dds::test::FastDdsPeer other(peer_says("sensor_msgs/msg/Joy"));
    EXPECT_TRUE(until_there([&] { return listener->input.fresh(); }, nothing)) << why();
    const bool axes = kind == InputKind::kNumbers;
    EXPECT_EQ(values(), axes ? std::vector({1.0, 1.25}) : std::vector({6.0, 7.0}));
  }
  topics.reset();
  of(hal::test::fake_robot());
  begin_with(true, InputKind::kPose, {.timeout_s = 60.0}, {}, "s3");
  const dds::test::FastDdsPeer other(peer_says("geometry_msgs/msg/PoseStamped"));
  EXPECT_TRUE(until_there([&] { return why().contains("norm"); }, nothing)) << why();
  EXPECT_EQ(listener->input.sequence(), 0U);
}

/// Cyclone DDS says nothing of samples that newer ones push out of a reader.
TEST_F(InputTopic, OfAFloodTheNewestCountsAndEveryOtherIsCounted) {
  begin_with(true, InputKind::kNumbers, {.names = {"a"}, .timeout_s = 60.0});
  auto arrays = writer<Float64MultiArray>();
  ASSERT_TRUE(until_there([&] { return arrays.endpoint().matched() > 0; }, [] {}));
  constexpr std::uint64_t kFlood = 50'000;
  std::thread flood([&] {
    double number = 0.0;
    Float64MultiArray array{};
    array.data = {1, 1, &number, false};
    for (std::uint64_t i = 1; i <= kFlood; ++i) {
      number = static_cast<double>(i);
      EXPECT_TRUE(arrays.write(array));
    }
  });
  double before = 0.0;
  const auto told = [&] {
    const runtime::InputCounts counts = look().counts;
    return counts.arrived + counts.superseded + counts.refused;
  };
  EXPECT_TRUE(until_there([&] { return told() == kFlood; },
                          [&] {
                            EXPECT_GE(listener->input[0], before) << "an older one after a newer";
                            before = listener->input[0];
                          }))
      << told();
  flood.join();
  EXPECT_EQ(listener->input[0], static_cast<double>(kFlood));
  EXPECT_EQ(look().counts.refused, 0U);
  EXPECT_LT(look().counts.arrived, kFlood / 2);
  std::printf("%llu samples: %llu arrived, %llu superseded\n",
              static_cast<unsigned long long>(kFlood),
              static_cast<unsigned long long>(look().counts.arrived),
              static_cast<unsigned long long>(look().counts.superseded));
}

/// By topic and by `tandem input` alike; what was told before times out into the declared hold.
TEST_F(InputTopic, WhileAnotherProcessOwnsTheRobotSamplesAreRefusedByItsName) {
  begin_with(true, InputKind::kNumbers, {.names = {"a"}, .timeout_s = 0.05, .otherwise = {-1.0}});
  auto arrays = writer<Float64MultiArray>();
  double number = 3.0;
  Float64MultiArray array{};
  array.data = {1, 1, &number, false};
  EXPECT_TRUE(write_until(arrays, array, [&] { return listener->input[0] == 3.0; })) << why();
  std::atomic<bool> held{true};
  services().name_owner([&] { return held ? std::string("teleop_lab") : std::string(); });
  EXPECT_TRUE(is_refused(arrays, array, "'teleop_lab' commands the robot"));
  steps(51);
  EXPECT_FALSE(listener->input.fresh());
  EXPECT_EQ(listener->input[0], -1.0);
  EXPECT_EQ(look().counts.timed_out, 1U);
  const std::uint64_t refused = look().counts.refused;
  const auto set =
      services().set_input("wish", {.components = {"a"}, .numbers = {1.0}}, runtime::test::kNow);
  ASSERT_FALSE(set);
  EXPECT_NE(set.error().to_string().find("'teleop_lab' commands the robot"), std::string::npos);
  EXPECT_EQ(look().counts.refused, refused + 1);
  held = false;
  EXPECT_TRUE(write_until(arrays, array, [&] { return listener->input[0] == 3.0; })) << why();
}

/// A new kind or a new type is a row; a source that names another is refused with the nearest.
TEST(InputMessages, BringEveryKind) {
  for (std::size_t kind = 0; kind < std::size(kInputKinds); ++kind) {
    const auto message = runtime::message_of(static_cast<InputKind>(kind), {});
    ASSERT_TRUE(message) << kInputKinds[kind].name;
    EXPECT_EQ((*message)->kind, static_cast<InputKind>(kind));
  }
  const auto why = [](InputKind kind, const runtime::InputSource& source) {
    const auto message = runtime::message_of(kind, source);
    return message ? std::string() : message.error().to_string();
  };
  EXPECT_NE(why(InputKind::kPose, {.name = {}, .type = "geometry_msgs/msg/PoseStampd"})
                .find("PoseStamped"),
            std::string::npos);
  EXPECT_NE(why(InputKind::kTwist, {.name = {}, .frame = "base"}).find("name no frame"),
            std::string::npos);
  EXPECT_EQ(why(InputKind::kTwist,
                {.name = {}, .type = "geometry_msgs/msg/TwistStamped", .frame = "base"}),
            "");
}

/// The same of goals, which name joints that there are, and numbers that may be right.
TEST_F(InputTopic, AnyGoalIsTakenWholeOrRefused) {
  using Request = dds::control_msgs::FollowJointTrajectory_SendGoal_Request;
  std::mt19937_64 random(12);
  const InputOptions options{.names = {"shoulder", "elbow"}, .most_points = 2, .terms = true};
  const InputBlock block("wish", InputKind::kTrajectory, options);
  auto io = std::make_shared<ControllerIo>();
  io->inputs.declare("wish", InputKind::kTrajectory, options);
  const auto port = runtime::InputPort::make(io, io->inputs.all.front(), "one",
                                             hal::robot_of(robot), 1'000'000, nullptr);
  ASSERT_TRUE(port) << port.error().to_string();
  const dds::Type& type = dds::type<Request>();
  const dds::test::Codec codec(*own, type);
  const dds::test::Filling any{
      .next = [&] { return random() % 8 == 0 ? random() : 0; },
      .elements = [&] { return static_cast<std::uint32_t>(random() % 8 == 0 ? 1 : 0); }};
  std::size_t taken = 0, refused = 0;
  std::array<std::string, 2> names{"elbow", "shoulder"};
  for (int i = 0; i < 5000; ++i) {
    const auto message = codec.sample(dds::test::CdrWriter(any).sample(*type.tree));
    ASSERT_TRUE(message);
    auto& goal = static_cast<Request*>(message->get())->goal;
    const auto restored = goal.trajectory;
    std::array<char*, 2> texts{names[0].data(), names[random() % 2].data()};
    std::array<double, 2> place{0.1, static_cast<double>(random() % 5) - 1.0};
    std::array<trajectory_msgs_msg_dds__JointTrajectoryPoint_, 2> points{};
    const auto joints = static_cast<std::uint32_t>(random() % 3);
    for (auto& point : points) {
      point.positions = {joints, joints, place.data(), false};
      point.time_from_start.sec = static_cast<std::int32_t>(random() % 4);
    }
    goal.trajectory.joint_names = {joints, joints, texts.data(), false};
    const auto count = static_cast<std::uint32_t>(random() % 3);
    goal.trajectory.points = {count, count, points.data(), false};
    const auto sample = runtime::goal_sample(goal, block, 1'000'000'000);
    ASSERT_TRUE(!sample || sample->size() == block.values());
    ++(sample && (*port)->check(*sample) ? taken : refused);
    goal.trajectory = restored;  // whose memory it is
  }
  EXPECT_GT(taken, 50U);
  EXPECT_GT(refused, 50U);
}

/// Lengths, texts and numbers at random, decoded by Cyclone DDS: taken whole and within the bounds,
/// or refused.
TEST_F(InputTopic, AnyMessageOfEveryTypeIsTakenWholeOrRefused) {
  std::mt19937_64 random(11);
  const dds::test::Filling any{
      .next = [&] { return random() % 4 == 0 ? random() : random() % 9; },
      .elements = [&] { return static_cast<std::uint32_t>(random() % 4); }};
  std::size_t taken = 0, refused = 0;
  for (const runtime::InputMessage& row : runtime::input_messages()) {
    const dds::Type& type = row.type();
    InputOptions options{.names = {"shoulder", "elbow"}, .max = {2.0}, .most_points = 2};
    auto io = std::make_shared<ControllerIo>();
    io->inputs.declare("wish", row.kind, options);
    const runtime::InputSource source{
        .name = "wish", .feeder = InputFeeder::kTopic, .topic = "t", .type = type.ros_name};
    const auto port = runtime::InputPort::make(io, io->inputs.all.front(), "one",
                                               hal::robot_of(robot), 1'000'000, &source);
    ASSERT_TRUE(port) << type.ros_name << port.error().to_string();
    const dds::test::Codec codec(*own, type);
    for (int i = 0; i < 2000; ++i) {
      const auto message = codec.sample(dds::test::CdrWriter(any).sample(*type.tree));
      ASSERT_TRUE(message) << type.ros_name;
      const auto sample = row.sample(message->get(), (*port)->input(), source);
      ASSERT_TRUE(!sample || sample->size() == (*port)->input().values()) << type.ros_name;
      ++(sample && (*port)->check(*sample) ? taken : refused);
    }
  }
  EXPECT_GT(taken, 1000U);
  EXPECT_GT(refused, 1000U);
}

}  // namespace
}  // namespace tandem::apps
