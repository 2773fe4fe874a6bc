// `tandem fault` and `tandem estop` against a running `tandem run`.
#include <cmath>
#include <regex>

#include "tests/apps/running.hpp"

namespace tandem::apps {
namespace {

class Faults : public Running {};

TEST_F(Faults, AreShownAndResetWhileTheRunWaits) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("fault reset").out, "nothing is latched\n");
  EXPECT_EQ(to_run("estop --category 0").out, "emergency stop, category 0\n");
  until(R"("phase": "faulted")");
  const Outcome shown = to_run("fault show");
  for (const char* text : {"phase faulted, 1 latched", "emergency stop on request", "torque off"}) {
    EXPECT_NE(shown.out.find(text), std::string::npos) << text << "\nin: " << shown.out;
  }
  const Outcome reset = to_run("fault reset");
  EXPECT_EQ(reset.status, 0) << reset.err;
  EXPECT_NE(reset.out.find("every joint is enabled where it is"), std::string::npos) << reset.out;
  EXPECT_NE(reset.out.find("cleared at"), std::string::npos) << reset.out;
  EXPECT_NE(reset.out.find("phase held, 0 latched"), std::string::npos) << reset.out;
  EXPECT_NE(reset.out.find("held: `tandem controller start` starts the controllers again"),
            std::string::npos)
      << reset.out;
  const auto ran = [this] {
    const Outcome status = to_run("ask '{\"do\": \"status\"}'");
    return nlohmann::json::parse(status.out, nullptr, false)["running_cycles"].get<int>();
  };
  const int before = ran();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(ran(), before) << "a reset is no start";
  const Outcome go_on = to_run("controller start");
  EXPECT_EQ(go_on.status, 0) << go_on.err;
  EXPECT_NE(go_on.out.find("active: hold"), std::string::npos) << go_on.out;
  until(R"("phase": "running")");
  EXPECT_EQ(to_run("controller start").status, 2) << "nothing is held back";
  EXPECT_EQ(end(), 0) << "what was reset is no failure of the run";
  const auto result = json("run.json");
  EXPECT_TRUE(result["faults"].empty());
  ASSERT_EQ(result["fault_log"].size(), 1U);
  EXPECT_EQ(result["fault_log"][0]["category"], "category0");
  EXPECT_EQ(result["fault_log"][0]["latched"], false);
}

TEST_F(Faults, LetAControllerBeSelectedAndSayThatItStartsLater) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("estop --category 1").status, 0);
  until(R"("phase": "faulted")");
  const Outcome stop = to_run("controller stop hold");
  EXPECT_NE(stop.out.find("done in cycle"), std::string::npos) << stop.out;
  const Outcome start = to_run("controller start hold");
  EXPECT_EQ(start.status, 0) << start.err;
  EXPECT_EQ(start.out.find("done"), std::string::npos) << start.out;
  for (const char* text : {"selected in cycle ", ": hold; not started yet: a fault is latched"}) {
    EXPECT_NE(start.out.find(text), std::string::npos) << text << "\nin: " << start.out;
  }
  EXPECT_EQ(to_run("fault reset").status, 0);
  until(R"("phase": "held")");
  EXPECT_EQ(to_run("controller start").out.find("not started"), std::string::npos);
  until(R"("phase": "running")");
  EXPECT_EQ(end(), 0);
}

TEST_F(Faults, LeaveAJointBeyondItsLimitWhereItIsUntilItIsRecovered) {
  // Unpowered it falls to where it hangs, at 3.14 rad: the plant's end stop is the URDF's 6.3.
  edit("double_pendulum.urdf", R"(lower="0" upper="0")", R"(lower="-6.3" upper="6.3")");
  edit("robot.toml", "max_position_rad = 6.3", "max_position_rad = 2.9");
  begin("--on-fault wait");
  const auto joint = [this] {
    const Outcome list = to_run("joint list joint1 --json -");
    return nlohmann::json::parse(list.out, nullptr, false)["joints"][0];
  };
  const auto refused = [this] { return to_run("joint recover joint1"); };
  EXPECT_NE(refused().err.find("joint1: is claimed by the controller 'hold'"), std::string::npos);
  EXPECT_EQ(to_run("estop --category 0").status, 0);
  EXPECT_NE(refused().err.find("while a fault is latched"), std::string::npos) << refused().err;
  // Held in the middle of a swing it would move on a little: it hangs still first. Two looks are
  // the same about every turning point of the swing, so four in a row have to be.
  int still = 0;
  for (int i = 0; i < 200 && still < 4; ++i) {
    const double before = joint()["position_rad"];
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    still = std::abs(joint()["position_rad"].get<double>() - before) < 5e-4 ? still + 1 : 0;
  }
  ASSERT_EQ(still, 4);
  EXPECT_EQ(to_run("fault reset").status, 0);
  const double beyond = joint()["position_rad"];
  ASSERT_GT(beyond, 2.95);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_NEAR(joint()["position_rad"], beyond, 0.01) << "nothing pulls it in";
  const Outcome recover = to_run("joint recover joint1");
  EXPECT_EQ(recover.status, 0) << recover.err;
  EXPECT_NE(recover.out.find("joint1 comes back"), std::string::npos) << recover.out;
  for (int i = 0; i < 200 && joint()["position_rad"].get<double>() > 2.91; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_NEAR(joint()["position_rad"], 2.9, 0.02);
  EXPECT_NE(refused().err.find("is within its limits already"), std::string::npos);
  EXPECT_EQ(end(), 0);
}

TEST_F(Faults, OfCategory2AreCategory1WhereNoControllerCanRetreat) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("estop --category 2").out,
            "emergency stop, category 1: no active controller can bring the robot to a safe "
            "posture\n");
  const Outcome shown = to_run("fault show --json -");
  const auto answer = nlohmann::json::parse(shown.out, nullptr, false);
  EXPECT_EQ(answer["phase"], "faulted");
  EXPECT_EQ(answer["faults"][0]["category"], "category1");
  EXPECT_EQ(answer["faults"][0]["reaction"], "stop, torque off");
  EXPECT_EQ(end(), 1);
}

TEST_F(Faults, OfABoardLeaveNoFiguresThatLookLive) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("inject kind=board_kill board=board_1").status, 0);
  until(R"("phase": "faulted")");
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const Outcome list = to_run("joint list joint1");
  EXPECT_NE(list.out.find("no feedback for "), std::string::npos) << list.out;
  EXPECT_EQ(to_run("controller start").status, 2);
  EXPECT_NE(to_run("controller start").err.find("tandem fault reset, then ask again"),
            std::string::npos);
  EXPECT_EQ(end(), 1);
}

TEST_F(Faults, AreResetWithoutAnybodyByAnExperimentThatSaysSo) {
  edit("hold.toml", "[[controller]]", "[faults]\nafter_reset = \"continue\"\n[[controller]]");
  begin("--on-fault wait");
  EXPECT_EQ(to_run("estop").status, 0);
  EXPECT_EQ(to_run("fault reset").status, 0);
  until(R"("phase": "running")");
  EXPECT_EQ(end(), 0);
}

TEST_F(Faults, ThatAreStillThereFailTheResetWithTheirJoints) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("inject kind=encoder_unplug joint=joint2").status, 0);
  until(R"("phase": "faulted")");
  const Outcome reset = to_run("fault reset");
  EXPECT_EQ(reset.status, 1);
  EXPECT_NE(reset.err.find("error: the reset failed, a cause is still there (joint2: "),
            std::string::npos)
      << reset.err;
  EXPECT_NE(reset.out.find("phase faulted, 1 latched"), std::string::npos) << reset.out;
  EXPECT_EQ(to_run("controller start").status, 2) << "a fault is latched";
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1);
}

TEST_F(Faults, BySignalAreOfTheRobotsCategory) {
  begin("--on-fault wait");
  signal("USR1");
  until(R"("phase": "faulted")");
  const Outcome shown = to_run("fault show --json -");
  const auto answer = nlohmann::json::parse(shown.out, nullptr, false);
  EXPECT_EQ(answer["faults"][0]["cause"], "emergency stop by a signal");
  EXPECT_EQ(answer["faults"][0]["category"], "category1");
  EXPECT_EQ(end(), 1) << "it is still latched";
}

/// The time in fault was in no line of the table at the end.
TEST_F(Faults, StopARunForATimeThatItsTableTells) {
  begin("--on-fault wait --quiet=false >table.txt");
  EXPECT_EQ(to_run("estop").status, 0);
  until(R"("phase": "faulted")");
  EXPECT_EQ(to_run("fault reset").status, 0);
  EXPECT_EQ(to_run("controller start").status, 0);
  EXPECT_EQ(end(), 0);
  const std::string table = read_text(folder_ / "table.txt");
  EXPECT_NE(table.find("  not running  "), std::string::npos) << table;
  EXPECT_NE(table.find(" s of the clock in fault or held"), std::string::npos) << table;
  EXPECT_GT(json("run.json")["stopped_seconds"].get<double>(), 0.0);
}

TEST_F(Faults, EndASimulatedRunThatWasNotToldToWait) {
  begin("");
  EXPECT_EQ(to_run("estop").status, 0);
  EXPECT_EQ(join(), 1);
  EXPECT_NE(read_text(folder_ / "run.txt").find("emergency stop on request"), std::string::npos);
}

// A closed terminal, or a pipe whose reader is gone, had killed the run in the middle of a cycle.
TEST_F(Faults, AClosedTerminalIsAStopInOrder) {
  begin("--on-fault wait");
  signal("HUP");
  EXPECT_EQ(join(), 129);
  EXPECT_LT(json("run.json")["cycles"].get<int>(), 2'000'000);
  EXPECT_EQ(json("run.json")["ended"], "interrupted by SIGHUP");
}

// A run of 11 s that Ctrl-C ended after one looked like one that was done: status 0, and no word of
// it in its JSON.
TEST_F(Faults, ARunThatASignalEndsBeforeItsTimeIsNotDone) {
  const std::pair<const char*, int> kinds[]{{"INT", 130}, {"TERM", 143}};
  for (const auto& [name, status] : kinds) {
    begin("");
    signal(name);
    EXPECT_EQ(join(), status) << name;
    const nlohmann::json result = json("run.json");
    EXPECT_EQ(result["ended"], std::string("interrupted by SIG") + name);
    EXPECT_EQ(result["planned_cycles"], 2'000'000);
    EXPECT_LT(result["cycles"].get<int>(), 2'000'000);
    EXPECT_TRUE(result["faults"].empty()) << "the robot is stopped in order";
  }
  begin("");
  EXPECT_EQ(end(), 0) << "whoever asks for the end gets it";
  EXPECT_EQ(json("run.json")["ended"], "on request");
  EXPECT_EQ(tandem("run hold.toml --no-log --no-socket -q --duration 0.1 --json run.json").status,
            0);
  EXPECT_EQ(json("run.json")["ended"], "as planned");
  EXPECT_EQ(json("run.json")["planned_cycles"], 100);
}

// Whoever wanted a robot that stands until it is stopped gave a large number, and a stop in order
// looked like a failure.
TEST_F(Faults, AnEndlessRunThatASignalStopsIsDone) {
  edit("hold.toml", "duration_s = 5.0", "duration_s = \"endless\"");
  const std::string plan = tandem("check hold.toml").out;
  EXPECT_NE(plan.find(" 1 kHz, after bring-up until it is stopped\n"), std::string::npos) << plan;
  for (const std::string name : {"INT", "TERM"}) {
    start("--quiet=false >table.txt");
    until(R"("running_cycles": 9)");
    const auto status = nlohmann::json::parse(to_run("ask '{\"do\": \"status\"}'").out);
    EXPECT_EQ(status["total_cycles"], 0);
    signal(name);
    EXPECT_EQ(join(), 0) << read_text(folder_ / "run.txt");
    const nlohmann::json result = json("run.json");
    EXPECT_EQ(result["ended"], "stopped by SIG" + name);
    EXPECT_TRUE(result["planned_cycles"].is_null());
    EXPECT_TRUE(result["faults"].empty());
    const std::string out = read_text(folder_ / "table.txt");
    for (const std::string& text : {std::string("2 joints, until it is stopped at 1 kHz"),
                                    "stopped by SIG" + name + " after "}) {
      EXPECT_NE(out.find(text), std::string::npos) << text << "\nin: " << out;
    }
    EXPECT_EQ(out.find(" % "), std::string::npos) << "a share of what has no end: " << out;
    // Its lines have the run's time, as faults and words of controllers: bring-up counts.
    std::smatch done, ran;
    ASSERT_TRUE(std::regex_search(out, done, std::regex("([0-9.]+) s  done"))) << out;
    ASSERT_TRUE(std::regex_search(out, ran, std::regex("stopped by SIG\\w+ after ([0-9.]+) s")));
    EXPECT_GT(std::stod(done[1]), std::stod(ran[1]) + 0.1) << out;
  }
}

TEST_F(Faults, AnEndlessRunEndsByAFaultAndOnRequest) {
  start("--duration endless");
  until(R"("phase": "running")");
  EXPECT_EQ(to_run("predict --horizon 0.1").status, 0);
  EXPECT_EQ(to_run("estop").status, 0);
  EXPECT_EQ(join(), 1);
  EXPECT_EQ(json("run.json")["ended"], "by a fault");
  start("--duration endless");
  until(R"("phase": "running")");
  EXPECT_EQ(end(), 0);
  EXPECT_EQ(json("run.json")["ended"], "on request");
}

// It had said that somebody asked for it.
TEST_F(Faults, AnEndlessRunEndsWhenItsControllersAreDone) {
  edit("trajectory.toml", "duration_s = 5.0", "duration_s = \"endless\"");
  edit("trajectory.toml", "[controller.parameters]\n",
       "[controller.parameters]\nstop_at_end = true\n");
  const Outcome run = tandem("run trajectory.toml --no-log --no-socket --json run.json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(json("run.json")["ended"], "its controllers were done");
  EXPECT_NE(run.out.find("its controllers were done after 4.8"), std::string::npos) << run.out;
}

TEST_F(Faults, OfARunThatASignalEndsAreItsStatus) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("estop").status, 0);
  until(R"("phase": "faulted")");
  signal("INT");
  EXPECT_EQ(join(), 1);
  EXPECT_EQ(json("run.json")["ended"], "interrupted by SIGINT");
}

TEST_F(Faults, AReaderThatGoesIsAStopInOrder) {
  for (const std::string pipe : {"| head -n 1", "2>&1 | head -n 1"}) {
    const std::string command =
        "cd " + shell_word(folder_.string()) + " && { timeout 100 " +
        shell_word(TANDEM_BINARY_DIR "/bin/tandem") +
        " run hold.toml --no-log --no-socket --duration 5000 --json run.json; "
        "echo $? >status; } " +
        pipe + " >out.txt";
    EXPECT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read_text(folder_ / "status"), "0\n");
    EXPECT_LT(nlohmann::json::parse(read_text(folder_ / "run.json"))["cycles"].get<int>(),
              5'000'000)
        << pipe;
  }
}

TEST_F(Faults, OfNoRunAreAnError) {
  const Outcome outcome = to_run("fault show");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("no process listens"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tandem::apps
