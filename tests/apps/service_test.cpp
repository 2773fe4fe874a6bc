// A run as a service: what it tells its manager, how it waits for a person, and its unit.
#include <algorithm>
#include <chrono>

#include "tests/apps/background.hpp"
#include "tests/apps/program.hpp"
#include "tests/apps/service_manager.hpp"

namespace tandem::apps {
namespace {

class Service : public Program {
 protected:
  void TearDown() override {
    run_.reset();
    Program::TearDown();
  }
  /// `tandem run EXPERIMENT FLAGS`, which its manager watches.
  void begin(const std::string& flags, const std::string& experiment = "hold.toml",
             const std::string& limit_us = "40000") {
    ASSERT_TRUE(manager_.listens());
    ::setenv("NOTIFY_SOCKET", manager_.name().c_str(), 1);
    ::setenv("WATCHDOG_USEC", limit_us.c_str(), 1);
    run_.emplace(folder_,
                 "run " + experiment + " " + log_ + " -q --socket " + socket_ + " " + flags, "run");
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
  }
  /// A run of dead.toml that waits for its start, and none of whose drives can be enabled.
  void begin_without_power() {
    write_text(folder_ / "dead.toml",
               read_text(folder_ / "hold.toml") +
                   "\n[[fault]]\nkind = \"board_kill\"\nboard = \"board_1\"\nat_s = 0\n");
    begin("--rate 20 --duration endless --wait-for-start", "dead.toml", "60000000");
  }
  [[nodiscard]] Outcome to_run(const std::string& command) const {
    return tandem(command + " --socket " + socket_);
  }
  [[nodiscard]] std::string phase() const {
    const Outcome asked = to_run("ask '{\"do\": \"status\"}'");
    const auto answer = nlohmann::json::parse(asked.out, nullptr, false);
    return answer.is_object() ? answer.value("phase", "") : asked.err;
  }
  [[nodiscard]] bool comes_to(const std::string& wanted) {
    return test::eventually([&] {
      (void)manager_.heard();
      return phase() == wanted;
    });
  }
  int end() {
    EXPECT_TRUE(test::eventually([&] {
      (void)manager_.heard();
      return run_->ended();
    }));
    (void)manager_.heard();
    return run_->status().value_or(-1);
  }
  [[nodiscard]] std::string said() const { return read_text(folder_ / "run.err"); }

  ServiceManager manager_;
  std::string log_ = "--no-log";
  const std::string socket_ = test::socket_path("-service");
  std::optional<Background> run_;
};

TEST_F(Service, IsReadyWhenItsLoopCyclesAndStopsInOrderBySigterm) {
  begin("--rate 1 --duration endless");
  ASSERT_TRUE(manager_.hears("STATUS=running")) << said();
  const std::size_t ready = manager_.place("READY=1"), life = manager_.place("WATCHDOG=1");
  EXPECT_LT(ready, life);
  EXPECT_LT(life, manager_.heard().size());
  ::kill(run_->id(), SIGTERM);
  ASSERT_TRUE(manager_.hears("STOPPING=1"));
  (void)end();
  EXPECT_EQ(manager_.heard().back(), "STOPPING=1");
}

TEST_F(Service, GivesNoSignOfLifeWhileItsTimeIsPaused) {
  begin("--rate 1 --duration endless", "hold.toml", "8000");
  ASSERT_TRUE(manager_.hears("STATUS=running")) << said();
  ASSERT_EQ(to_run("clock pause").status, 0);
  ASSERT_TRUE(manager_.hears("WATCHDOG_USEC=0"));
  ASSERT_TRUE(manager_.hears("STATUS=simulated time is paused"));
  EXPECT_EQ(phase(), "running");  // some limits later
  EXPECT_EQ(phase(), "running");
  const std::size_t paused = manager_.place("WATCHDOG_USEC=0");
  const std::size_t now = manager_.heard().size();
  EXPECT_EQ(manager_.count("WATCHDOG=1", paused, now), 0);
  ASSERT_EQ(to_run("clock resume").status, 0);
  ASSERT_TRUE(manager_.hears("WATCHDOG_USEC=8000"));
  ASSERT_TRUE(test::eventually(
      [&] { return manager_.place("WATCHDOG=1", now) < manager_.heard().size(); }));
  EXPECT_EQ(to_run("ask '{\"do\": \"run.stop\"}'").status, 0);
  EXPECT_EQ(end(), 0) << said();
}

TEST_F(Service, GivesNoSignOfLifeWhenItsLoopHangs) {
  write_text(folder_ / "hangs.toml",
             "robot = \"robot.toml\"\nduration_s = \"endless\"\n[faults]\nwatchdog_s = 0.2\n"
             "[[controller]]\nplugin = \"" TANDEM_BINARY_DIR "/tests/test_plugins/hangs.so\"\n");
  begin("--rate 1", "hangs.toml", "8000");
  ASSERT_TRUE(manager_.hears("STATUS=the loop hangs in the controller 'hangs'")) << said();
  EXPECT_EQ(end(), 1) << said();
  const std::size_t hung = manager_.place("STATUS=the loop hangs");
  EXPECT_GT(manager_.count("WATCHDOG=1", 0, hung), 0);
  EXPECT_EQ(manager_.count("WATCHDOG=1", hung, manager_.heard().size()), 0);
  EXPECT_EQ(manager_.heard().back(), "STOPPING=1");
}

TEST_F(Service, WaitsForAPersonAndThenRuns) {
  begin("--rate 1 --duration endless --wait-for-start");
  ASSERT_TRUE(manager_.hears("READY=1\nSTATUS=waits for its start: tandem controller start"));
  EXPECT_EQ(phase(), "waiting");
  EXPECT_EQ(manager_.place("WATCHDOG=1"), manager_.heard().size());
  const Outcome early = to_run("joint list");
  EXPECT_EQ(early.status, 2);
  EXPECT_NE(early.err.find("waits for its start"), std::string::npos) << early.err;
  const Outcome start = to_run("controller start");
  EXPECT_EQ(start.status, 0) << start.err;
  EXPECT_NE(start.out.find("then the controllers start"), std::string::npos) << start.out;
  EXPECT_TRUE(comes_to("running")) << said();
  EXPECT_TRUE(manager_.hears("STATUS=running"));
  EXPECT_TRUE(manager_.hears("WATCHDOG=1"));
  ::kill(run_->id(), SIGTERM);
  (void)end();
}

TEST_F(Service, AnEmergencyStopWhileItWaitsIsLatched) {
  begin("--rate 1 --duration endless --wait-for-start");
  ASSERT_TRUE(manager_.hears("READY=1"));
  const Outcome stop = to_run("estop --category 0");
  EXPECT_EQ(stop.status, 0) << stop.err;
  EXPECT_NE(stop.out.find("no drive was enabled"), std::string::npos) << stop.out;
  // Asked for nothing it is the robot's own, and before controllers run no retreat. It was 0,
  // and 2.
  for (const char* words : {"estop", "estop --category 2"}) {
    const Outcome again = to_run(words);
    EXPECT_NE(again.out.find("category 1"), std::string::npos) << again.out;
  }
  // It had counted one, without a row.
  const Outcome shown = to_run("fault show");
  EXPECT_NE(shown.out.find("1 latched"), std::string::npos) << shown.out;
  EXPECT_NE(shown.out.find("emergency stop on request  torque off"), std::string::npos)
      << shown.out;
  // It had advised the start alone, which is refused.
  const Outcome list = to_run("controller list");
  EXPECT_NE(list.err.find("an emergency stop is latched"), std::string::npos) << list.err;
  EXPECT_NE(list.err.find("tandem fault reset, then tandem controller start"), std::string::npos)
      << list.err;
  const Outcome refused = to_run("controller start");
  EXPECT_NE(refused.status, 0);
  EXPECT_NE(refused.err.find("an emergency stop is latched"), std::string::npos) << refused.err;
  // It had said that nothing was latched, though it cleared it.
  const Outcome reset = to_run("fault reset");
  EXPECT_EQ(reset.status, 0);
  EXPECT_NE(reset.out.find("the emergency stop is cleared"), std::string::npos) << reset.out;
  EXPECT_NE(to_run("fault reset").out.find("nothing is latched"), std::string::npos);
  EXPECT_EQ(phase(), "waiting") << "a reset is no start";
  EXPECT_EQ(to_run("controller start").status, 0);
  EXPECT_TRUE(comes_to("running")) << said();
  EXPECT_EQ(to_run("ask '{\"do\": \"run.stop\"}'").status, 0);
  EXPECT_EQ(end(), 0) << said();
}

// Where it said "ask again" the robot was enabled; where it was confirmed in time for no drive to
// be enabled, the next start needed no reset; and between the wait and the run nobody was found.
TEST_F(Service, AnEmergencyStopAtAnyMomentOfItsStartIsLatched) {
  for (const int after_ms : {0, 5, 10, 20, 40, 80, 160}) {
    SCOPED_TRACE(after_ms);
    begin("--rate 1 --duration endless --on-fault wait --wait-for-start");
    ASSERT_TRUE(comes_to("waiting"));
    ASSERT_EQ(to_run("controller start").status, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
    const Outcome stop = to_run("estop");
    EXPECT_EQ(stop.status, 0) << stop.err;
    ASSERT_TRUE(test::eventually([&] {
      const std::string now = phase();
      return now == "waiting" || now == "faulted";
    })) << phase();
    const Outcome refused = to_run("controller start");
    EXPECT_NE(refused.status, 0) << refused.out;
    EXPECT_NE(refused.err.find("latched"), std::string::npos) << refused.err;
    ::kill(run_->id(), SIGTERM);
    (void)end();
    run_.reset();
  }
}

// The second waited for an answer for ever, and with it the process, which no signal ended.
TEST_F(Service, IsStartedOnce) {
  begin("--rate 1 --duration endless --wait-for-start");
  ASSERT_TRUE(manager_.hears("READY=1"));
  ASSERT_EQ(to_run("controller start").status, 0);
  const Outcome again = to_run("controller start");
  EXPECT_NE(again.status, 0) << again.out;
  EXPECT_EQ(again.err.find("no answer"), std::string::npos) << again.err;
  EXPECT_TRUE(comes_to("running")) << said();
  ::kill(run_->id(), SIGTERM);
  (void)end();
}

TEST_F(Service, TakesNoRobotOfAnotherProcess) {
  const Outcome refused =
      tandem("run hold.toml --hal dds --no-log -q --wait-for-start --socket " + socket_);
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("--wait-for-start"), std::string::npos) << refused.err;
}

TEST_F(Service, EndsWhileItWaits) {
  begin("--wait-for-start");
  ASSERT_TRUE(manager_.hears("READY=1"));
  ::kill(run_->id(), SIGTERM);
  EXPECT_EQ(end(), 128 + SIGTERM);
  EXPECT_EQ(manager_.heard().back(), "STOPPING=1");
}

// The cable was not plugged in when the computer booted: the service ended, and nobody could
// start it but root.
TEST_F(Service, WaitsOnForARobotThatIsNotThere) {
  begin("--hal can --interface can0=tdm_none --duration endless --wait-for-start");
  ASSERT_TRUE(manager_.hears("READY=1"));
  for (int i = 0; i < 2; ++i) {
    const Outcome refused = to_run("controller start");
    EXPECT_NE(refused.status, 0);
    EXPECT_NE(refused.err.find("tdm_none"), std::string::npos) << refused.err;
    EXPECT_EQ(phase(), "waiting");
  }
  EXPECT_TRUE(
      manager_.hears("READY=1\nSTATUS=waits for its start: tandem controller start; before:"));
  EXPECT_EQ(to_run("ask '{\"do\": \"run.stop\"}'").status, 0);
  EXPECT_EQ(end(), 0);
}

// Its drives had no power: the service of a fresh robot ended after ten seconds.
TEST_F(Service, WaitsAgainWhereNoDriveCouldBeEnabled) {
  begin_without_power();
  ASSERT_TRUE(manager_.hears("READY=1"));
  EXPECT_EQ(to_run("controller start").status, 0);
  EXPECT_TRUE(
      manager_.hears("READY=1\nSTATUS=waits for its start: tandem controller start; before:"))
      << said();
  EXPECT_TRUE(comes_to("waiting"));
  EXPECT_EQ(manager_.place("STOPPING=1"), manager_.heard().size());
  EXPECT_EQ(to_run("ask '{\"do\": \"run.stop\"}'").status, 0);
  EXPECT_EQ(end(), 0) << said();
}

// It read them again and again, and never ended.
TEST_F(Service, EndsWhereItsFilesAreWrongWhenItWaitsAgain) {
  begin_without_power();
  ASSERT_TRUE(manager_.hears("READY=1"));
  write_text(folder_ / "dead.toml", "nonsense = 1\n");
  EXPECT_EQ(to_run("controller start").status, 0);
  EXPECT_EQ(end(), 2);
  EXPECT_NE(said().find("nonsense"), std::string::npos) << said();
  EXPECT_EQ(said().find("nonsense"), said().rfind("nonsense")) << "said once";
}

// The service of a robot that had booted ended with its start, and nobody could start it again but
// root.
TEST_F(Service, WaitsOnWhereTheDiskHasNoRoomForItsLog) {
  edit("hold.toml", "seed = 1", "seed = 1\n[log]\nkeep_free_MB = 1e9");
  log_ = "--log logs";
  begin("--rate 1 --duration endless --wait-for-start");
  ASSERT_TRUE(manager_.hears("READY=1")) << said();
  for (int i = 0; i < 2; ++i) {
    const Outcome refused = to_run("controller start");
    EXPECT_NE(refused.status, 0);
    EXPECT_NE(refused.err.find("the disk is too full for the log"), std::string::npos)
        << refused.err;
    EXPECT_EQ(phase(), "waiting");
  }
  EXPECT_TRUE(
      manager_.hears("READY=1\nSTATUS=waits for its start: tandem controller start; before:"));
  EXPECT_FALSE(has_log());
  ::kill(run_->id(), SIGTERM);
  EXPECT_EQ(end(), 128 + SIGTERM);
}

TEST_F(Service, StartsOnceItsLogHasAPlace) {
  write_text(folder_ / "logs", "no folder");
  log_ = "--log logs";
  begin("--rate 1 --duration endless --wait-for-start");
  ASSERT_TRUE(manager_.hears("READY=1"));
  const Outcome refused = to_run("controller start");
  EXPECT_NE(refused.status, 0);
  EXPECT_NE(refused.err.find("log's folder"), std::string::npos) << refused.err;
  std::filesystem::remove(folder_ / "logs");
  EXPECT_EQ(to_run("controller start").status, 0);
  EXPECT_TRUE(comes_to("running")) << said();
  EXPECT_EQ(to_run("ask '{\"do\": \"run.stop\"}'").status, 0);
  EXPECT_EQ(end(), 0) << said();
  EXPECT_TRUE(has_log());
}

TEST_F(Service, NeedsASocketToBeStartedBy) {
  const Outcome run = tandem("run hold.toml --wait-for-start --no-socket");
  EXPECT_EQ(run.status, 2);
  EXPECT_NE(run.err.find("--no-socket"), std::string::npos) << run.err;
}

// --- scripts/tandem@.service ---

constexpr char kUnit[] = TANDEM_SOURCE_DIR "/scripts/tandem@.service";

TEST(Unit, StartsNothingByItself) {
  const std::string unit = read_text(kUnit);
  for (const char* line : {"\nType=notify\n", "\nRestart=no\n", " --wait-for-start ",
                           "\nWatchdogSec=", "\nTimeoutStopSec=", "\nUser=tandem\n",
                           "\nLimitMEMLOCK=infinity\n", "\nLimitRTPRIO="})
    EXPECT_NE(unit.find(line), std::string::npos) << line;
}

/// An instance of the unit, with this build's program.
class UnitFile : public Program {
 protected:
  void SetUp() override {
    if (std::system("command -v systemd-analyze >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "systemd-analyze is not installed (Debian: systemd)";
    Program::SetUp();
    std::string unit = read_text(kUnit);
    const std::string program = "\nExecStart=tandem ";
    const std::size_t at = unit.find(program);
    ASSERT_NE(at, std::string::npos);
    unit.replace(at, program.size(), "\nExecStart=/bin/true ");  // what is there on every machine
    write_text(folder_ / "tandem@arm.service", unit);
  }
  [[nodiscard]] Outcome analyze(const std::string& arguments) const {
    const std::string command = "cd " + shell_word(folder_.string()) + " && systemd-analyze " +
                                arguments + " ./tandem@arm.service >out.txt 2>err.txt </dev/null";
    const int raw = std::system(command.c_str());
    return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, read_text(folder_ / "out.txt"),
            read_text(folder_ / "err.txt")};
  }
};

TEST_F(UnitFile, IsWithoutFaultForSystemd) {
  const Outcome checked = analyze("verify --man=no");
  EXPECT_EQ(checked.status, 0) << checked.err;
  EXPECT_EQ(checked.err, "");
}

/// 10 is a program that may everything; 2.2 when this was written.
TEST_F(UnitFile, IsExposedNoMoreThanItHasToBe) {
  const Outcome checked = analyze("security --offline=yes --no-pager --threshold=25");
  EXPECT_EQ(checked.status, 0) << checked.out << checked.err;
  EXPECT_NE(checked.out.find("Overall exposure level"), std::string::npos) << checked.out;
}

}  // namespace
}  // namespace tandem::apps
