// Foxglove's protocol without a network, and who may speak it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "studio/foxglove/assets.hpp"
#include "studio/foxglove/hub.hpp"
#include "studio/http_rules.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::studio::foxglove {
namespace {

using FoxJson = nlohmann::ordered_json;

template <class T>
T number_in(const std::string& bytes, std::size_t at) {
  T value{};
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// A server with two channels, of which the second keeps its last message, and a client.
struct FoxgloveRig {
  FoxgloveRig() {
    hub.start({.publish = [this](bool again) { asked_again = again; },
               .time_ns = [this] { return time_ns; },
               .parameter_version = [this] { return version; },
               .parameters = [this] { return parameters; },
               .asset = [](const std::string& uri) -> Result<std::string> {
                 if (uri == "package://pair/foot.stl") return "solid";
                 return fail("no " + uri);
               }});
    client = hub.connect("it");
    tick();
  }
  void tick() { hub.tick(now += std::chrono::milliseconds(33)); }
  void say(const FoxJson& message) { hub.receive(client, message.dump(), false, now); }
  void subscribe(std::uint32_t id, ChannelId channel) {
    say({{"op", "subscribe"},
         {"subscriptions", FoxJson::array({{{"id", id}, {"channelId", channel}}})}});
  }
  /// Everything that waits: texts by op, frames by kind.
  void read() {
    texts.clear();
    frames.clear();
    while (const auto frame = hub.next(client)) {
      if (frame->binary) {
        frames[frame->bytes->front()].push_back(*frame->bytes);
      } else {
        FoxJson text = FoxJson::parse(*frame->bytes);
        texts[text.at("op")].push_back(std::move(text));
      }
    }
  }

  Hub hub{{.name = "tandem", .session = "0123abcd", .time = true}};
  ChannelId often = hub.open({"/often", "std_msgs/msg/String", "string data", 0});
  ChannelId kept = hub.open({"/kept", "std_msgs/msg/String", "string data", 1});
  std::int64_t time_ns = 5;
  std::uint64_t version = 1;
  std::vector<Parameter> parameters{{"wave.depth_m", 0.5}, {"wave.cycles", std::int64_t{3}}};
  bool asked_again = false;
  Hub::ClientNumber client = 0;
  Hub::Clock::time_point now;
  std::map<std::string, std::vector<FoxJson>> texts;
  std::map<int, std::vector<std::string>> frames;
};

TEST(Foxglove, TellsWhatItIsAndItsChannelsAsTheyComeAndGo) {
  FoxgloveRig rig;
  rig.read();
  const FoxJson& info = rig.texts["serverInfo"].at(0);
  EXPECT_EQ(info["sessionId"], "0123abcd");
  EXPECT_EQ(info["capabilities"], FoxJson({"parameters", "parametersSubscribe", "assets", "time"}));
  const FoxJson& channel = rig.texts["advertise"].at(0)["channels"][0];
  EXPECT_EQ(channel, FoxJson({{"id", rig.often},
                              {"topic", "/often"},
                              {"encoding", "cdr"},
                              {"schemaName", "std_msgs/msg/String"},
                              {"schema", "string data"},
                              {"schemaEncoding", "ros2msg"}}));
  EXPECT_EQ(number_in<std::uint64_t>(rig.frames[2].at(0), 1), 5U) << "the run's time";
  rig.subscribe(7, rig.often);
  rig.hub.put(rig.often, 6, "last");
  rig.hub.close(rig.often);
  const ChannelId other = rig.hub.open({"/often", "std_msgs/msg/String", "string data", 0});
  EXPECT_NE(other, rig.often);
  rig.tick();
  rig.read();
  EXPECT_EQ(rig.frames[1].size(), 1U) << "what was said before the end arrives";
  EXPECT_EQ(rig.texts["unadvertise"].at(0)["channelIds"], FoxJson({rig.often}));
  EXPECT_EQ(rig.texts["advertise"].at(0)["channels"].size(), 1U);
  EXPECT_FALSE(rig.hub.wanted(rig.often));
}

TEST(Foxglove, GivesMessagesToWhoHasSubscribed) {
  FoxgloveRig rig;
  rig.hub.put(rig.often, 1, "nobody");
  rig.hub.put(rig.kept, 2, "old");
  rig.hub.put(rig.kept, 3, "kept");
  EXPECT_FALSE(rig.hub.wanted(rig.often));
  rig.subscribe(7, rig.often);
  rig.subscribe(8, rig.kept);
  EXPECT_TRUE(rig.hub.wanted(rig.often));
  rig.tick();
  EXPECT_TRUE(rig.asked_again) << "also where time stands it has something to show";
  rig.tick();
  EXPECT_FALSE(rig.asked_again);
  rig.hub.put(rig.often, 4, "news");
  rig.read();
  ASSERT_EQ(rig.frames[1].size(), 2U);
  EXPECT_EQ(rig.frames[1][0], std::string("\x01\x08\0\0\0\x03\0\0\0\0\0\0\0kept", 17));
  EXPECT_EQ(rig.frames[1][1], std::string("\x01\x07\0\0\0\x04\0\0\0\0\0\0\0news", 17));
  rig.hub.put(rig.often, 5, "waits");
  rig.say({{"op", "unsubscribe"}, {"subscriptionIds", {7}}});
  rig.hub.put(rig.often, 6, "nobody");
  rig.read();
  EXPECT_TRUE(rig.frames[1].empty());
  EXPECT_TRUE(rig.texts["status"].empty());
}

TEST(Foxglove, LeavesOutWhatASlowClientDoesNotRead) {
  FoxgloveRig rig;
  rig.subscribe(7, rig.often);
  rig.subscribe(8, rig.kept);
  for (int i = 0; i < 100; ++i) rig.hub.put(rig.often, i, std::to_string(i));
  rig.hub.put(rig.kept, 1, "other");
  rig.read();
  ASSERT_EQ(rig.frames[1].size(), Queue::kMostMessages + 1);
  EXPECT_TRUE(rig.frames[1][0].ends_with("92")) << "the oldest are left out";
  EXPECT_TRUE(rig.frames[1].back().ends_with("other"));
  rig.tick();
  rig.read();
  EXPECT_EQ(rig.texts["status"].at(0)["level"], 1);
  EXPECT_NE(rig.texts["status"][0]["message"].get<std::string>().find("92 messages"),
            std::string::npos);
  for (int i = 0; i < 8; ++i) rig.hub.put(rig.often, i, std::string(1'000'000, 'x'));
  rig.read();
  EXPECT_LE(rig.frames[1].size(), Queue::kMostBytes / 1'000'000);
  EXPECT_EQ(rig.hub.closing(rig.client), Close::kNot);
}

TEST(Foxglove, ShowsParametersAndSetsNone) {
  FoxgloveRig rig;
  rig.say({{"op", "getParameters"}, {"parameterNames", FoxJson::array()}, {"id", "all"}});
  rig.say({{"op", "getParameters"}, {"parameterNames", {"wave.cycles", "none"}}});
  rig.read();
  ASSERT_EQ(rig.texts["parameterValues"].size(), 2U);
  EXPECT_EQ(rig.texts["parameterValues"][0]["id"], "all");
  EXPECT_EQ(rig.texts["parameterValues"][0]["parameters"][0],
            FoxJson({{"name", "wave.depth_m"}, {"value", 0.5}, {"type", "float64"}}));
  EXPECT_EQ(rig.texts["parameterValues"][1]["parameters"],
            FoxJson::array({{{"name", "wave.cycles"}, {"value", 3}}}));
  rig.say({{"op", "setParameters"},
           {"parameters", FoxJson::array({{{"name", "wave.depth_m"}, {"value", 9.0}}})},
           {"id", "set"}});
  rig.read();
  EXPECT_EQ(rig.texts["status"].at(0)["level"], 2);
  EXPECT_EQ(rig.texts["parameterValues"].at(0)["parameters"][0]["value"], 0.5);
  EXPECT_EQ(rig.texts["parameterValues"][0]["id"], "set");
  rig.say({{"op", "subscribeParameterUpdates"}, {"parameterNames", {"wave.depth_m"}}});
  rig.parameters = {{"wave.depth_m", 0.75}, {"wave.cycles", std::int64_t{4}}};
  ++rig.version;
  rig.tick();
  rig.read();
  ASSERT_EQ(rig.texts["parameterValues"].size(), 1U);
  EXPECT_EQ(rig.texts["parameterValues"][0]["parameters"],
            FoxJson::array({{{"name", "wave.depth_m"}, {"value", 0.75}, {"type", "float64"}}}));
}

TEST(Foxglove, FetchesAFileWhenItsTurnComes) {
  FoxgloveRig rig;
  rig.read();
  rig.say({{"op", "fetchAsset"}, {"uri", "package://pair/foot.stl"}, {"requestId", 9}});
  rig.say({{"op", "fetchAsset"}, {"uri", "else"}, {"requestId", 10}});
  rig.read();
  ASSERT_EQ(rig.frames[4].size(), 2U);
  EXPECT_EQ(rig.frames[4][0], std::string("\x04\x09\0\0\0\0\0\0\0\0solid", 15));
  EXPECT_EQ(rig.frames[4][1], std::string("\x04\x0a\0\0\0\x01\x07\0\0\0no else", 17));
  for (std::size_t i = 0; i <= Hub::kMostAssets; ++i) {
    rig.say({{"op", "fetchAsset"}, {"uri", "else"}, {"requestId", i}});
  }
  rig.read();
  EXPECT_EQ(rig.frames[4].size(), Hub::kMostAssets);
  EXPECT_EQ(rig.texts["status"].size(), 1U);
}

TEST(Foxglove, RefusesTheRestInWordsAndClosesAFlood) {
  FoxgloveRig rig;
  for (const char* op : {"advertise", "unadvertise", "subscribeConnectionGraph"}) {
    rig.say({{"op", op}, {"channels", FoxJson::array()}});
  }
  rig.hub.receive(rig.client, std::string("\x01\0\0\0\0hello", 10), true, rig.now);
  rig.hub.receive(rig.client, std::string("\x02\0\0\0\0hello", 10), true, rig.now);
  rig.subscribe(7, 99);
  rig.subscribe(7, rig.often);
  rig.subscribe(7, rig.kept);
  rig.subscribe(8, rig.often);
  rig.say({{"op", "unsubscribe"}, {"subscriptionIds", {11}}});
  rig.say({{"op", "subscribe"}, {"subscriptions", 3}});
  rig.say({{"op", "subscribe"}, {"subscriptions", FoxJson::array({1, 2})}});
  rig.say({{"op", "getParameters"}, {"parameterNames", {1}}});
  rig.say({{"op", "fetchAsset"}, {"uri", "else"}, {"requestId", -1}});
  rig.read();
  EXPECT_EQ(rig.texts["status"].size(), 13U);
  EXPECT_EQ(rig.hub.closing(rig.client), Close::kNot);
  for (int i = 0; i < kMostBad; ++i) {
    const bool binary = i % 2 == 0;
    rig.hub.receive(rig.client, binary ? "\xff" : "{\"op\":\"dance\"}", binary, rig.now);
  }
  EXPECT_EQ(rig.hub.closing(rig.client), Close::kPolicy);
}

TEST(Foxglove, EndsWithTheRun) {
  FoxgloveRig rig;
  rig.hub.end("as planned", "");
  EXPECT_EQ(rig.hub.closing(rig.client), Close::kGoingAway);
  rig.read();
  EXPECT_EQ(rig.texts["status"].at(0)["message"], "the run is over: as planned");
}

TEST(FoxgloveAssets, AreThoseOfTheDescriptionsFolderAlone) {
  const tandem::test::ScratchFolder scratch;
  const std::string folder = scratch / "robot";
  std::filesystem::create_directories(folder + "/meshes");
  std::filesystem::create_directories(folder + "/pair");
  std::ofstream(folder + "/meshes/foot.STL") << "solid foot";
  std::ofstream(folder + "/pair/hand.dae") << "hand";
  std::ofstream(folder + "/robot.toml") << "secret = 1";
  std::ofstream(scratch / "else.stl") << "secret";
  std::filesystem::create_symlink(scratch / "else.stl", folder + "/link.stl");
  std::filesystem::create_directory_symlink(scratch / ".", folder + "/up");
  for (const std::string& uri :
       {std::string("package://pair/meshes/foot.STL"), std::string("meshes/foot.STL"),
        "file://" + folder + "/meshes/foot.STL"}) {
    const auto found = read_asset(folder, uri);
    EXPECT_TRUE(found && *found == "solid foot") << uri;
  }
  const auto inner = read_asset(folder, "package://pair/hand.dae");
  EXPECT_TRUE(inner && *inner == "hand");
  for (const std::string& uri : {std::string("package://pair/../else.stl"),
                                 std::string("package://../else.stl"),
                                 std::string("../else.stl"),
                                 std::string("/etc/passwd"),
                                 std::string("meshes//foot.STL"),
                                 "file://" + folder + "/../else.stl",
                                 "file://" + (scratch / "else.stl"),
                                 std::string("file:///etc/hosts.stl"),
                                 std::string("link.stl"),
                                 std::string("up/else.stl"),
                                 std::string("meshes/./foot.STL"),
                                 std::string("robot.toml"),
                                 std::string("package://"),
                                 std::string("package://pair"),
                                 std::string("package:///else.stl"),
                                 std::string(""),
                                 std::string("https://example.org/a.stl"),
                                 std::string("meshes/foot.STL\0.stl", 20),
                                 std::string("meshes"),
                                 std::string("none.stl"),
                                 std::string(5000, 'a') + ".stl"}) {
    const auto found = read_asset(folder, uri);
    EXPECT_FALSE(found) << uri;
  }
}

RequestHead guest(std::string_view target, std::string_view protocol,
                  std::vector<std::string_view> origins = {}) {
  return {.method = "GET",
          .target = target,
          .upgrades = true,
          .hosts = {"127.0.0.1:8642"},
          .origins = std::move(origins),
          .protocols = {protocol}};
}

unsigned status_for(const HttpRules& rules, const RequestHead& head) {
  const auto answer = rules.answer(head);
  return answer ? answer->status : 101;
}

TEST(FoxgloveRules, SayWhoMayLook) {
  const Guests guests{.names = {kSubprotocols[0], kSubprotocols[1]},
                      .origins = {"https://app.foxglove.dev"}};
  const HttpRules here({"127.0.0.1", 8642, true}, "<robot/>", "0123", "", guests);
  for (const char* protocol :
       {"foxglove.sdk.v1", "foxglove.websocket.v1", "foxglove.websocket.v1, foxglove.sdk.v1"}) {
    EXPECT_EQ(status_for(here, guest("/", protocol)), 101U) << protocol;
    EXPECT_EQ(status_for(here, guest("/ws", protocol)), 101U) << protocol;
    EXPECT_EQ(status_for(here, guest("/robot.urdf", protocol)), 400U) << protocol;
  }
  EXPECT_EQ(here.subprotocol(guest("/", "x, foxglove.websocket.v1, foxglove.sdk.v1")),
            "foxglove.websocket.v1");
  EXPECT_EQ(status_for(here, guest("/", "tandem.studio.v1")), 400U) << "the page's is at /ws";
  EXPECT_EQ(status_for(here, guest("/ws", "foxglove.sdk.v2")), 400U);
  for (const char* origin : {"http://127.0.0.1:8642", "file://", "https://app.foxglove.dev"}) {
    EXPECT_EQ(status_for(here, guest("/", "foxglove.sdk.v1", {origin})), 101U) << origin;
  }
  for (const char* origin : {"null", "https://evil.example", "http://localhost:8080",
                             "https://app.foxglove.dev.evil.example", "file:///home"}) {
    EXPECT_EQ(status_for(here, guest("/", "foxglove.sdk.v1", {origin})), 403U) << origin;
  }
  for (const char* origin : {"file://", "https://app.foxglove.dev"}) {
    EXPECT_EQ(status_for(here, guest("/ws", "tandem.studio.v1", {origin})), 403U)
        << "the page's protocol can change the run";
    EXPECT_EQ(status_for(here, guest("/ws", "tandem.studio.v1, foxglove.sdk.v1", {origin})), 403U);
  }
  const HttpRules elsewhere({"127.0.0.1", 8642, false}, "<robot/>", "0123", "", guests);
  EXPECT_EQ(status_for(elsewhere, guest("/?token=0123", "foxglove.sdk.v1")), 101U);
  for (const char* target : {"/", "/ws", "/?token=", "/?token=012", "/?token=01234", "/?x=0123"}) {
    EXPECT_EQ(status_for(elsewhere, guest(target, "foxglove.sdk.v1")), 401U) << target;
  }
}

TEST(FoxgloveQueue, DropsMessagesOfATimeThatWasTakenBack) {
  const auto payload = std::make_shared<const std::string>("x");
  Queue queue;
  queue.time(500);
  queue.message({1, 500, payload});
  queue.message({2, 10, payload, true});  // a description
  queue.text("words");
  queue.time(200);
  queue.message({1, 200, payload});
  EXPECT_EQ(queue.next_time(), 200);
  std::vector<std::int64_t> stamps;
  while (const auto entry = queue.next()) {
    if (const auto* message = std::get_if<Queue::Message>(&*entry)) {
      stamps.push_back(message->time_ns);
    }
  }
  EXPECT_EQ(stamps, (std::vector<std::int64_t>{10, 200}));
}

}  // namespace
}  // namespace tandem::studio::foxglove
