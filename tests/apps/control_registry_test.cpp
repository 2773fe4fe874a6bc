// What a running process answers to a question, however wrong the question is.
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>

#include "apps/control/control_registry.hpp"
#include "tests/apps/socket_fixture.hpp"

namespace tandem::apps {
namespace {

using std::string_literals::operator""s;

struct Answers : ::testing::Test {
  Answers() { test::add_commands(registry); }
  [[nodiscard]] std::string error(const std::string& question) const {
    const Json answer = registry.answer(question);
    EXPECT_EQ(answer["ok"], false) << answer;
    return answer.value("error", ""s) + " | " + answer.value("hint", ""s);
  }
  ControlRegistry registry;
};

TEST_F(Answers, CarryWhatTheCommandFound) {
  const Json answer = registry.answer(R"({"do": "echo", "text": "hello", "times": 2})");
  EXPECT_EQ(answer.dump(), R"({"ok":true,"text":"hello","times":2})");
}

TEST_F(Answers, ListTheCommandsWithTheirKeys) {
  const Json answer = registry.answer(R"({"do": "help"})");
  ASSERT_EQ(answer["commands"].size(), 4U);
  EXPECT_EQ(answer["commands"][0]["do"], "help");
  EXPECT_EQ(answer["commands"][1]["keys"]["times"], "integer, optional: 1 to 3");
  EXPECT_EQ(answer["commands"][0]["effect"], "reads");
  EXPECT_EQ(answer["commands"][1]["effect"], "changes");
}

TEST_F(Answers, KnowWhatACommandDoesBeforeItIsAsked) {
  EXPECT_EQ(registry.effect("help"), ControlEffect::kReads);
  EXPECT_EQ(registry.effect("echo"), ControlEffect::kChanges);
  EXPECT_EQ(registry.effect("nothing"), std::nullopt);
}

TEST_F(Answers, RefuseWhatTheGateOfWhoAsksDoesNotLetThrough) {
  const ControlRegistry::Gate gate = [](const std::string& name, ControlEffect effect,
                                        const Json&) -> Status {
    if (effect == ControlEffect::kReads) return {};
    return fail(name + " is not for everybody", "ask somebody else");
  };
  EXPECT_EQ(registry.answer(R"({"do": "help"})", gate)["ok"], true);
  const Json refused = registry.answer(R"({"do": "echo", "text": "x"})", gate);
  EXPECT_EQ(refused["ok"], false);
  EXPECT_EQ(refused["error"], "echo is not for everybody");
  EXPECT_EQ(registry.answer(R"({"do": "echo"})", gate)["error"], "echo is not for everybody")
      << "whoever may not ask for it is not taught how";
}

TEST_F(Answers, ToAStopComeWhileAnotherCommandIsAtWork) {
  std::atomic<bool> at_work{false}, stopped{false};
  registry.add({"slow", ControlEffect::kChanges, "ends after a stop", {}},
               [&](const Json&) -> Result<Json> {
                 at_work = true;
                 while (!stopped) std::this_thread::yield();
                 return Json::object();
               });
  registry.add({"stop", ControlEffect::kStops, "stops", {}}, [&](const Json&) -> Result<Json> {
    stopped = true;
    return Json::object();
  });
  EXPECT_EQ(registry.turn_of(R"({"do": "stop"})"), ControlTurn::kUrgent);
  EXPECT_EQ(registry.turn_of(R"({"do": "slow"})"), ControlTurn::kOrdinary);
  EXPECT_EQ(registry.turn_of("rubbish"), ControlTurn::kOrdinary);
  std::thread slow([&] { EXPECT_EQ(registry.answer(R"({"do": "slow"})")["ok"], true); });
  while (!at_work) std::this_thread::yield();
  EXPECT_EQ(registry.answer(R"({"do": "stop"})")["ok"], true);
  slow.join();
}

TEST_F(Answers, ToWhatIsNoJsonObjectAreErrors) {
  for (const char* text : {"", "help", "{\"do\": \"help\"", "{\"do\": \"help\"} x", "\xff\xfe",
                           "[]", "null", "3", "{'do': 'help'}", "{\"do\": \"help\",}"}) {
    EXPECT_NE(error(text).find("no JSON"), std::string::npos) << text;
  }
  EXPECT_NE(error(std::string(100'000, '[')).find("no JSON"), std::string::npos);
  EXPECT_EQ(error(R"({"do": "help", "do": "help"})"),
            "the key \"do\" is there twice | give it once");
}

TEST_F(Answers, NameTheNearestCommandAndKey) {
  EXPECT_EQ(error(R"({"do": "hepl"})"), "unknown command \"hepl\" | did you mean 'help'?");
  EXPECT_EQ(error(R"({"do": "echo", "test": "x"})"),
            "echo: unknown key \"test\" | did you mean 'text'?");
  EXPECT_NE(error(R"({"do": 3})").find("does not name a command"), std::string::npos);
  EXPECT_NE(error(R"({})").find("does not name a command"), std::string::npos);
}

TEST_F(Answers, RefuseWrongTypesAndMissingKeys) {
  EXPECT_EQ(error(R"({"do": "echo", "text": 3})"),
            "echo: \"text\" is not of type text | what to say");
  EXPECT_EQ(error(R"({"do": "echo", "text": "x", "times": 1.5})"),
            "echo: \"times\" is not of type integer | 1 to 3");
  EXPECT_EQ(error(R"({"do": "echo"})"), "echo: \"text\" is missing | what to say");
}

TEST_F(Answers, CarryWhatAHandlerRefusesOrThrows) {
  EXPECT_EQ(error(R"({"do": "echo", "text": "x", "times": 4})"), "too often | three times at most");
  EXPECT_NE(error(R"({"do": "throw"})").find("out of luck"), std::string::npos);
}

}  // namespace
}  // namespace tandem::apps
