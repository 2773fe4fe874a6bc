// What the events of a log say of its run.
#include "report/run_events.hpp"

#include <gtest/gtest.h>

namespace tandem::report {
namespace {

log::EventText parameter(double time_s, bool loaded, const std::string& what) {
  return {{.time_ns = static_cast<std::int64_t>(time_s * 1e9),
           .kind = loaded ? log::EventKind::kParameterLoaded : log::EventKind::kParameterSet},
          (loaded ? "parameter loaded: " : "parameter set: ") + what};
}

// A controller that was loaded again had its start value replaced, with the reload's time.
TEST(Parameters, OfAControllerThatIsLoadedAgainKeepTheirStart) {
  const auto all = parameters_of(
      {parameter(16.714, true, "wave.height_m = 0.2"), parameter(16.714, true, "wave.arms = swing"),
       parameter(16.714, true, "wave.rate_Hz = 3"), parameter(17.0, false, "wave.gain = 5"),
       parameter(18.0, true, "wave.gain = 5"), parameter(18.0, true, "late.gain = 7"),
       parameter(19.0, true, "late.gain = 7")},
      {"wave.height_m = 0.2", "wave.arms = swing", "wave.rate_Hz = 2", "wave.gain = 1"});
  ASSERT_EQ(all.size(), 5U);
  EXPECT_EQ(all[0].start, "0.2");
  EXPECT_EQ(all[0].then, "");
  EXPECT_EQ(all[0].changes, 0U);
  EXPECT_EQ(all[1].start, "swing");
  EXPECT_EQ(all[1].changes, 0U);
  EXPECT_EQ(all[2].start, "2");
  EXPECT_EQ(all[2].then, "3 at 16.714 s");
  EXPECT_EQ(all[2].changes, 1U);
  EXPECT_EQ(all[3].start, "1");
  EXPECT_EQ(all[3].then, "5 at 17.000 s");
  EXPECT_EQ(all[3].changes, 1U) << "the new build came with what was set";
  EXPECT_EQ(all[4].start, "7 at 18.000 s");
  EXPECT_EQ(all[4].changes, 0U);
}

log::EventText happened(double time_s, log::EventKind kind, const std::string& text) {
  return {{.time_ns = static_cast<std::int64_t>(time_s * 1e9), .kind = kind}, text};
}

// Parameters that were set and limits that were met left no trace in a figure.
TEST(Marks, AreOfWhatWasSetAndOfLimits) {
  const auto marks =
      marks_of({happened(0.0, log::EventKind::kStarted, "started"),
                parameter(1.0, false, "squat.depth_m = 0.1"), parameter(1.5, true, "late.gain = 7"),
                happened(2.0, log::EventKind::kLimited, "knee: command limited"),
                happened(3.0, log::EventKind::kGainsSet, "knee: gains set"),
                happened(4.0, log::EventKind::kDropped, "payload dropped: box")});
  std::vector<std::string> kinds;
  for (const RunMark& one : marks) kinds.push_back(one.kind);
  EXPECT_EQ(kinds, (std::vector<std::string>{"parameter set", "limit met", "gains set",
                                             "payload dropped"}));
  EXPECT_EQ(marks[1].time_s, 2.0);
  EXPECT_EQ(marks[1].text, "knee: command limited");
}

}  // namespace
}  // namespace tandem::report
