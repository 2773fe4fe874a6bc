// What `tandem check` says of a scenario before its run: requests that the run would refuse, rows
// that nobody would see.
#include <algorithm>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class ScenarioCheck : public Program {
 protected:
  [[nodiscard]] Outcome check(const std::string& rows) const {
    write_text(folder_ / "rows.toml", read_text(folder_ / "hold.toml") + "\n" + rows);
    return tandem("check rows.toml");
  }
  void refused(const std::string& ask, const std::string& words) const {
    const Outcome outcome = check("[[event]]\nat_s = 0.9\nask = { " + ask + " }\n");
    EXPECT_EQ(outcome.status, 2) << ask;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << ask << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find("rows.toml:"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("event[0].ask"), std::string::npos) << outcome.err;
  }
  void warned(const std::string& rows, const std::string& words) const {
    const Outcome outcome = check(rows);
    EXPECT_EQ(outcome.status, 0) << rows << outcome.err;
    EXPECT_NE((outcome.out + outcome.err).find(words), std::string::npos)
        << rows << outcome.out << outcome.err;
  }
};

// All of these passed, and failed the run when they came.
TEST_F(ScenarioCheck, RefusesWhatTheRunWouldRefuseWhateverItDoes) {
  refused(R"(do = "link.set", delay_s = 0.1)", "no link is declared before this robot");
  refused(R"(do = "link.set")", "nothing is to be set");
  refused(R"(do = "link.set", delay_s = -0.1)", "is no time of a link");
  refused(R"(do = "link.set", loss = -0.1)", "loss");
  refused(R"(do = "joint.gains", joint = "joint1", loop = "position", kp = -1.0)", "kp -1");
  refused(R"(do = "joint.gains", joint = "joint1", loop = "position")", "nothing is to be set");
  refused(R"(do = "joint.set", joint = "joint1")", "nothing is to be set");
  refused(R"(do = "joint.set", joint = "joint1", stiffness_Nm_rad = -1.0)", "the stiffness -1");
  refused(R"(do = "joint.move", joint = "joint1", target_rad = 100.0)",
          "beyond the joint's limits");
  refused(R"(do = "joint.home", joint = "joint1")", "has no homing");
  refused(R"(do = "joint.posture", posture = "lying")", "has no posture of that name");
  refused(R"(do = "site.move", site = "nose", axis = "x", by = 0.1)", "has no site of that name");
  refused(R"(do = "controller.switch", stop = ["hold"], start = ["hold"])",
          "is to be stopped and started");
  refused(R"(do = "controller.switch", start = ["hodl"])", "did you mean 'hold'?");
  refused(R"(do = "controller.switch", stop = ["hold"], when_within = 0.1)",
          "no controller is to start");
  refused(R"(do = "controller.switch")", "no controller is named");
  refused(R"(do = "controller.stop", name = "hodl")", "did you mean 'hold'?");
  refused(R"(do = "controller.set", name = "hold", parameters = { kp = 1.0 })",
          "no such parameter");
  refused(R"(do = "controller.load", plugin = "hodl")", "hodl");
  refused(R"(do = "controller.load", plugin = "hold")", "a controller of this name");
  refused(R"(do = "input.set", name = "rate", values = { x = 0.1 })", "has an input 'rate'");
}

// Which of them is active then is what the run alone knows; what is loaded may be named.
TEST_F(ScenarioCheck, LeavesToTheRunWhatDependsOnIt) {
  const Outcome outcome = check(R"(
[[event]]
when = "time() > 0.9s"
ask = { do = "controller.switch", stop = ["second"], start = ["hold"] }
[[event]]
at_s = 0.8
ask = { do = "controller.switch", stop = ["hold"], start = ["second"] }
[[event]]
at_s = 0.7
ask = { do = "controller.load", plugin = "hold", name = "second", parameters = { joints = ["joint1"] } }
[[event]]
when = "time() > 1s"
ask = { do = "joint.set", joint = "joint1", mode = "position" }
[[event]]
when = "time() > 1s"
ask = { do = "joint.posture", posture = "ready" }
[[event]]
when = "time() > 1s"
ask = { do = "joint.gains", joint = "joint1", loop = "position", kp = 30.0 }
[[event]]
when = "time() > 1s"
ask = { do = "controller.unload", name = "second" }
[[event]]
when = "time() > 1s"
ask = { do = "run.stop" }
)");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
}

TEST_F(ScenarioCheck, WarnsOfWhatNobodyWouldSee) {
  warned("[[event]]\nname = \"softer\"\nat_s = 900.0\nask = { do = \"run.stop\" }\n",
         "softer never comes: it is due at 900 s, and the run ends about");
  warned("[[push]]\nname = \"bump\"\nlink = \"link2\"\nat_s = 900\nforce_N = [1, 0, 0]\n",
         "bump never comes: it is due at 900 s");
  warned("[[push]]\nlink = \"link2\"\nafter_enabled_s = 900\nforce_N = [1, 0, 0]\n",
         "push[0] never comes: it is due at 900 s after the drives are enabled, and the run ends");
  const std::string shake = "[[sim.shake]]\nname = \"quake\"\nalong = \"x\"\nfrequency_Hz = 10.0\n";
  warned(shake + "amplitude_m = 0.001\nfrom_s = 900\n", "the ground does not shake");
  warned(shake + "amplitude_m = 1.0\n", "3.95e+03 m/s2 at its peak");
}

// It came at 0 s, before anything stood.
TEST_F(ScenarioCheck, APushSaysWhenItComes) {
  const Outcome outcome = check("[[push]]\nlink = \"link2\"\nforce_N = [1, 0, 0]\n");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("push[0]: nothing says when it comes"), std::string::npos)
      << outcome.err;
}

}  // namespace
}  // namespace tandem::apps
