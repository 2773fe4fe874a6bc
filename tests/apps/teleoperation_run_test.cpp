// An operator's run in one process, and with the robot in another one over DDS in lockstep: what
// the robot does and what the operator sees are the same, bit for bit.
#include "tests/apps/program.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::apps {
namespace {

const char kOperated[] = R"(
[hal]
settle_s = 0.0
[teleoperation.up]
delay_s = 0.1
jitter_s = 0.02
distribution = "paretonormal"
loss_model = "gilbert_elliott"
to_bad = 0.02
to_good = 0.3
[teleoperation.down]
delay_s = 0.1
jitter_s = 0.02
loss = 0.2
[[teleoperation.outage]]
from_s = 1.0
to_s = 1.5
)";

class TeleoperationRun : public Program {
 protected:
  /// A topic of a log as text, from cycle 0 to where controllers are done.
  [[nodiscard]] std::string rows(const std::string& log, const std::string& topic) const {
    const Outcome csv = tandem("log csv " + shell_word(log) + " --topic " + topic);
    EXPECT_EQ(csv.status, 0) << csv.err;
    std::size_t end = 0;
    for (int row = 0; row < 2200; ++row) end = csv.out.find('\n', end) + 1;
    return csv.out.substr(0, end);
  }
};

TEST_F(TeleoperationRun, OverDdsInLockstepIsTheRunInOneProcess) {
  const std::string plain = read_text(folder_ / "trajectory.toml");
  const std::size_t at = plain.find("[[controller]]");
  write_text(folder_ / "operated.toml", plain.substr(0, at) + kOperated + plain.substr(at));
  write_text(folder_ / "served.toml",
             plain.substr(0, at) + "[hal]\nsettle_s = 0.0\n" + plain.substr(at));
  const Outcome alone = tandem("run operated.toml --duration 2 --quiet --json alone.json");
  ASSERT_EQ(alone.status, 0) << alone.err;
  const std::string domain = " --domain " + std::to_string(dds::test::own_domain());
  const std::string program = shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " ";
  const std::string both = "cd " + shell_word(folder_.string()) + " && { " + program +
                           "serve served.toml" + domain +
                           " --lockstep --once --quiet --json served.json 2>serve.err & " +
                           program + "run operated.toml" + domain +
                           " --duration 2 --hal dds --lockstep --no-socket --quiet --json "
                           "owner.json 2>owner.err; wait; } </dev/null >both.txt";
  ASSERT_EQ(std::system(both.c_str()), 0);
  const auto here = json("alone.json"), there = json("owner.json"), served = json("served.json");
  EXPECT_EQ(here["teleoperation"]["holds"], 1);
  EXPECT_EQ(here["teleoperation"]["holds"], there["teleoperation"]["holds"]);
  EXPECT_GT(here["teleoperation"]["up"]["lost"].get<int>(), 500);
  const std::string one = here["log"]["path"], other = there["log"]["path"];
  EXPECT_EQ(rows(one, "state"), rows(other, "state")) << "what the operator sees";
  EXPECT_EQ(rows(one, "truth"), rows(served["log"]["path"], "truth")) << "what the robot does";
}

/// The prediction alone looks as good as ever: the run has to say that nothing came.
TEST_F(TeleoperationRun, OverALinkThatDiesSaysSo) {
  const std::string plain = read_text(folder_ / "trajectory.toml");
  const std::size_t at = plain.find("[[controller]]");
  const auto run = [&](const std::string& link) {
    write_text(folder_ / "operated.toml", plain.substr(0, at) + link + plain.substr(at));
    return tandem("run operated.toml --duration 3 --no-log --json run.json");
  };
  const Outcome dead = run("[teleoperation.up]\nloss = 1.0\n[teleoperation.down]\nloss = 1.0\n");
  EXPECT_NE(dead.err.find("no state of the robot came in the last"), std::string::npos) << dead.err;
  EXPECT_TRUE(json("run.json")["teleoperation"]["worst_prediction_rad"].is_null());
  EXPECT_EQ(json("run.json")["warnings"].size(), 1U);
  const Outcome outage = run("[[teleoperation.outage]]\nfrom_s = 0.5\nto_s = 2.5\n");
  EXPECT_EQ(outage.status, 0) << outage.err;
  EXPECT_EQ(json("run.json")["warnings"].size(), 0U) << "it came back";
  const auto lost = json("run.json")["fault_log"];
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost[0]["category"], "warn");
  EXPECT_FALSE(lost[0]["latched"].get<bool>()) << "it came back";
  const auto link = json("run.json")["teleoperation"];
  EXPECT_NEAR(link["most_silent_cycles"].get<int>(), 2000, 2);
  EXPECT_GT(link["compared"].get<int>(), 900);
}

/// States come all the time, so that only they tell that the robot follows nothing.
TEST_F(TeleoperationRun, WhoseCommandsNeverArriveSaysSoAndShowsTheRobot) {
  const std::string plain = read_text(folder_ / "trajectory.toml");
  const std::size_t at = plain.find("[[controller]]");
  const std::string link =
      "[teleoperation.up]\ndelay_s = 0.25\nloss = 1.0\n[teleoperation.down]\ndelay_s = 0.25\n";
  write_text(folder_ / "operated.toml", plain.substr(0, at) + link + plain.substr(at));
  const Outcome run = tandem("run operated.toml --duration 6 --no-log --json run.json");
  EXPECT_EQ(run.status, 1) << "the link is lost at the end";
  const auto log = json("run.json")["fault_log"];
  ASSERT_EQ(log.size(), 1U);
  EXPECT_EQ(log[0]["cause"],
            "the link is lost: states of the robot come, but it follows no command");
  EXPECT_EQ(log[0]["category"], "warn");
  EXPECT_TRUE(log[0]["latched"].get<bool>());
  EXPECT_LT(log[0]["time_s"].get<double>(), 2.1) << "of the run, which settles first";
  const auto figures = json("run.json")["teleoperation"];
  EXPECT_GT(figures["compared"].get<int>(), 5000);
  EXPECT_GT(figures["worst_prediction_rad"].get<double>(), 0.1) << "the robot never moved";
  EXPECT_GT(figures["most_unanswered_cycles"].get<int>(), 4000);
}

/// One file for both ends: the server's has play-out, the operator's the prediction.
TEST_F(TeleoperationRun, InRealTimeTheTwoEndsAreTwoProcesses) {
  const std::string plain = read_text(folder_ / "trajectory.toml");
  const std::size_t at = plain.find("[[controller]]");
  const std::string link =
      "[teleoperation.up]\ndelay_s = 0.1\n[teleoperation.down]\ndelay_s = 0.1\nloss = 0.1\n";
  write_text(folder_ / "operated.toml",
             plain.substr(0, at) + "[remote]\nlease_timeout_s = 30.0\n" + link + plain.substr(at));
  const std::string domain = " --domain " + std::to_string(dds::test::own_domain());
  const std::string program = shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " ";
  const std::string both = "cd " + shell_word(folder_.string()) + " && { " + program +
                           "serve operated.toml" + domain +
                           " --realtime --once --no-log --quiet --json served.json 2>serve.err & " +
                           program + "run operated.toml" + domain +
                           " --duration 1.5 --hal dds --realtime --no-log --no-socket --quiet "
                           "--json owner.json 2>owner.err; wait; } </dev/null >both.txt";
  ASSERT_EQ(std::system(both.c_str()), 0);
  const auto there = json("owner.json")["teleoperation"], served = json("served.json");
  EXPECT_GT(there["compared"].get<int>(), 100);
  EXPECT_LT(there["worst_prediction_rad"].get<double>(), 0.1);
  EXPECT_TRUE(there["holds"].is_null()) << "the robot's end is the server's";
  EXPECT_TRUE(served["teleoperation"].is_null()) << "the link is declared once";
  EXPECT_TRUE(served["remote"]["playout"]["holds"].is_number());
  EXPECT_EQ(served["remote"]["losses"], 0);
}

/// They ran, and what the operator saw was another robot.
TEST_F(TeleoperationRun, OtherControllersAtTheRobotsEndAreRefused) {
  const auto experiment = [&](const std::string& at_robot) {
    return "robot = \"robot.toml\"\nposture = \"ready\"\nduration_s = "
           "0.3\n[remote]\nlease_timeout_s = 30.0\n"
           "[teleoperation.up]\ndelay_s = 0.05\n" +
           at_robot +
           "[[controller]]\nplugin = \"hold\"\n[controller.parameters]\njoints = [\"joint1\"]\n";
  };
  const auto holding = [](const std::string& damping) {
    return "[[teleoperation.robot_controller]]\nplugin = \"hold\"\n"
           "[teleoperation.robot_controller.parameters]\njoints = [\"joint2\"]\n"
           "link_damping_Nms_rad = " +
           damping + "\n";
  };
  write_text(folder_ / "served.toml", experiment(holding("0.5")));
  write_text(folder_ / "none.toml", experiment(""));
  write_text(folder_ / "other.toml", experiment(holding("0.25")));
  write_text(folder_ / "same.toml", experiment(holding("0.50   # as there")));
  const std::string domain = " --domain " + std::to_string(dds::test::own_domain());
  const std::string program = shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " ";
  const auto run = [&](const std::string& name) {
    return program + "run " + name + ".toml" + domain + " --hal dds --realtime --no-log -q " +
           "--no-socket 2>" + name + ".err; echo $? >" + name + ".status; ";
  };
  const std::string all = "cd " + shell_word(folder_.string()) + " && { " + program +
                          "serve served.toml" + domain +
                          " --realtime --once --no-log -q 2>serve.err & " + run("none") +
                          run("other") + run("same") + "wait; } </dev/null";
  ASSERT_EQ(std::system(all.c_str()), 0);
  const auto told = [&](const std::string& name) { return read_text(folder_ / (name + ".err")); };
  const auto status = [&](const std::string& name) {
    return read_text(folder_ / (name + ".status"));
  };
  EXPECT_EQ(status("none"), "2\n");
  EXPECT_NE(
      told("none").find("teleoperation.robot_controller.hold is \"hold\" there and not given here"),
      std::string::npos)
      << told("none");
  EXPECT_EQ(status("other"), "2\n");
  EXPECT_NE(told("other").find("teleoperation.robot_controller.hold.link_damping_Nms_rad is 0.5 "
                               "there and 0.25 here"),
            std::string::npos)
      << told("other");
  EXPECT_EQ(status("same"), "0\n") << told("same") << told("serve");
}

/// Nobody could have fed it: it never moved, and nothing said so.
TEST_F(TeleoperationRun, AControllerWithAnInputIsRefusedAtTheRobotsEnd) {
  const auto experiment = [](const std::string& plugin) {
    return "robot = \"robot.toml\"\nposture = \"ready\"\nduration_s = 0.1\n[teleoperation.up]\n"
           "delay_s = 0.01\n[[teleoperation.robot_controller]]\nplugin = \"" +
           plugin +
           "\"\n[teleoperation.robot_controller.parameters]\njoints = [\"joint2\"]\n"
           "[[controller]]\nplugin = \"hold\"\n[controller.parameters]\njoints = [\"joint1\"]\n";
  };
  write_text(folder_ / "jog.toml", experiment("jog"));
  for (const char* command : {"run jog.toml --no-log --no-socket -q", "check jog.toml"}) {
    const Outcome refused = tandem(command);
    EXPECT_EQ(refused.status, 2) << command;
    EXPECT_NE((refused.err + refused.out).find("has the input 'rate', and nobody feeds inputs"),
              std::string::npos)
        << command << refused.err << refused.out;
  }
  write_text(folder_ / "weight.toml", experiment("gravity_compensation"));
  const Outcome warned = tandem("run weight.toml --no-log --no-socket");
  EXPECT_EQ(warned.status, 0) << warned.err;
  EXPECT_NE(warned.err.find("its signals are in no log, report or topic"), std::string::npos)
      << warned.err;
}

// It was taken for measurements, of a robot that never moved.
TEST_F(TeleoperationRun, IsNoRecordingToIdentifyFrom) {
  const std::string plain = read_text(folder_ / "trajectory.toml");
  const std::size_t at = plain.find("[[controller]]");
  write_text(folder_ / "operated.toml",
             plain.substr(0, at) + "[teleoperation]\n" + plain.substr(at));
  ASSERT_EQ(tandem("run operated.toml --duration 1 --quiet --log logs").status, 0);
  const std::string log = "logs/double_pendulum-operated-001.mcap";
  EXPECT_NE(tandem("log info " + log).out.find("what the tele-operator saw"), std::string::npos);
  const Outcome found = tandem("identify " + log + " --robot robot.toml --out found");
  EXPECT_EQ(found.status, 2);
  EXPECT_NE(found.err.find("what a tele-operator saw"), std::string::npos) << found.err;
  ASSERT_EQ(tandem("report " + log + " -o page").status, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "page/report.html"));
}

/// As after another operator. And a rate is refused for the reason that there is.
TEST_F(TeleoperationRun, TellsAnOperatorThatTheRobotStandsElsewhere) {
  const std::string plain = read_text(folder_ / "trajectory.toml");
  const std::size_t at = plain.find("[[controller]]");
  write_text(folder_ / "served.toml", plain.substr(0, at) +
                                          "[remote]\nlease_timeout_s = 30.0\n[teleoperation]\n" +
                                          plain.substr(at));
  write_text(folder_ / "other.toml", read_text(folder_ / "robot.toml"));
  edit("other.toml", "joint1 = 0.5", "joint1 = 0.3");
  write_text(folder_ / "operated.toml", read_text(folder_ / "served.toml"));
  edit("operated.toml", "\"robot.toml\"", "\"other.toml\"");
  const std::string domain = " --domain " + std::to_string(dds::test::own_domain());
  const std::string program = shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " ";
  const std::string run = program + "run operated.toml" + domain + " --hal dds --no-log -q ";
  const std::string both =
      "cd " + shell_word(folder_.string()) + " && { " + program + "serve served.toml" + domain +
      " --realtime --once --no-log -q 2>serve.err & " + run + "--rate 0.5 2>rate.err; " + run +
      "--duration 0.3 --realtime --no-socket 2>owner.err; wait; } </dev/null";
  ASSERT_EQ(std::system(both.c_str()), 0);
  const std::string told = read_text(folder_ / "owner.err"), rate = read_text(folder_ / "rate.err");
  EXPECT_NE(told.find("the robot does not stand in the posture 'ready': joint1 is 11."),
            std::string::npos)
      << told;
  EXPECT_NE(rate.find("the operator's end of a link keeps real time"), std::string::npos) << rate;
}

TEST_F(TeleoperationRun, NeedsRealTimeAtBothEnds) {
  const std::string plain = read_text(folder_ / "trajectory.toml");
  const std::size_t at = plain.find("[[controller]]");
  write_text(folder_ / "operated.toml",
             plain.substr(0, at) + "[teleoperation]\n" + plain.substr(at));
  const Outcome fast = tandem("serve operated.toml --once --no-log");
  EXPECT_EQ(fast.status, 2);
  EXPECT_NE(fast.err.find("add --realtime"), std::string::npos) << fast.err;
  const Outcome lockstep = tandem("serve operated.toml --lockstep --once --no-log");
  EXPECT_EQ(lockstep.status, 2);
  EXPECT_NE(lockstep.err.find("in lockstep the link is at the operator's end"), std::string::npos)
      << lockstep.err;
  const Outcome wire = tandem("run operated.toml --hal can --no-log");
  EXPECT_EQ(wire.status, 2) << wire.err;
}

}  // namespace
}  // namespace tandem::apps
