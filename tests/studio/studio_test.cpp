// The studio's protocol over real connections: what a page sees, asks and is refused.
#include "studio/studio.hpp"

#include "tests/studio/studio_rig.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::studio {
namespace {

using namespace test;
using tandem::test::eventually;

TEST(Studio, GreetsWithTheRobotAndItsSignals) {
  StudioRig rig;
  const auto block = block_of(2);
  rig.signals = {{"wave", block}};
  rig.start();
  const auto client = rig.client();
  EXPECT_EQ(client->protocol(), "tandem.studio.v1");
  const Json hello = client->next("hello");
  EXPECT_EQ(hello["protocol"], 1);
  EXPECT_EQ(hello["version"], "1.2.3");
  EXPECT_EQ(hello["robot"], "pair");
  EXPECT_EQ(hello["experiment"], "wave.toml");
  EXPECT_EQ(hello["run"], "0123abcd");
  EXPECT_EQ(hello["simulated"], true);
  EXPECT_EQ(hello["floating"], false);
  EXPECT_TRUE(hello["ground"].is_null());
  EXPECT_EQ(hello["period_s"], 0.001);
  ASSERT_EQ(hello["joints"].size(), 2U);
  EXPECT_EQ(hello["joints"][1]["name"], "b");
  EXPECT_EQ(hello["joints"][1]["upper"], 2.0);
  EXPECT_EQ(hello["joints"][1]["torque"], 4.0);
  EXPECT_EQ(hello["history_s"].size(), 3U);
  EXPECT_LT(hello["history_s"][0], hello["history_s"][2]);
  Json signals = client->next("signals");
  while (signals["sources"].size() < 4) signals = client->next("signals");  // the controller's
  EXPECT_EQ(signals["sources"][0]["name"], "state");
  EXPECT_EQ(signals["sources"][0]["first"], 0);
  const Json& wave = signals["sources"][3];
  EXPECT_EQ(wave["name"], "controller/wave");
  EXPECT_EQ(wave["fields"][2]["name"], "number");
  EXPECT_EQ(wave["fields"][2]["unit"], "m");
  EXPECT_EQ(wave["fields"][2]["count"], 2);
  EXPECT_TRUE(wave["fields"][2]["elements"].is_null());
}

/// The id of state.position_rad.a by the "signals" message.
SignalId position_id(const Json& signals) {
  std::uint32_t id = signals["sources"][0]["first"];
  for (const Json& field : signals["sources"][0]["fields"]) {
    if (field["name"] == "position_rad") return id;
    id += field["count"].get<std::uint32_t>();
  }
  ADD_FAILURE() << "state has no position_rad";
  return 0;
}

TEST(Studio, ShowsLeastLargestAndLastOfEachTick) {
  StudioRig rig;
  rig.start();
  const auto client = rig.client();
  const SignalId id = position_id(client->next("signals"));
  client->say(Json{{"op", "subscribe"}, {"revision", 7}, {"signals", {id, id + 1}}});
  (void)client->tick();  // of nothing yet
  rig.show(0, 100);
  SeenTick tick = client->tick();
  while (tick.cycle != 99) tick = client->tick();
  EXPECT_EQ(tick.revision, 7U);
  EXPECT_EQ(tick.lost, 0U);
  EXPECT_DOUBLE_EQ(tick.time_s, 0.099);
  ASSERT_EQ(tick.numbers.size(), 6U);
  EXPECT_EQ(tick.numbers[2], static_cast<float>(ShownRobot::position(99, 0)));
  EXPECT_EQ(tick.numbers[5], static_cast<float>(ShownRobot::position(99, 1)));
  EXPECT_LE(tick.numbers[0], tick.numbers[2]);
  EXPECT_EQ(tick.numbers[1], tick.numbers[2]);
  rig.stands = true;
  while ((tick.flags & 1) == 0) tick = client->tick();
  EXPECT_EQ(tick.cycle, 99U) << "the last values are repeated";
  EXPECT_EQ(tick.numbers[0], tick.numbers[2]);
}

TEST(Studio, CountsTheFramesThatASlowClientLosesAndNoSpikeIsLost) {
  StudioRig rig;
  rig.start();
  WebClient slow(rig.port, 4096);
  ASSERT_TRUE(slow.open());
  const SignalId id = position_id(slow.next("signals"));
  Json many = Json::array();
  for (int i = 0; i < 4096; ++i) many.push_back(id);
  slow.say(Json{{"op", "subscribe"}, {"revision", 1}, {"signals", many}});
  (void)slow.tick();
  const auto other = rig.client();
  other->say(Json{{"op", "subscribe"}, {"revision", 1}, {"signals", {id}}});
  std::uint64_t cycle = 0;
  for (int ticks = 0; ticks < 60;) {  // as long as the other needs for so many
    rig.show(cycle, cycle + 3);
    cycle += 3;
    const SeenTick seen = other->tick();
    EXPECT_EQ(seen.lost, 0U);
    if (seen.cycle + 1 >= cycle) ++ticks;
  }
  const std::uint64_t last = cycle - 1;
  std::uint32_t lost = 0;
  float least = 1e9F, largest = -1e9F;
  SeenTick tick;
  do {
    tick = slow.tick();
    ASSERT_GE(tick.lost, lost);
    lost = tick.lost;
    for (std::size_t i = 0; i < tick.numbers.size(); i += 3) {
      least = std::fmin(least, tick.numbers[i]);
      largest = std::fmax(largest, tick.numbers[i + 1]);
    }
  } while (tick.cycle < last);
  EXPECT_GT(lost, 0U);
  EXPECT_LE(least, static_cast<float>(ShownRobot::position(1, 0)));
  EXPECT_EQ(largest, static_cast<float>(ShownRobot::position(last, 0)));
}

TEST(Studio, AnswersAWindowOfTheHistory) {
  StudioRig rig;
  rig.start();
  const auto client = rig.client();
  const SignalId id = position_id(client->next("signals"));
  client->say(Json{{"op", "subscribe"}, {"revision", 1}, {"signals", {id}}});
  rig.show(0, 500);
  while (client->tick().cycle != 499) {
  }
  client->say(Json{{"op", "window"},
                   {"id", 5},
                   {"signals", {id, id + 1}},
                   {"from_s", 0.1},
                   {"to_s", 0.199},
                   {"points", 100}});
  SeenWindow window = client->window();
  EXPECT_EQ(window.level, 0);
  EXPECT_EQ(window.signals, 2);
  EXPECT_EQ(window.id, 5U);
  EXPECT_EQ(window.cycles, 1U);
  ASSERT_EQ(window.rows, 100U);
  EXPECT_DOUBLE_EQ(window.first_s, 0.1);
  EXPECT_DOUBLE_EQ(window.row_s, 0.001);
  ASSERT_EQ(window.numbers.size(), 200U);
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(window.numbers[i], static_cast<float>(ShownRobot::position(100 + i, 0)));
    EXPECT_EQ(window.numbers[100 + i], static_cast<float>(ShownRobot::position(100 + i, 1)));
  }
  client->say(Json{
      {"op", "window"}, {"id", 6}, {"signals", {id}}, {"from_s", 0}, {"to_s", 10}, {"points", 10}});
  window = client->window();
  EXPECT_GT(window.cycles, 1U);
  EXPECT_LE(window.rows, 40U);
  EXPECT_EQ(window.numbers.size(), 2 * window.rows);
  client->say(Json{{"op", "window"},
                   {"id", 7},
                   {"signals", {id}},
                   {"from_s", 100},
                   {"to_s", 200},
                   {"points", 10}});
  EXPECT_EQ(client->window().rows, 0U);
}

TEST(Studio, SaysWhatIsWrongWithAMessageAndGoesOn) {
  StudioRig rig;
  rig.start();
  const auto client = rig.client();
  const char* const wrong[] = {
      "",
      "{",
      "[]",
      "\"op\"",
      "{}",
      R"({"op": 3})",
      R"({"op": "fly"})",
      R"({"op": "subscribe"})",
      R"({"op": "subscribe", "revision": -1, "signals": []})",
      R"({"op": "subscribe", "revision": 1, "signals": [-1]})",
      R"({"op": "subscribe", "revision": 1, "signals": [1e9]})",
      R"({"op": "subscribe", "revision": 1, "signals": {"a": 1}})",
      R"({"op": "window", "id": 1, "signals": [0], "from_s": 2, "to_s": 1, "points": 5})",
      R"({"op": "window", "id": 1, "signals": [0], "from_s": 1, "to_s": 1e400, "points": 5})",
      R"({"op": "window", "id": 1, "signals": [0], "from_s": 1, "to_s": 2, "points": 0})",
      R"({"op": "ask", "request": {"do": "status"}})",
      R"({"op": "ask", "id": 1, "request": "status"})",
      R"({"op": "watch", "requests": ["joint.move"]})",
      R"({"op": "watch", "requests": "status"})",
      R"({"op": "control"})",
      R"({"op": "enter", "token": "00000000000000000000000000000000"})",
  };
  for (const char* text : wrong) {
    client->send(std::string(text));
    const Json error = client->next("error");
    EXPECT_NE(error["message"], "") << text;
    EXPECT_NE(error["hint"], "") << text;
  }
  client->send("binary", true);
  EXPECT_NE(client->next("error")["message"], "");
  EXPECT_EQ(client->ask({{"do", "status"}})["ok"], true);
}

TEST(Studio, ClosesAClientThatSaysNothingSensible) {
  StudioRig rig;
  rig.start();
  const auto client = rig.client();
  for (int i = 0; i < kMostBad; ++i) client->send(std::string("nonsense"));
  EXPECT_EQ(client->closed(), 1008);
  EXPECT_EQ(rig.client()->ask({{"do", "status"}})["ok"], true);
}

TEST(Studio, HandsQuestionsOverWithTheRightsOfTheOneWhoAsks) {
  StudioRig rig;
  rig.start();
  const auto client = rig.client();
  EXPECT_EQ(client->ask({{"do", "status"}}, 6)["ok"], true);
  client->say(Json{{"op", "enter"}, {"token", rig.token}});
  EXPECT_EQ(client->next("entered")["may"], "all");
  (void)client->ask({{"do", "fault.reset"}}, 7);
  client->say(Json{{"op", "control"}, {"take", true}});
  EXPECT_EQ(client->next("control")["yours"], true);
  (void)client->ask({{"do", "joint.move"}}, -3);
  const std::vector<Question> asked = rig.questions();
  ASSERT_EQ(asked.size(), 3U);
  EXPECT_FALSE(asked[0].rights.token);
  EXPECT_TRUE(asked[1].rights.token);
  EXPECT_FALSE(asked[1].rights.control);
  EXPECT_TRUE(asked[2].rights.control);
  EXPECT_EQ(asked[2].number, -3);
}

TEST(Studio, GivesControlToOneAndHaltsTheJointsWhenThatOneIsSilent) {
  StudioRig rig;
  rig.start();
  const auto one = rig.client(), other = rig.client();
  (void)one->next("control");
  (void)other->next("control");  // of the greeting
  other->say(Json{{"op", "control"}, {"take", true}});
  EXPECT_EQ(other->next("error")["hint"], "open the address with its token");
  for (const auto* client : {&one, &other}) {
    (*client)->say(Json{{"op", "enter"}, {"token", rig.token}});
    (void)(*client)->next("entered");
  }
  one->say(Json{{"op", "control"}, {"take", true}});
  const Json told = other->next("control");
  EXPECT_EQ(told["taken"], true);
  EXPECT_EQ(told["yours"], false);
  EXPECT_NE(told["by"], "");
  other->say(Json{{"op", "control"}, {"take", true}});
  (void)other->next("error");
  // It is alive for longer than it may be silent.
  const auto end = std::chrono::steady_clock::now() + 3 * Hub::kAlive / 2;
  while (std::chrono::steady_clock::now() < end) {
    one->say(Json{{"op", "alive"}});
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_FALSE(rig.asked_itself("joint.halt"));
  EXPECT_EQ(other->next("control")["taken"], false) << "silent since then";
  EXPECT_TRUE(eventually([&] { return rig.asked_itself("joint.halt"); }));
  other->say(Json{{"op", "control"}, {"take", true}});
  EXPECT_EQ(other->next("control")["yours"], true);
}

TEST(Studio, HaltsTheJointsWhenWhoHasControlIsGone) {
  StudioRig rig;
  rig.start();
  const auto client = rig.client(), other = rig.client();
  (void)other->next("control");
  client->say(Json{{"op", "enter"}, {"token", rig.token}});
  client->say(Json{{"op", "control"}, {"take", true}});
  EXPECT_EQ(other->next("control")["taken"], true);
  client->cut();
  EXPECT_EQ(other->next("control")["taken"], false);
  EXPECT_TRUE(rig.asked_itself("joint.halt"));
  const std::lock_guard lock(rig.mutex);
  EXPECT_FALSE(rig.dropped.empty()) << "what it asked for and has not begun";
}

// Who had control went on to lead joints in a time that it did not see.
TEST(Studio, EndsControlWhenTimeGoesBackAndHaltsNothing) {
  StudioRig rig;
  rig.start();
  const auto client = rig.client(), other = rig.client();
  (void)other->next("control");
  rig.show(0, 200);
  client->say(Json{{"op", "enter"}, {"token", rig.token}});
  client->say(Json{{"op", "control"}, {"take", true}});
  EXPECT_EQ(other->next("control")["taken"], true);
  rig.show(100, 101);
  std::string told;
  while (told.find("no control any more, for time went back") == std::string::npos) {
    const Json events = other->next("events");
    told = events["events"].back()["text"];
  }
  const Json control = other->next("control");
  EXPECT_EQ(control["taken"], false);
  EXPECT_EQ(control["went_back"], true);
  EXPECT_FALSE(rig.asked_itself("joint.halt")) << "what goes on unchanged has the same bits";
  const std::lock_guard lock(rig.mutex);
  EXPECT_FALSE(rig.dropped.empty()) << "what it asked for and has not begun";
}

TEST(Studio, AsksWhatIsWatchedForAllAndTellsWhatIsNew) {
  StudioRig rig;
  rig.counts = true;
  rig.start();
  const auto one = rig.client(), other = rig.client();
  for (const auto* client : {&one, &other}) {
    (*client)->say(Json{{"op", "watch"}, {"requests", {"status"}}});
  }
  const Json first = one->next("watched"), second = one->next("watched");
  EXPECT_EQ(first["request"], "status");
  EXPECT_NE(first["answer"]["count"], second["answer"]["count"]);
  EXPECT_EQ(other->next("watched")["request"], "status");
}

TEST(Studio, TellsWhatHappenedAlsoToThoseWhoComeLater) {
  StudioRig rig;
  rig.start();
  const auto one = rig.client();
  (void)one->next("events");
  {
    const std::lock_guard lock(rig.mutex);
    rig.events = {{0.5, 500, Event::Level::kWarn, "a", "too hot <script>\xff"}};
  }
  const Json told = one->next("events");
  ASSERT_EQ(told["events"].size(), 1U);
  EXPECT_EQ(told["events"][0]["time_s"], 0.5);
  EXPECT_EQ(told["events"][0]["cycle"], 500);
  EXPECT_EQ(told["events"][0]["level"], "warn");
  EXPECT_EQ(told["events"][0]["who"], "a");
  EXPECT_EQ(rig.client()->next("events")["events"].size(), 1U);
}

TEST(Studio, TellsThatTimeWentBackAndForgetsWhatLayAfter) {
  StudioRig rig;
  rig.start();
  const auto one = rig.client();
  (void)one->next("events");
  rig.show(0, 200);
  const auto event = [](double time_s, const char* text) {
    return Event{time_s, static_cast<std::uint64_t>(1000.0 * time_s), Event::Level::kInfo, "",
                 text};
  };
  {
    const std::lock_guard lock(rig.mutex);
    rig.events = {event(0.05, "early"), event(0.15, "late")};
  }
  while (one->next("events")["events"].back()["text"] != "late") {
  }
  rig.show(100, 101);
  {
    const std::lock_guard lock(rig.mutex);
    rig.events = {event(0.19, "later still")};
  }
  const Json back = one->next("back");
  EXPECT_DOUBLE_EQ(back["time_s"].get<double>(), 0.1);
  EXPECT_EQ(back["cycle"], 100);
  EXPECT_DOUBLE_EQ(back["from_s"].get<double>(), 0.199);
  std::vector<std::string> texts;
  const Json kept = rig.client()->next("events");
  for (const Json& told : kept["events"]) texts.push_back(told["text"]);
  EXPECT_EQ(texts, (std::vector<std::string>{"phase: running", "early",
                                             "time went back to 0.1 s, from 0.199 s"}));
}

// The cycle of that time is done and is not made again: what happened in it stays, once. What was
// asked for while time stood there acts in the next cycle, so it is forgotten.
TEST(Studio, KeepsWhatHappenedInTheCycleThatItGoesBackToOnce) {
  StudioRig rig;
  rig.start();
  const auto one = rig.client();
  (void)one->next("events");
  rig.show(0, 100);
  rig.robot.phase = hal::RunPhase::kHeld;
  rig.show(100, 150);
  rig.robot.phase = hal::RunPhase::kFaulted;
  rig.show(150, 200);
  const auto event = [](std::int64_t ms, const char* text) {
    return Event{1e-9 * static_cast<double>(1'000'000 * ms), static_cast<std::uint64_t>(ms),
                 Event::Level::kInfo, "", text};
  };
  {
    const std::lock_guard lock(rig.mutex);
    rig.events = {event(100, "fault: of that cycle"), event(100, "request joint.gains a"),
                  event(101, "request joint.stop a"), event(199, "late")};
  }
  while (one->next("events")["events"].back()["text"] != "late") {
  }
  rig.robot.phase = hal::RunPhase::kHeld;
  rig.show(100, 101);
  (void)one->next("back");
  while (one->next("events")["events"].back()["text"] != "time went back to 0.1 s, from 0.199 s") {
  }
  std::vector<std::string> texts;
  const Json kept = rig.client()->next("events");
  for (const Json& told : kept["events"]) texts.push_back(told["text"]);
  EXPECT_EQ(texts,
            (std::vector<std::string>{"phase: running", "phase: held", "fault: of that cycle",
                                      "time went back to 0.1 s, from 0.199 s"}));
}

TEST(Studio, TellsItsClientsThatTheRunIsOverAndClosesThem) {
  StudioRig rig;
  rig.start();
  const auto client = rig.client();
  (void)client->next("hello");
  WebClient deaf(rig.port, 4096);
  ASSERT_TRUE(deaf.open());
  std::thread over([&] { rig.studio->finish("as planned", "runs/pair.mcap"); });
  const Json ended = client->next("ended");
  EXPECT_EQ(ended["how"], "as planned");
  EXPECT_EQ(ended["log"], "runs/pair.mcap");
  EXPECT_EQ(client->closed(), 1001);
  over.join();  // whatever the other one does
}

TEST(Studio, HasAnotherTokenEachTime) {
  StudioRig one, other;
  EXPECT_EQ(one.token.size(), 32U);
  EXPECT_EQ(one.token.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(one.token, other.token);
  EXPECT_NE(one.port, other.port);
}

}  // namespace
}  // namespace tandem::studio
