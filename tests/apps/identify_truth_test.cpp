// Do the intervals of tandem identify hold the robot that was simulated? Logs without noise, where
// every error is systematic. TANDEM_IDENTIFY_ALL=1: more experiments, and a humanoid.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class IdentifyTruth : public Program {
 protected:
  /// Excites the bundled `robot` and simulates it: into logs/`name`.
  void record(const std::string& robot, const std::string& name, const std::string& how) const {
    const Outcome excited = tandem("excite " + description(robot) + " --out e.toml " + how);
    ASSERT_EQ(excited.status, 0) << excited.err;
    const Outcome run = tandem("run e.toml --quiet --log " + name);
    ASSERT_EQ(run.status, 0) << run.err;
  }
  /// Base parameters of `robot` outside of their intervals. The description is exact.
  int outside(const std::string& robot, const std::vector<std::string>& names, int& all) const {
    std::string logs;
    for (const std::string& name : names)
      for (const auto& entry : std::filesystem::directory_iterator(folder_ / name))
        if (entry.path().extension() == ".mcap") logs += shell_word(entry.path().string()) + " ";
    const Outcome found = tandem("identify " + logs + "--robot " + description(robot) +
                                 " --out found --json found.json");
    EXPECT_EQ(found.status, 0) << found.err;
    int out = 0;
    const nlohmann::json base = json("found.json")["base_parameters"];
    for (const auto& one : base) {
      const double off = one["value"].get<double>() - one["described"].get<double>();
      ++all;
      if (std::abs(off) <= one["ci95"].get<double>()) continue;
      ++out;
      std::printf("outside: %s by %.2f intervals\n", one["name"].get<std::string>().c_str(),
                  off / one["ci95"].get<double>());
    }
    return out;
  }
  static std::string description(const std::string& robot) {
    return shell_word(TANDEM_SOURCE_DIR "/config/" + robot + "/robot.toml");
  }
};

// A six-axis sensor in the flange sees the accelerations at the samples, not their means: six base
// parameters were outside, the last link's inertia by seven intervals.
TEST_F(IdentifyTruth, OfAnArmWithASixAxisSensorIsInsideTheIntervals) {
  const int seeds = std::getenv("TANDEM_IDENTIFY_ALL") == nullptr ? 1 : 8;
  for (int seed = 1; seed <= seeds; ++seed) {
    const std::string number = std::to_string(seed);
    record("ur5e", "log" + number, "--seed " + number);
    int all = 0;
    EXPECT_LE(outside("ur5e", {"log" + number}, all), 3) << "seed " << seed;
    EXPECT_EQ(all, 61);
    const nlohmann::json base = json("found.json")["base_parameters"];
    for (const auto& one : base) {
      if (one["name"] != "wrist_3_link.izz_kg_m2") continue;
      EXPECT_NEAR(one["value"].get<double>(), 1.321e-4, 0.01e-4);
      EXPECT_LT(one["ci95"].get<double>(), 0.02e-4);
    }
  }
}

// What happens between two samples is not known then: rotors were 15 % off, 18 intervals.
TEST_F(IdentifyTruth, OfALogThatIsOutOfStepWithTheBoardsHasAWarning) {
  std::filesystem::copy(TANDEM_SOURCE_DIR "/config/ur5e", folder_ / "ur5e");
  edit("ur5e/robot.toml", "[board_defaults]", "[board_defaults]\ncontrol_period_ns = 250000");
  ASSERT_EQ(tandem("excite ur5e/robot.toml --out e.toml").status, 0);
  ASSERT_EQ(tandem("run e.toml --quiet --log log").status, 0);
  const auto log = *std::filesystem::directory_iterator(folder_ / "log");
  const Outcome found = tandem("identify " + shell_word(log.path().string()) +
                               " --robot ur5e/robot.toml --out found --json found.json");
  ASSERT_EQ(found.status, 0) << found.err;
  EXPECT_NE(found.err.find("warning: the boards' control has another period than the log"),
            std::string::npos)
      << found.err;
  for (const char* joint : {"shoulder_pan_joint", "elbow_joint", "wrist_3_joint"})
    EXPECT_NE(found.err.find(joint), std::string::npos) << found.err;
  const nlohmann::json base = json("found.json")["base_parameters"];
  for (const auto& one : base) {
    if (one["name"].get<std::string>().find("rotor") == std::string::npos) continue;
    EXPECT_NEAR(one["value"].get<double>(), one["described"].get<double>(),
                one["ci95"].get<double>())
        << one["name"];
  }
}

// Its motions repeat 20 and 3 times, and so do the steps of its torques: intervals as if every
// period was news held 203 of 263.
TEST_F(IdentifyTruth, OfAHumanoidIsInsideTheIntervals) {
  if (std::getenv("TANDEM_IDENTIFY_ALL") == nullptr)
    GTEST_SKIP() << "in make test-all: TANDEM_IDENTIFY_ALL=1, takes a minute";
  record("coman", "hung", "--hung");
  record("coman", "stand", "");
  for (const std::vector<std::string>& logs :
       {std::vector<std::string>{"hung"}, {"stand"}, {"hung", "stand"}}) {
    int all = 0;
    const int out = outside("coman", logs, all);
    EXPECT_EQ(all, 292);
    EXPECT_LE(out, 15) << logs.front() << " " << logs.size();
  }
}

}  // namespace
}  // namespace tandem::apps
