// `tandem top` in a terminal, beside a running `tandem run`.
#include "tests/apps/running.hpp"
#include "tests/apps/terminal.hpp"

namespace tandem::apps {
namespace {

class Top : public Running {
 protected:
  [[nodiscard]] std::string command(const std::string& more = {}) const {
    return "top --socket " + socket_ + more;
  }
};

TEST_F(Top, ShowsARunIn80ColumnsAndGivesTheTerminalBack) {
  begin("");
  Terminal terminal(folder_, command(), 80, 24);
  terminal.until("joint2");
  for (const char* words :
       {"double_pendulum  running  ", " x real time", "cycle of 1000 us: ", " p50, ", "0 overruns",
        "bus: none, sim", "controller hold: active, 2 joints, a call ", "joint1", "hold",
        "position", "[", "fresh", "2 joints  ? help  q quit"}) {
    terminal.until(words);
  }
  EXPECT_LE(terminal.widest(), 80U) << terminal.text();
  EXPECT_LE(terminal.lines(), 24U) << terminal.text();
  EXPECT_EQ(terminal.raw().find("\x1b[?1049h"), terminal.raw().find('\x1b')) << "printed before";
  terminal.type("q");
  EXPECT_EQ(terminal.end(), 0);
  terminal.expect_restored();
  EXPECT_EQ(end(), 0);
}

TEST_F(Top, ObeysItsKeys) {
  begin("");
  Terminal terminal(folder_, command(), 100, 30);
  terminal.until("sort: robot");
  terminal.type("s");
  terminal.until("sort: name");
  terminal.type("/");
  terminal.until("name has: _");
  terminal.type("T2x\x7f\r");  // of any case
  terminal.until("1 of 2 joints (/T2)");
  EXPECT_EQ(terminal.text().find("joint1"), std::string::npos) << terminal.text();
  terminal.type("/");
  terminal.type("\x1b");
  terminal.until("joint1");
  terminal.type("?");
  terminal.until("freeze the picture; the robot goes on");
  EXPECT_EQ(terminal.text().find("joint1"), std::string::npos) << terminal.text();
  terminal.type("?");
  terminal.until("joint1");
  terminal.type(" ");
  terminal.until("FROZEN picture");
  const auto cycles = [this] {
    return nlohmann::json::parse(to_run("ask '{\"do\": \"status\"}'").out)["cycles"].get<int>();
  };
  const std::string head = terminal.text().substr(0, terminal.text().find('\n'));
  const int before = cycles();
  while (cycles() < before + 20'000) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  terminal.type("s");
  terminal.until("sort: error");
  EXPECT_EQ(terminal.text().substr(0, head.size()), head) << "the picture went on";
  terminal.type(" ");
  terminal.until_gone("FROZEN");
  terminal.until([&](const std::string& text) { return !text.starts_with(head); }, "a later time");
  terminal.type("q");
  EXPECT_EQ(terminal.end(), 0);
  EXPECT_EQ(end(), 0);
}

TEST_F(Top, ShowsALatchedFaultWithItsWayOutAndWithoutColourWhereNoneIsWanted) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("estop --category 0").status, 0);
  until(R"("phase": "faulted")");
  for (const auto& [environment, red] : {std::pair{"", true}, {"NO_COLOR=1", false}}) {
    Terminal terminal(folder_, command(), 120, 30, environment);
    terminal.until("FAULT at ");
    for (const char* words : {"emergency stop on request", "(torque off)", "faulted",
                              "way out: remove the cause, then tandem fault reset",
                              "position [rad]", "o is, | should be", " idle "}) {
      terminal.until(words);
    }
    EXPECT_LE(terminal.widest(), 120U);
    EXPECT_EQ(terminal.raw().find(";31m") != std::string::npos, red);
    terminal.type("q");
    EXPECT_EQ(terminal.end(), 0);
  }
  EXPECT_EQ(to_run("fault reset").status, 0);
  Terminal terminal(folder_, command(), 80, 24);
  terminal.until("HELD after a reset: tandem controller start");
  EXPECT_EQ(terminal.text().find("FAULT"), std::string::npos);
  terminal.type("q");
  EXPECT_EQ(terminal.end(), 0);
  EXPECT_EQ(end(), 0);
}

TEST_F(Top, SaysThatTheRunEndedAndLeavesTheLastPicture) {
  begin("");
  Terminal terminal(folder_, command(), 80, 24);
  terminal.until("joint2");
  EXPECT_EQ(end(), 0);
  EXPECT_EQ(terminal.end(), 0);
  terminal.expect_restored();
  const std::string left = terminal.text();
  for (const char* words : {"double_pendulum", "joint1", "joint2", "\nthe run ended\n"}) {
    EXPECT_NE(left.find(words), std::string::npos) << words << "\n" << left;
  }
  EXPECT_LE(terminal.widest(), 80U) << left;
}

TEST_F(Top, SaysSoOfARunThatWasKilled) {
  begin("");
  Terminal terminal(folder_, command(), 80, 24);
  terminal.until("joint2");
  signal("KILL");
  (void)join();
  EXPECT_EQ(terminal.end(), 0);
  terminal.expect_restored();
  EXPECT_NE(terminal.text().find("the run ended: no process listens at"), std::string::npos)
      << terminal.text();
  std::filesystem::remove(socket_);
}

TEST_F(Top, CallsThePictureOldOfARunThatHangsAndStillQuits) {
  begin("");
  Terminal terminal(folder_, command(), 80, 24);
  terminal.until("joint2");
  signal("STOP");
  terminal.until("NO ANSWER for ");
  terminal.until("what is shown is old");
  // A picture may come in several pieces.
  const auto dim = [&](const std::string&) {
    return terminal.raw().find("\x1b[2mjoint1") != std::string::npos;
  };
  terminal.until(dim, "dim joints");
  terminal.type("q");
  EXPECT_EQ(terminal.end(), 0);
  terminal.expect_restored();
  signal("CONT");
  EXPECT_EQ(end(), 0);
}

TEST_F(Top, FollowsTheTerminalsSize) {
  begin("");
  Terminal terminal(folder_, command(), 120, 30);
  terminal.until("position [rad]");
  terminal.resize(60, 12);
  terminal.until([&](const std::string&) { return terminal.widest() <= 60; }, "60 columns");
  for (const char* words : {"pos rad", "fresh", "q quit"}) terminal.until(words);
  EXPECT_LE(terminal.lines(), 12U) << terminal.text();
  terminal.resize(200, 50);
  terminal.until("position [rad]");
  terminal.resize(5, 2);
  terminal.until([&](const std::string&) { return terminal.widest() <= 5; }, "5 columns");
  EXPECT_LE(terminal.lines(), 2U) << terminal.text();
  terminal.type("q");
  EXPECT_EQ(terminal.end(), 0);
  EXPECT_EQ(end(), 0);
}

TEST_F(Top, GivesTheTerminalBackAfterASignal) {
  begin("");
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    Terminal terminal(folder_, command(), 80, 24);
    terminal.until("joint2");
    terminal.signal(number);
    EXPECT_EQ(terminal.end(), 0) << number;
    terminal.expect_restored();
  }
  EXPECT_EQ(end(), 0);
}

TEST_F(Top, PrintsOneTableWithoutATerminalAndWithOnce) {
  begin("");
  const Outcome once = to_run("top");
  EXPECT_EQ(once.status, 0) << once.err;
  for (const char* words : {"double_pendulum  running", "joint1", "position [rad]", "fresh"}) {
    EXPECT_NE(once.out.find(words), std::string::npos) << words << "\n" << once.out;
  }
  EXPECT_EQ(once.out.find('\x1b'), std::string::npos);
  EXPECT_EQ(once.out.find("quit"), std::string::npos) << "there are no keys";
  Terminal terminal(folder_, command(" --once"), 80, 24);
  EXPECT_EQ(terminal.end(), 0);
  EXPECT_EQ(terminal.raw().find('\x1b'), std::string::npos) << terminal.raw();
  EXPECT_NE(terminal.text().find("joint2"), std::string::npos) << terminal.text();
  EXPECT_LE(terminal.widest(), 80U) << terminal.text();
  Terminal dumb(folder_, command(), 80, 24, "TERM=dumb");
  EXPECT_EQ(dumb.end(), 0);
  EXPECT_EQ(dumb.raw().find('\x1b'), std::string::npos) << dumb.raw();
  const auto json = nlohmann::json::parse(to_run("top --json -").out, nullptr, false);
  EXPECT_EQ(json["loop"]["robot"], "double_pendulum");
  EXPECT_EQ(json["loop"]["period_ns"], 1'000'000);
  EXPECT_GT(json["loop"]["cycle_ns"]["p50"], 0);
  EXPECT_TRUE(json["loop"]["buses"].empty());
  EXPECT_EQ(json["joints"]["joints"].size(), 2U);
  EXPECT_EQ(json["controllers"]["controllers"][0]["name"], "hold");
  EXPECT_EQ(json["clock"]["clock"], "simulated");
  EXPECT_TRUE(json["faults"]["faults"].empty());
  EXPECT_EQ(end(), 0);
}

TEST_F(Top, RefusesWithoutARun) {
  Terminal terminal(folder_, "top --socket /tmp/nobody-is-here.sock", 80, 24);
  EXPECT_EQ(terminal.end(), 2);
  terminal.expect_restored();
  EXPECT_NE(terminal.text().find("no process listens at"), std::string::npos) << terminal.text();
}

}  // namespace
}  // namespace tandem::apps
