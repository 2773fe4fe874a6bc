// JSON from strangers: whatever it holds, an object or an error.
#include "apps/text/json_reader.hpp"

#include <gtest/gtest.h>

#include "apps/clients/control_client.hpp"
#include "apps/control/control_registry.hpp"

namespace tandem::apps {
namespace {

std::string error_of(const std::string& text) {
  const Result<Json> read = read_json_object(text);
  return read ? "" : read.error().message;
}

std::string repeated(const std::string& text, int times) {
  std::string out;
  for (int i = 0; i < times; ++i) out += text;
  return out;
}

TEST(JsonReader, ReadsAnObject) {
  const Result<Json> read = read_json_object(R"({"do": "x", "a": [1, -2.5e3, {"b": null}]})");
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->dump(), R"({"do":"x","a":[1,-2500.0,{"b":null}]})");
}

TEST(JsonReader, RefusesNumbersBeyondDouble) {
  for (const char* number : {"1e400", "-1e400", "[1, 2, 1e309]", R"({"y": 1e999999999})"}) {
    EXPECT_EQ(error_of(R"({"do": "status", "x": )" + std::string(number) + "}"),
              "a number is too large for a double");
  }
  EXPECT_EQ(error_of(R"({"x": 1e-400})"), "");  // rounds to zero
  EXPECT_EQ(error_of(R"({"x": 18446744073709551616})"), "");
}

TEST(JsonReader, RefusesWhatIsNestedTooDeeply) {
  EXPECT_EQ(error_of(R"({"x": )" + repeated("[", 32) + repeated("]", 32) + "}"), "");
  for (const int levels : {33, 60'000}) {
    EXPECT_EQ(error_of(R"({"x": )" + repeated("[", levels) + repeated("]", levels) + "}"),
              "nested more than 32 levels");
    EXPECT_EQ(error_of(repeated(R"({"x": )", levels + 1) + "1" + repeated("}", levels + 1)),
              "nested more than 32 levels");
  }
  EXPECT_EQ(error_of(repeated("[", 60'000)).substr(0, 7), "no JSON");
}

TEST(JsonReader, RefusesMoreThanAnyQuestionNeeds) {
  std::string keys = R"({"k": 0)";
  for (int i = 0; i < 1000; ++i) keys += ", \"k" + std::to_string(i) + "\": 0";
  EXPECT_EQ(error_of(keys + "}"), "an object of more than 1000 keys");
  EXPECT_EQ(error_of(R"({"x": [0)" + repeated(",0", 100'000) + "]}"), "more than 100000 values");
}

TEST(JsonReader, RefusesEveryKeyTwice) {
  EXPECT_EQ(error_of(R"({"a": 1, "b": {"a": 2}})"), "");
  EXPECT_EQ(error_of(R"({"b": [{"c": 1, "c": 2}]})"), "the key \"c\" is there twice");
}

TEST(JsonReader, RefusesWhatIsNoObject) {
  for (const char* text : {"", "[]", "1", "\"a\"", "null", "{", "{}x", "{\"a\": nan}", "\xff{}"}) {
    EXPECT_EQ(error_of(text).substr(0, 7), "no JSON") << text;
  }
}

// A status question with such a number had ended the process that was asked.
TEST(JsonReader, QuestionsBeyondAllLimitsAreAnswered) {
  const ControlRegistry registry;
  for (const std::string& question :
       {R"({"do": "help", "x": 1e400})" + std::string(),
        R"({"do": "help", "x": )" + repeated("[", 60'000) + repeated("]", 60'000) + "}",
        repeated("{\"do\":", 40'000)}) {
    EXPECT_EQ(registry.turn_of(question), ControlTurn::kOrdinary);
    EXPECT_EQ(registry.answer(question)["ok"], false);
  }
}

TEST(JsonReader, AnswersOfAnImpostorAreErrors) {
  for (const std::string& answer :
       {R"({"ok": false, "error": 7, "hint": [1]})" + std::string(), std::string(R"({"ok": 1})"),
        std::string("[1e400]"), R"({"ok": true, "x": )" + repeated("[", 60'000)}) {
    EXPECT_FALSE(read_answer(answer, "it").has_value()) << answer.substr(0, 60);
  }
}

}  // namespace
}  // namespace tandem::apps
