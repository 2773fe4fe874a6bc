// `tandem latency` end to end, and what its figures must hold. Never a time.
#include <sched.h>
#include <unistd.h>

#include "apps/machine/latency_measure.hpp"
#include "apps/machine/latency_report.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::apps {
namespace {

class Latency : public Program {
 protected:
  static bool installed(const std::string& program) {
    return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
  }
  /// What cyclictest asks for first: empty, or why it does not run here.
  static std::string no_cyclictest() {
    if (!installed("cyclictest")) return "cyclictest is missing (apt-get install rt-tests)";
    const sched_param realtime{.sched_priority = 1}, ordinary{};
    if (::sched_setscheduler(0, SCHED_FIFO, &realtime) != 0) {
      return test::needs_root("real-time priority for cyclictest (ulimit -r)");
    }
    return ::sched_setscheduler(0, SCHED_OTHER, &ordinary) == 0 ? ""
                                                                : "the policy stays SCHED_FIFO";
  }
  void check_program(const nlohmann::json& one, std::uint64_t wakeups) const {
    EXPECT_EQ(one["wakeups"], wakeups);
    const auto ns = [&](const char* key) { return one["latency_ns"][key].get<std::int64_t>(); };
    EXPECT_LE(ns("p50"), ns("p99"));
    EXPECT_LE(ns("p99"), ns("p999"));
    EXPECT_LE(ns("p999"), ns("max"));
    std::uint64_t counted = 0;
    std::int64_t before = -1;
    for (const auto& bin : one["histogram_ns"]) {
      EXPECT_GT(bin[0].get<std::int64_t>(), before);
      before = bin[0];
      counted += bin[1].get<std::uint64_t>();
    }
    EXPECT_EQ(counted, wakeups);
  }
};

TEST_F(Latency, MeasuresOurLoopAloneWithoutCyclictest) {
  const Outcome outcome = tandem(
      "latency --duration 0.1 --slices 2 --load idle --policy other -o plots --json lat.json",
      "PATH=/nonexistent");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("apt-get install rt-tests"), std::string::npos) << outcome.err;
  const auto result = json("lat.json");
  ASSERT_EQ(result["loads"].size(), 1U);
  const auto& idle = result["loads"][0];
  EXPECT_EQ(idle["load"], "idle");
  check_program(idle["tandem"], 100);
  EXPECT_TRUE(idle["cyclictest"].is_null());
  EXPECT_TRUE(idle["ratio"].is_null());
}

TEST_F(Latency, MeasuresOurLoopAloneWithoutTheRightThatCyclictestAsksFor) {
  if (!installed("cyclictest")) GTEST_SKIP() << "cyclictest is missing (apt-get install rt-tests)";
  const std::string as_root = ::geteuid() == 0 ? " setpriv --bounding-set -sys_nice" : "";
  const Outcome outcome = tandem(
      "latency --duration 0.1 --slices 1 --load idle --policy other -o plots --json lat.json",
      "prlimit --rtprio=0:0" + as_root);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("cyclictest does not run without the right"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("/etc/security/limits.d"), std::string::npos) << outcome.err;
  EXPECT_TRUE(json("lat.json")["loads"][0]["cyclictest"].is_null());
}

TEST_F(Latency, StandsBesideCyclictestInEveryMode) {
  if (const std::string reason = no_cyclictest(); !reason.empty()) GTEST_SKIP() << reason;
  for (const std::string mode : {"swap", "together", "turns"}) {
    const Outcome outcome =
        tandem("latency --duration 0.2 --slices 2 --load idle --policy other --mode " + mode +
               " -o plots --json lat.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto result = json("lat.json");
    const auto& idle = result["loads"][0];
    check_program(idle["tandem"], 200);
    const std::uint64_t theirs_measured = idle["cyclictest"]["wakeups"];
    EXPECT_GE(theirs_measured, 200U);
    check_program(idle["cyclictest"], theirs_measured);
    for (const char* key : {"p50", "p99", "p999", "max"}) {
      EXPECT_TRUE(idle["ratio"].contains(key)) << key;
    }
    for (const std::string text : {"tandem", "cyclictest", "ratio", "p99.9 [us]"}) {
      EXPECT_NE(outcome.out.find(text), std::string::npos) << outcome.out;
    }
    const std::vector<int> ours = idle["tandem"]["cpus"], theirs = idle["cyclictest"]["cpus"];
    if (usable_cpus().size() < 2) continue;  // then the mode is "turns" whatever was asked for
    EXPECT_EQ(ours == theirs, mode == "turns");
    EXPECT_EQ(ours[0] == ours[1], mode != "swap");
    EXPECT_EQ(theirs[0] == theirs[1], mode != "swap");
  }
}

TEST_F(Latency, DrawsThePageWhenGnuplotIsThere) {
  if (!installed("gnuplot")) GTEST_SKIP() << "gnuplot is missing (apt-get install gnuplot-nox)";
  const Outcome outcome =
      tandem("latency --duration 0.1 --slices 1 --load idle --policy other -o plots");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "plots/report.html")) << outcome.err;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "plots/histogram_idle.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "plots/overview.png"));
}

TEST_F(Latency, RefusesACpuThatIsNotThereAndALoadThatCannotBe) {
  const Outcome cpu = tandem("latency --duration 0.1 --cpu 900");
  EXPECT_EQ(cpu.status, 2);
  EXPECT_NE(cpu.err.find("CPU 900"), std::string::npos) << cpu.err;
  const Outcome load = tandem("latency --duration 0.1 --stress", "PATH=/nonexistent");
  EXPECT_EQ(load.status, 2);
  EXPECT_NE(load.err.find("apt-get install stress-ng"), std::string::npos) << load.err;
  EXPECT_EQ(tandem("latency --load heavy").status, 2);
}

TEST(LatencyRatio, IsOursToTheirsAndNotANumberWithoutTheirs) {
  const LatencyRatio ratio = ratio_of({30, 60, 90, 100}, {20, 0, 45, 400});
  EXPECT_DOUBLE_EQ(ratio.p50, 1.5);
  EXPECT_TRUE(std::isnan(ratio.p99));
  EXPECT_DOUBLE_EQ(ratio.p999, 2.0);
  EXPECT_DOUBLE_EQ(ratio.max, 0.25);
}

TEST(LatencyFigures, ShowAShareOfLaterWakeUpsThatOnlyFalls) {
  LatencySample sample;
  sample.load = "idle";
  for (const std::int64_t late_ns : {2'000, 3'000, 3'000, 40'000}) sample.tandem.record(late_ns);
  const std::vector<report::Figure> figures = latency_figures({&sample, 1});
  ASSERT_EQ(figures.size(), 2U);
  EXPECT_EQ(figures[1].name, "tail_idle");
  const report::Curve& tail = figures[1].curves.at(0);
  EXPECT_EQ(tail.y, (std::vector<double>{1.0, 0.75, 0.75, 0.25, 0.25, 0.25}))
      << "in the end one of four, which a logarithmic axis can show";
}

}  // namespace
}  // namespace tandem::apps
