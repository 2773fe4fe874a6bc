// Bags as other programs leave them: in ROS 1's encoding, in JSON, without types, compressed
// message by message, of several topics, with a joint twice. The messages are made here, byte by
// byte.
#include <cstring>
#include <functional>

#include "base/bounds.hpp"
#include "log/compression.hpp"
#include "log/mcap_writer.hpp"
#include "tests/log_import/rig.hpp"
#include "tests/support/little_room.hpp"

namespace tandem::log {
namespace {

using namespace test;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr int kMessages = 50;
const std::string kStamped = "[time]\nperiod_s = 0.01\n[bag]\nstamp = \"header\"\n";
const std::string kType = "sensor_msgs/msg/JointState";

double angle_of(std::size_t joint, int i) {
  return 0.1 * std::sin(0.02 * i + static_cast<double>(joint));
}
double rate_of(std::size_t joint, int i) {
  return 0.2 * std::cos(0.02 * i + static_cast<double>(joint));
}

template <class T>
std::string raw(T value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

struct Names {
  std::vector<std::string> list{"joint1", "joint2"};
  std::vector<std::size_t> joints{0, 1};
};

/// little-endian, as rosbag2 has it
std::string cdr(int i, const Names& names = {}) {
  std::string body;
  const auto align = [&](std::size_t n) { body.resize((body.size() + n - 1) / n * n, '\0'); };
  const auto number = [&](auto value) {
    align(sizeof value);
    body += raw(value);
  };
  const auto text = [&](const std::string& of) {
    number(static_cast<std::uint32_t>(of.size() + 1));
    body += of + std::string(1, '\0');
  };
  const std::int64_t stamp_ns = kStart_ns + i * 10'000'000;
  number(static_cast<std::int32_t>(stamp_ns / 1'000'000'000));
  number(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
  text("");
  number(static_cast<std::uint32_t>(names.list.size()));
  for (const std::string& name : names.list) text(name);
  for (const auto of : {&angle_of, &rate_of}) {
    number(static_cast<std::uint32_t>(names.joints.size()));
    for (const std::size_t joint : names.joints) number(of(joint, i));
  }
  number(std::uint32_t{0});
  return std::string("\0\1\0\0", 4) + body;
}

/// wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes: no padding, no zeros at the
/// ends of strings, and the header's number first.
std::string ros1(int i) {
  const std::int64_t stamp_ns = kStart_ns + i * 10'000'000;
  std::string body = raw(static_cast<std::uint32_t>(7 + i)) +
                     raw(static_cast<std::uint32_t>(stamp_ns / 1'000'000'000)) +
                     raw(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
  const auto text = [&](const std::string& of) {
    body += raw(static_cast<std::uint32_t>(of.size())) + of;
  };
  text("base");
  body += raw(std::uint32_t{2});
  text("joint1");
  text("joint2");
  for (const auto of : {&angle_of, &rate_of})
    body += raw(std::uint32_t{2}) + raw(of(0, i)) + raw(of(1, i));
  return body + raw(std::uint32_t{0});
}

std::string json(int i) {
  const std::int64_t stamp_ns = kStart_ns + i * 10'000'000;
  char text[512];
  std::snprintf(text, sizeof text,
                R"({"header":{"stamp":{"sec":%d,"nsec":%d},"frame_id":""},"name":["joint1",)"
                R"("joint2"],"position":[%.17g,%.17g],"velocity":[%.17g,%.17g],"effort":[null,)"
                R"("NaN"]})",
                static_cast<int>(stamp_ns / 1'000'000'000),
                static_cast<int>(stamp_ns % 1'000'000'000), angle_of(0, i), angle_of(1, i),
                rate_of(0, i), rate_of(1, i));
  return text;
}

/// As rosbag2's --compression-mode message leaves a message.
std::string packed(Compression by, const std::string& plain) {
  Bytes out;
  compress(by, std::as_bytes(std::span(plain)), out);
  return {reinterpret_cast<const char*>(out.data()), out.size()};
}

using Encode = std::function<std::string(int)>;
struct LoggedTopic {
  std::string name = "/joint_states", type = kType, encoding = "cdr";
  Encode encode = [](int i) { return cdr(i); };
};

class StrangeBag : public Import {
 protected:
  std::string bag(const std::vector<LoggedTopic>& topics, int times = 1) const {
    const std::string file = path("bag.mcap");
    McapWriter writer;
    EXPECT_TRUE(writer.open(file, {}));
    std::vector<std::uint16_t> channels;
    for (const LoggedTopic& one : topics) {
      // Channels without a schema have the number 0 for it.
      const std::uint16_t schema =
          one.type.empty() ? std::uint16_t{0} : writer.add_schema(one.type, "ros2msg", "");
      channels.push_back(writer.add_channel(schema, one.name, one.encoding));
    }
    for (int i = 0; i < kMessages * times; ++i) {
      for (std::size_t t = 0; t < topics.size(); ++t) {
        const std::string body = topics[t].encode(i / times);
        EXPECT_TRUE(writer.write(channels[t], kStart_ns + i / times * 10'000'000 + 1'000, {},
                                 std::as_bytes(std::span(body))));
      }
    }
    EXPECT_TRUE(writer.close());
    return file;
  }

  void expect_motion(const std::string& file, const std::string& map = kStamped) const {
    const ImportSummary done = imported({file}, map);
    EXPECT_EQ(done.cycles, static_cast<std::uint64_t>(kMessages));
    const TimeSeries read =
        table({{"position_rad", 0}, {"position_rad", 1}, {"velocity_rad_s", 1}});
    ASSERT_EQ(read.columns.at(0).size(), static_cast<std::size_t>(kMessages));
    for (int i = 0; i < kMessages; ++i) {
      EXPECT_EQ(read.columns[0][i], angle_of(0, i));
      EXPECT_EQ(read.columns[1][i], angle_of(1, i));
      EXPECT_EQ(read.columns[2][i], rate_of(1, i));
    }
  }
};

// "has no joint states of this robot" was said of each of these.
// source: facontidavide/PlotJuggler #878, PlotJuggler/plotjuggler-ros-plugins #90
TEST_F(StrangeBag, OfRos1IsRead) {
  expect_motion(bag({{.type = "sensor_msgs/JointState", .encoding = "ros1", .encode = ros1}}));
}

// source: rerun-io/rerun #12780
TEST_F(StrangeBag, InJsonIsRead) { expect_motion(bag({{.encoding = "json", .encode = json}})); }

TEST_F(StrangeBag, ItsTypeIsSpelledAsAnybodySpellsIt) {
  for (const char* type : {"sensor_msgs/JointState", "sensor_msgs::msg::dds_::JointState_", ""})
    expect_motion(bag({{.type = type}}));
  const std::string file = bag({{.name = "/arm", .type = ""}});
  EXPECT_EQ(refusal({file}, kStamped),
            "bag.mcap: has no joint states of this robot; it has /arm (no type, cdr) (record a "
            "topic of sensor_msgs/JointState, such as /joint_states; [bag] joint_states names one "
            "whose type is not said)");
  expect_motion(file, kStamped + "joint_states = \"/arm\"\n");
}

TEST_F(StrangeBag, OfAnEncodingThatIsNotReadNamesIt) {
  EXPECT_EQ(refusal({bag({{.encoding = "protobuf"}})}, kStamped),
            "bag.mcap: the topic '/joint_states' has messages of sensor_msgs/msg/JointState, "
            "encoding 'protobuf' (it must be sensor_msgs/msg/JointState in cdr, ros1 or json)");
}

TEST_F(StrangeBag, ThatIsDamagedIsRefusedInEveryEncoding) {
  const auto cut = [](const Encode& of) {
    return [of](int i) {
      const std::string whole = of(i);
      return i == 3 ? whole.substr(0, whole.size() - 1) : whole;
    };
  };
  EXPECT_HAS(refusal({bag({{.encoding = "ros1", .encode = cut(ros1)}})}, kStamped),
             "message 4 of /joint_states: 87 bytes are no sensor_msgs/msg/JointState of ROS 1");
  EXPECT_HAS(refusal({bag({{.encoding = "json", .encode = cut(json)}})}, kStamped),
             "message 4 of /joint_states:");
  EXPECT_HAS(
      refusal({bag({{.encoding = "json", .encode = [](int) { return R"({"name": [1]})"; }}})},
              kStamped),
      "'name' is no text");
  const std::string deep = std::string(100'000, '[');
  EXPECT_HAS(refusal({bag({{.encoding = "json", .encode = [&](int) { return deep; }}})}, kStamped),
             "has more than 32 levels");
}

// "not plain CDR (the file is damaged ...)" was said of it. source: ros2/rosbag2 #1533
TEST_F(StrangeBag, WhoseMessagesRosbag2CompressedIsRead) {
  for (const Compression by : {Compression::kZstd, Compression::kLz4}) {
    expect_motion(bag({{.encode = [by](int i) { return packed(by, cdr(i)); }}}));
    EXPECT_HAS(refusal({bag({{.encode =
                                  [by](int i) {
                                    const std::string all = packed(by, cdr(i));
                                    return all.substr(0, all.size() - 3);
                                  }}})},
                       kStamped),
               "message 1 of /joint_states: its compressed data are cut");
  }
}

TEST_F(StrangeBag, WhoseMessageUnpacksToFarMoreIsRefused) {
  const std::string zeros(bounds::kBagMessage.most + 1, '\0');
  for (const Compression by : {Compression::kZstd, Compression::kLz4}) {
    const std::string bomb = packed(by, zeros);
    const std::string file = bag({{.encode = [&](int i) { return i == 0 ? bomb : cdr(i); }}});
    EXPECT_HAS(refusal({file}, kStamped),
               "has more than 16777216 bytes in a message when unpacked");
  }
}

// It was "decompress it: zstd -d", which refuses this ending. source: ros2/rosbag2 #1920, #2445
TEST_F(StrangeBag, ThatWasCompressedAsAFileIsRead) {
  const std::string whole = text_of(bag({{}}));
  for (const auto& [by, name] :
       {std::pair{Compression::kZstd, "a.mcap.zstd"}, {Compression::kLz4, "a.mcap.lz4"}}) {
    const std::string all = packed(by, whole);
    expect_motion(write(name, all));
    EXPECT_HAS(refusal({write(name, all.substr(0, all.size() - 5))}, kStamped),
               std::string(name) + ": its compressed data are cut");
    EXPECT_HAS(refusal({write(name, packed(by, "t,q1\n"))}, kStamped), "is no MCAP file");
  }
  EXPECT_HAS(refusal({write("b.mcap.zstd", std::string("\x28\xB5\x2F\xFD....", 8))}, kStamped),
             "its compressed data are damaged");
}

TEST_F(StrangeBag, ThatUnpacksToFarMoreThanItIsIsRefused) {
  const std::string one = packed(Compression::kZstd, std::string(16 << 20, '\0'));
  std::string many;
  for (int i = 0; i < 20; ++i) many += one;
  EXPECT_HAS(refusal({write("a.mcap.zstd", many)}, kStamped),
             "a.mcap.zstd: has more than 500 times its size when unpacked");
}

LoggedTopic part(const std::string& name, std::size_t joint, const std::string& called) {
  return {.name = name, .encode = [=](int i) { return cdr(i, {{called}, {joint}}); }};
}

// source: UniversalRobots/Universal_Robots_ROS_Tutorials #10, frankarobotics/franka_ros #350
TEST_F(StrangeBag, WhoseJointsAreOnSeveralTopicsIsTakenTogether) {
  const std::string file =
      bag({part("/arm/joint_states", 0, "joint1"), part("/wrist/joint_states", 1, "joint2")});
  expect_motion(file);
  EXPECT_EQ(imported({file}, kStamped).notes,
            std::vector<std::string>{"joint states of /arm/joint_states, /wrist/joint_states"});
  expect_motion(file,
                kStamped + "joint_states = [\"/arm/joint_states\", \"/wrist/joint_states\"]\n");
  EXPECT_HAS(refusal({file}, kStamped + "joint_states = \"/arm/joint_states\"\n"),
             "lacks the robot's joint 'joint2'");
  EXPECT_HAS(refusal({file}, kStamped + "joint_states = [\"/arm/joint_states\", \"/wrist\"]\n"),
             "bag.joint_states: has no topic '/wrist'");
}

TEST_F(StrangeBag, WithAJointOnTwoTopicsAsksForOne) {
  const std::string file = bag({{}, part("/wrist/joint_states", 1, "joint2")});
  EXPECT_HAS(refusal({file}, kStamped),
             "bag.joint_states: the joint 'joint2' is in two topics of joint states: "
             "'/joint_states' and '/wrist/joint_states' (name those to take, one or a list: [bag] "
             "joint_states = \"/joint_states\")");
  expect_motion(file, kStamped + "joint_states = \"/joint_states\"\n");
}

// It was "this time was there before", and exclude = ["duplicates"] dropped the second value.
// source: facontidavide/PlotJuggler PR 927
TEST_F(StrangeBag, WithAJointTwiceInAMessageSaysSo) {
  const auto encode = [](int i) {
    return i == 4 ? cdr(i, {{"joint1", "joint2", "joint1"}, {0, 1, 1}}) : cdr(i);
  };
  const std::string file = bag({{.encode = encode}});
  for (const char* map : {"", "exclude = [\"duplicates\"]\n"}) {
    EXPECT_HAS(refusal({file}, map + kStamped), "message 5 of /joint_states names 'joint1' twice");
  }
  EXPECT_EQ(imported({file}, "exclude = [\"invalid\"]\n" + kStamped).excluded.invalid, 1U);
}

// It was the number of messages times that of the joints. source: foxglove/mcap #1374
TEST_F(StrangeBag, ThatWasRecordedTwiceLeavesMessagesOut) {
  const std::string file = bag({{}}, 2);
  EXPECT_HAS(refusal({file}, kStamped), "this time was there before");
  EXPECT_EQ(imported({file}, "exclude = [\"duplicates\"]\n" + kStamped).excluded.duplicates,
            static_cast<std::uint64_t>(kMessages));
}

// Those are in the /joint_states that Tandem publishes.
TEST_F(StrangeBag, TheRobotsFollowersAreKnown) {
  const Names names{{"joint1", "joint2", "finger"}, {0, 1, 0}};
  const std::string file = bag({{.encode = [&](int i) { return cdr(i, names); }}});
  EXPECT_HAS(refusal({file}, kStamped), "the recording's joint 'finger' is none of the robot's");
  robot_.followers = {{"finger", 0, 1.0, 0.0}};
  expect_motion(file);
}

TEST_F(StrangeBag, TheRobotsFollowersMayHaveOtherNames) {
  const Names names{{"joint1", "joint2", "f2"}, {0, 1, 0}};
  robot_.followers = {{"finger", 0, 1.0, 0.0}};
  const std::string file = bag({{.encode = [&](int i) { return cdr(i, names); }}});
  const std::string named = kStamped + "[bag.names]\nf2 = \"finger\"\n";
  EXPECT_EQ(imported({file}, named).excluded.ignored, std::vector<std::string>{"f2"});
}

// The advice was to leave it out of the recording.
TEST_F(StrangeBag, WhoseListsDifferInLengthLeavesMessagesOut) {
  const std::string file = bag({{.encode = [](int i) {
    return i == 7 ? cdr(i, {{"joint1", "joint2"}, {0}}) : cdr(i);
  }}});
  EXPECT_HAS(refusal({file}, kStamped),
             "message 8 of /joint_states has 2 names and 1 of position (its publisher is at fault; "
             "exclude = [\"invalid\"] leaves such messages out)");
  const ImportSummary done = imported({file}, "exclude = [\"invalid\"]\n" + kStamped);
  EXPECT_EQ(done.excluded.invalid, 1U);
}

TEST_F(StrangeBag, ThatNamesMoreJointsThanAnyRobotHasIsRefused) {
  Names many{{}, {}};
  for (std::size_t i = 0; i <= bounds::kLogNames.most; ++i) {
    many.list.push_back("j" + std::to_string(i));
    many.joints.push_back(0);
  }
  const std::string file = bag({{.encode = [&](int i) { return cdr(i, many); }}});
  EXPECT_HAS(refusal({file}, "ignore = [\"*\"]\n" + kStamped),
             "has more than 10000 joints and sensors, or channels of a sensor");
}

}  // namespace
}  // namespace tandem::log
