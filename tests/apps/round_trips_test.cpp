// Round trips of nodes as a run's summary lists them.
#include "apps/can/round_trips.hpp"

#include <gtest/gtest.h>

#include <array>

namespace tandem::apps {
namespace {

using hal::can::RoundTrip;

RoundTrip trip(const std::string& node, std::array<std::uint64_t, 4> cycles) {
  RoundTrip out;
  out.node = node;
  out.bus = "leg";
  out.id = 3;
  std::ranges::copy(cycles, out.cycles.begin());
  return out;
}

std::string printed(const std::vector<RoundTrip>& trips) {
  std::FILE* file = std::tmpfile();
  print_slowest_nodes(trips, file);
  std::rewind(file);
  std::string text(4096, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  return text;
}

TEST(RoundTrips, GivePercentilesInCycles) {
  const rt::Percentiles p = cycles_of(trip("hip", {0, 980, 15, 5}));
  EXPECT_EQ(p.p50, 1);
  EXPECT_EQ(p.p99, 2);
  EXPECT_EQ(p.p999, 3);
  EXPECT_EQ(p.max, 3);
  EXPECT_EQ(cycles_of(trip("hip", {})).max, 0);
}

TEST(RoundTrips, AreListedWithTheirTimesWhereTheBusKnowsThem) {
  RoundTrip timed = trip("hip", {0, 2, 0, 0});
  timed.time.record(60);
  timed.time.record(40);
  const Json json = figures_json(std::vector{timed, trip("knee", {0, 7, 0, 0})});
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0]["node"], "hip");
  EXPECT_EQ(json[0]["bus"], "leg");
  EXPECT_EQ(json[0]["id"], 3);
  EXPECT_EQ(json[0]["echoes"], 2);
  EXPECT_EQ(json[0]["cycles"]["p50"], 1);
  EXPECT_EQ(json[0]["cycles_histogram"][1], 2);
  EXPECT_EQ(json[0]["time_ns"]["max"], 60);
  EXPECT_TRUE(json[1]["time_ns"].is_null());
}

TEST(RoundTrips, ShowTheSlowestNodesFirstAndFiveOfThem) {
  std::vector<RoundTrip> trips;
  for (int i = 0; i < 6; ++i) trips.push_back(trip("on_time_" + std::to_string(i), {0, 9, 0, 0}));
  trips.push_back(trip("late", {0, 9, 0, 1}));
  trips.push_back(trip("silent", {}));
  trips[4].time.record(70'000);
  const std::string text = printed(trips);
  const std::size_t late = text.find("late (node 3 on leg)");
  const std::size_t timed = text.find("on_time_4");
  ASSERT_NE(late, std::string::npos) << text;
  ASSERT_NE(timed, std::string::npos) << text;
  EXPECT_LT(late, timed);
  EXPECT_LT(timed, text.find("on_time_0"));
  EXPECT_NE(text.find("70 / 70 / 70 / 70"), std::string::npos) << text;
  EXPECT_EQ(text.find("silent"), std::string::npos);
  EXPECT_EQ(text.find("on_time_3"), std::string::npos) << text;
}

TEST(RoundTrips, ShowNothingWithoutAnEcho) { EXPECT_EQ(printed({trip("hip", {})}), ""); }

}  // namespace
}  // namespace tandem::apps
