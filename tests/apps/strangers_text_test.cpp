// What others wrote does not reach a terminal or a page as an order.
#include "log/mcap_writer.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

/// Clears the screen, turns what follows round, and writes a line of its own.
const std::string kOrder = "r\033[2J\u202eb\u009b1m\x7f\nerror: no such robot\r\xff";

struct StrangersText : Program {
  /// A log whose every text is one of those.
  void write_log() const {
    log::McapWriter writer;
    ASSERT_TRUE(writer.open((folder_ / "log.mcap").string(), {}));
    writer.add_metadata("tandem", {{"version", kOrder},
                                   {"robot", kOrder},
                                   {"hal", kOrder},
                                   {"joints", "joint\033[2J\n"},
                                   {"sensors", "wrist\u202e 6\n"},
                                   {"kernel_variant", kOrder},
                                   {"period_ns", "1000000"}});
    const auto schema = writer.add_schema("t/msg/" + kOrder, "ros2msg", "float64 value\n");
    const auto channel = writer.add_channel(schema, "/t" + kOrder, "cdr");
    const std::string head("\0\1\0\0", 4), body(8, '\0');
    ASSERT_TRUE(
        writer.write(channel, 0, std::as_bytes(std::span(head)), std::as_bytes(std::span(body))));
    writer.add_metadata("result", {{"verdict", kOrder}, {kOrder, kOrder}});
    ASSERT_TRUE(writer.close());
  }

  static void expect_no_order(const std::string& text) {
    for (const char* order : {"\033", "\u202e", "\u009b", "\x7f", "\r", "\xff", "\nerror: no such"})
      EXPECT_EQ(text.find(order), std::string::npos) << text;
  }
};

TEST_F(StrangersText, OfALogIsShownAndNotObeyed) {
  write_log();
  for (const char* command : {"log info log.mcap", "log csv log.mcap", "log diff log.mcap log.mcap",
                              "log csv log.mcap --topic nothing", "report log.mcap",
                              "identify log.mcap --robot robot.toml --out there"}) {
    const Outcome outcome = tandem(command);
    EXPECT_GE(outcome.status, 0) << command;
    expect_no_order(outcome.out);
    expect_no_order(outcome.err);
  }
  EXPECT_NE(tandem("log info log.mcap").out.find("r\\u001b[2J\\u202eb\\u009b1m\\u007f\\nerror"),
            std::string::npos);
}

// The name of one of the two robots was printed as it is.
TEST_F(StrangersText, OfTwoLogsIsWithinItsLine) {
  for (const char* joint : {"a,b", "c"}) {
    log::McapWriter writer;
    const std::string name = *joint == 'a' ? "a.mcap" : "b.mcap";
    ASSERT_TRUE(writer.open((folder_ / name).string(), {}));
    writer.add_metadata("tandem", {{"robot", kOrder},
                                   {"joints", *joint == 'a' ? "a,b\n" : "c\nd\n"},
                                   {"period_ns", "1000000"}});
    const auto schema = writer.add_schema("tandem/msg/State", "ros2msg", "float64 position_rad\n");
    const auto channel = writer.add_channel(schema, "/tandem/state", "cdr");
    const std::string head("\0\1\0\0", 4), body(8, '\0');
    ASSERT_TRUE(
        writer.write(channel, 0, std::as_bytes(std::span(head)), std::as_bytes(std::span(body))));
    ASSERT_TRUE(writer.close());
  }
  const Outcome outcome = tandem("log diff a.mcap b.mcap");
  EXPECT_NE(outcome.out.find("these are logs of different robots: r\\u001b[2J"), std::string::npos)
      << outcome.out;
  expect_no_order(outcome.out);
  EXPECT_EQ(tandem("log csv a.mcap").out.substr(0, 28), "time_s,\"position_rad.a,b\"\n0,");
}

/// A bag whose topics and joints have such names, in the summary and in every refusal.
TEST_F(StrangersText, OfABagIsWithinItsLine) {
  const std::string encoding = "json";
  log::McapWriter writer;
  ASSERT_TRUE(writer.open((folder_ / "bag.mcap").string(), {}));
  const auto schema = writer.add_schema("sensor_msgs/msg/JointState", "", "");
  const auto joints = writer.add_channel(schema, "/joint_states" + kOrder, encoding);
  const auto other = writer.add_channel(writer.add_schema(kOrder, "", ""), kOrder, kOrder);
  const std::string stranger = nlohmann::json(kOrder.substr(0, kOrder.size() - 1)).dump();
  for (int i = 0; i < 20; ++i) {
    const std::string body = R"({"name": ["joint1", "joint2", )" + stranger +
                             R"(], "position": [)" + std::to_string(0.001 * i) + ", " +
                             std::to_string(0.002 * i) + ", 0]}";
    for (const auto channel : {joints, other})
      ASSERT_TRUE(writer.write(channel, i * 10'000'000, {}, std::as_bytes(std::span(body))));
  }
  ASSERT_TRUE(writer.close());
  const std::string command = "log import bag.mcap --robot robot.toml --map map.toml";
  const std::string rest = "[time]\nperiod_s = 0.01\n[bag]\nstamp = \"log\"\n";
  for (const std::string& map : {rest, rest + "joint_states = \"/none\"\n",
                                 "ignore = [\"*\"]\n" + rest + "[bag.names]\nx = \"joint1\"\n"}) {
    write_text(folder_ / "map.toml", map);
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2);
    expect_no_order(outcome.err);
  }
  write_text(folder_ / "map.toml", "ignore = [\"*\"]\n" + rest);
  const Outcome outcome = tandem(command);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("not used"), std::string::npos);
  expect_no_order(outcome.out);
  expect_no_order(tandem("log info runs/double_pendulum-bag.mcap").out);
}

TEST_F(StrangersText, IsTheSameTextInJson) {
  write_log();
  const Outcome outcome = tandem("log info log.mcap --json -");
  expect_no_order(outcome.out);
  const std::string robot = nlohmann::json::parse(outcome.out)["metadata"]["robot"];
  EXPECT_EQ(robot, kOrder.substr(0, kOrder.size() - 1) + "\uFFFD");
}

TEST_F(StrangersText, OfFilesAndTheirNamesIsShownAndNotObeyed) {
  const std::string written = "\"r\\u001b[2J\\u202eb\\nerror: no such robot\"";
  edit("robot.toml", "[model]", "[model]\n" + written + " = 1");
  edit("hold.toml", "plugin = \"hold\"", "plugin = " + written);
  write_text(folder_ / "odd.urdf",
             "<robot name='r'><link name='l\u202e&#27;&#10;error: no such'/></robot>");
  write_text(folder_ / ("a" + kOrder + ".toml"), "x = \n");
  for (const char* command :
       {"check robot.toml", "check hold.toml", "run hold.toml", "new odd.urdf", "check *error*",
        "log info *error*", "eds show *error*", "report *error*"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2) << command;
    expect_no_order(outcome.out);
    expect_no_order(outcome.err);
    EXPECT_FALSE(outcome.err.empty());
  }
}

/// Bytes of one character that leave a buffer one after the other are one character.
TEST_F(StrangersText, KeepsCharactersThatABufferParts) {
  std::string names;
  for (int i = 0; i < 3'000; ++i) names += "ä中…";
  write_text(folder_ / "long.toml", "\"" + names.substr(0, 240) + "\" = 1\n" + names);
  const Outcome outcome = tandem("check long.toml");
  EXPECT_EQ(outcome.out.find("\\x"), std::string::npos);
  EXPECT_EQ(outcome.err.find("\\x"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tandem::apps
