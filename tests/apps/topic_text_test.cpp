// Samples as text, and the figures of their arrivals.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "apps/clients/topic_print.hpp"
#include "apps/clients/topic_rate.hpp"

namespace tandem::apps {
namespace {

using dds::Value;
using List = Value::List;
using Message = Value::Message;

Value sample() {
  const auto integer = [](std::int64_t n) { return Value{n}; };
  const auto text = [](const char* t) { return Value{std::string(t)}; };
  const Value pair{Message{{"key", text("a: b")}, {"values", Value{List{integer(1), integer(2)}}}}};
  return Value{Message{
      {"stamp", Value{Message{{"sec", integer(-3)}, {"nanosec", Value{std::uint64_t{5}}}}}},
      {"frame_id", text("")},
      {"position", Value{List{Value{0.5}, Value{2.0}, Value{std::nan("")}}}},
      {"none", Value{List{}}},
      {"flag", Value{true}},
      {"pairs", Value{List{pair, pair}}},
      {"note", text("it's\nlong")},
      {"word", text("true")},
  }};
}

TEST(TopicPrint, WritesYamlAsRosDoes) {
  EXPECT_EQ(to_yaml(sample()),
            "stamp:\n"
            "  sec: -3\n"
            "  nanosec: 5\n"
            "frame_id: ''\n"
            "position:\n"
            "- 0.5\n"
            "- 2.0\n"
            "- .nan\n"
            "none: []\n"
            "flag: true\n"
            "pairs:\n"
            "- key: 'a: b'\n"
            "  values:\n"
            "  - 1\n"
            "  - 2\n"
            "- key: 'a: b'\n"
            "  values:\n"
            "  - 1\n"
            "  - 2\n"
            "note: \"it's\\nlong\"\n"
            "word: 'true'\n");
}

/// A column of words without blanks had been made narrower than they are: its rows stood apart.
TEST(TopicList, AlignsLongNamesOfTypes) {
  Table table({"topic", "type", "quality of service"});
  table.align_left();
  table.add({"/a", "diagnostic_msgs/msg/DiagnosticArrayOfAVeryLongNameThatNobodyBreaks",
             "reliable, transient local, last 1"});
  table.add({"/b", "tandem_msgs/msg/State", "best effort, last 1"});
  ::testing::internal::CaptureStdout();
  table.print(stdout);
  std::fflush(stdout);
  std::istringstream out(::testing::internal::GetCapturedStdout());
  std::vector<std::size_t> begins;
  for (std::string line; std::getline(out, line);) {
    for (const char* word : {"quality", "reliable,", "best"}) {
      const std::size_t at = line.find(word);
      if (at != std::string::npos) begins.push_back(at);
    }
  }
  ASSERT_EQ(begins.size(), 3U);
  EXPECT_EQ(begins[0], begins[1]);
  EXPECT_EQ(begins[1], begins[2]);
}

TEST(TopicPrint, WritesJsonWithNullForWhatIsNotFinite) {
  const Json json = to_json(sample());
  EXPECT_EQ(json["stamp"]["sec"], -3);
  EXPECT_EQ(json["position"].dump(), "[0.5,2.0,null]");
  EXPECT_EQ(json["pairs"][1]["values"][0], 1);
  EXPECT_EQ(json["flag"], true);
}

TEST(TopicPrint, SelectsMembersAndElements) {
  const Value value = sample();
  const auto text = [&](const std::string& path) {
    const auto found = select(value, path);
    return found ? to_yaml(**found) : found.error().to_string();
  };
  EXPECT_EQ(text("stamp.sec"), "-3\n");
  EXPECT_EQ(text("position[1]"), "2.0\n");
  EXPECT_EQ(text("pairs[1].values[0]"), "1\n");
  EXPECT_EQ(text("none"), "[]\n");
  EXPECT_EQ(text(""), to_yaml(value));
  EXPECT_NE(text("stamp.secs").find("did you mean 'sec'?"), std::string::npos);
  EXPECT_NE(text("position[3]").find("the list has 3"), std::string::npos);
  EXPECT_NE(text("position[x]").find("is no element"), std::string::npos);
  EXPECT_NE(text("position[1").find("is no element"), std::string::npos);
  EXPECT_NE(text("flag.more").find("no field 'more'"), std::string::npos);
}

TEST(TopicRate, KnowsRateSpreadAndWhatIsMissing) {
  TopicRate rate(100);
  EXPECT_FALSE(rate.lost());
  std::int64_t time_ns = 0;
  for (std::uint64_t cycle = 100; cycle <= 500; cycle += 10, time_ns += 10'000'000) {
    if (cycle != 200 && cycle != 210) rate.arrived(time_ns, cycle);
  }
  EXPECT_EQ(rate.samples(), 39U);
  EXPECT_EQ(rate.lost(), 2U);
  const Json json = rate.json();
  EXPECT_NEAR(json["rate_Hz"].get<double>(), 38.0 / 0.4, 1e-9);
  EXPECT_NEAR(json["min_s"].get<double>(), 0.01, 1e-12);
  EXPECT_NEAR(json["max_s"].get<double>(), 0.03, 1e-12);
  EXPECT_EQ(json["interval_ns"]["max"], 30'000'000);
  Facts facts;
  rate.add_to(facts);
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* out = ::open_memstream(&text, &size);
  facts.print(out);
  std::fclose(out);
  EXPECT_NE(std::string(text, size).find(" / 30.000 ms, of all 38"), std::string::npos) << text;
  std::free(text);
  rate.arrived(time_ns, 0);  // another run: its numbers begin anew
  EXPECT_EQ(rate.lost(), 0U);
}

// The newest values each 10 ms: their cycles are 9, 10 or 11 apart, and none of them was lost.
TEST(TopicRate, DoesNotGuessWhatIsMissingWhereCyclesAreNotEvenlyApart) {
  TopicRate rate(100);
  std::int64_t time_ns = 0;
  for (const std::uint64_t cycle : {100, 110, 119, 130, 140, 150})
    rate.arrived(time_ns += 10'000'000, cycle);
  EXPECT_FALSE(rate.lost()) << *rate.lost();
  EXPECT_TRUE(rate.json()["lost"].is_null());
}

TEST(TopicRate, DoesNotGuessWhatIsMissingWithoutCycleNumbers) {
  TopicRate rate(2);
  for (const std::int64_t time_ns : {0, 1'000'000, 3'000'000, 4'000'000}) {
    rate.arrived(time_ns, std::nullopt);
  }
  EXPECT_FALSE(rate.lost());
  EXPECT_EQ(rate.json()["window"], 2);
  EXPECT_TRUE(rate.json()["lost"].is_null());
}

}  // namespace
}  // namespace tandem::apps
