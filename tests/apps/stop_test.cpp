// Stops of a run whose loop hangs: what `tandem estop` answers.
#include <sys/stat.h>

#include <csignal>

#include "tests/apps/running.hpp"

namespace tandem::apps {
namespace {

class Stops : public Running {
 protected:
  /// hold.toml runs a controller that hangs for so long (0: for ever) in its 100th cycle.
  void hang(const std::string& for_s, const std::string& more = {}) const {
    edit("hold.toml", "plugin = \"hold\"",
         "name = \"lazy\"\nplugin = \"" TANDEM_BINARY_DIR
         "/tests/test_plugins/hangs.so\"\n[controller.parameters]\nfor_s = " +
             for_s + "\n" + more);
  }
  /// run.json has one error, with function, file and line of the controller's own code.
  void expect_crash(const std::string& message) const {
    const nlohmann::json is = json("run.json");
    EXPECT_EQ(is["ok"], false);
    const nlohmann::json error = is["errors"][0];
    const std::string said = error["message"];
    EXPECT_TRUE(said.starts_with(message)) << error;
    EXPECT_NE(said.find(" in "), std::string::npos) << error;
    EXPECT_TRUE(std::string(error["file"]).ends_with("hangs.cpp")) << error;
    EXPECT_GT(error["line"], 0) << error;
  }
};

TEST_F(Stops, AreConfirmedByTheLoopWithItsCycle) {
  begin("--on-fault wait");
  const Outcome asked = to_run("ask '{\"do\": \"estop\", \"category\": 0}'");
  const auto answer = nlohmann::json::parse(asked.out, nullptr, false);
  EXPECT_EQ(answer["confirmed"], true) << asked.out;
  EXPECT_GT(answer["cycle"].get<int>(), 100) << asked.out;
  EXPECT_NE(to_run("ask '{\"do\": \"status\"}'").out.find(R"("phase": "faulted")"),
            std::string::npos)
      << "what is confirmed is carried out";
  EXPECT_EQ(end(), 1);
}

// It had printed "emergency stop, category0" and returned 0, and the run had hung for ever.
TEST_F(Stops, AreNotConfirmedByALoopThatHangsWhichTheWatchdogEnds) {
  hang("0.0", "[faults]\nwatchdog_s = 2.0\n");
  start("");
  until(R"("running_cycles": 99)");
  const Outcome stop = to_run("estop --category 0");
  EXPECT_EQ(stop.status, 1);
  EXPECT_EQ(stop.out, "");
  EXPECT_NE(stop.err.find("not confirmed by the loop within 1.01 s"), std::string::npos)
      << stop.err;
  EXPECT_EQ(join(), 1);
  const std::string told = read_text(folder_ / "run.txt");
  EXPECT_NE(
      told.find("fault: the loop hangs: no cycle for 2 s, it is in the controller 'lazy'. The "
                "emergency stop is latched; the process ends in 2 s"),
      std::string::npos)
      << told;
  const std::string last = "the loop hung in the controller 'lazy' and did not come back";
  EXPECT_NE(told.find("fault: " + last), std::string::npos) << told;
  EXPECT_EQ(json("run.json")["ok"], false);
  EXPECT_EQ(json("run.json")["errors"][0]["message"], last);
  EXPECT_FALSE(std::filesystem::exists(socket_)) << "the next run finds its way clear";
}

TEST_F(Stops, DoNotComeFromTimeThatIsWaived) {
  hang("1.0", "[faults]\nwatchdog_s = 0.2\n");
  const Outcome run = tandem("run hold.toml --no-socket --no-log --debug --duration 0.3");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("free running, without limits of time"), std::string::npos) << run.out;
  EXPECT_EQ(tandem("run hold.toml --no-socket --no-log -q --duration 0.3").status, 1);
  for (const char* elsewhere : {"--hal can", "--hal dds", "--hal can --lockstep"}) {
    const Outcome robot = tandem(std::string("run hold.toml --no-log -q --debug ") + elsewhere);
    EXPECT_EQ(robot.status, 2);
    EXPECT_NE(robot.err.find("--debug waives the limits of time that keep a robot safe"),
              std::string::npos)
        << robot.err;
  }
}

TEST_F(Stops, OfALoopThatHangsLeaveALogThatCanBeRead) {
  hang("0.0", "[faults]\nwatchdog_s = 0.2\n");
  EXPECT_EQ(tandem("run hold.toml --no-socket -q").status, 1);
  const Outcome info = tandem("log info runs/*.mcap");
  EXPECT_EQ(info.status, 0) << info.err;
  EXPECT_NE(info.out.find("/tandem/state"), std::string::npos) << info.out;
  EXPECT_EQ(info.out.find("no index"), std::string::npos) << info.out;
}

// std::terminate had ended the process by SIGABRT: no controller's name, no NMT stop, half a log.
TEST_F(Stops, OfAControllerThatThrowsAreThoseOfOneThatHangs) {
  hang("0.0", "throws = true\n[faults]\nwatchdog_s = 0.2\n");
  const Outcome run = tandem("run hold.toml --no-socket -q --json run.json");
  EXPECT_EQ(run.status, 1);
  for (const char* text :
       {"fault: an exception left the loop, which stands still: no such thing",
        "fault: the loop crashed in the controller 'lazy': an exception; the log", "(hangs.so+0x",
        "\n  update at "}) {
    EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
  }
  EXPECT_EQ(json("run.json")["ok"], false);
  const Outcome info = tandem("log info runs/*.mcap");
  EXPECT_EQ(info.status, 0) << info.err;
  EXPECT_EQ(info.out.find("no index"), std::string::npos) << info.out;
}

// The file had still said "as planned" of the former run.
TEST_F(Stops, ByAKillLeaveNoResultOfAFormerRun) {
  const std::filesystem::path result = folder_ / "run.json";
  for (const bool linked : {false, true}) {
    std::filesystem::remove(result);
    write_text(folder_ / "former.json", R"({"ended": "as planned"})");
    if (linked) {
      std::filesystem::create_symlink("former.json", result);
    } else {
      std::filesystem::copy_file(folder_ / "former.json", result);
    }
    begin("");
    EXPECT_EQ(std::filesystem::exists(result), linked);
    if (linked) {
      EXPECT_EQ(read_text(result), "") << "the link is its owner's";
    }
    signal("KILL");
    EXPECT_EQ(join(), -1);
    EXPECT_EQ(read_text(result), "");
  }
}

TEST_F(Stops, AreNotTheEndOfACommandThatDoesNotSayWhoseCrashItWas) {
  if (TANDEM_SANITIZED != 0) GTEST_SKIP() << "a sanitizer handles signals itself";
  hang("0.0", "crash = \"null\"\nat_once = true\n");
  for (const char* command : {"check hold.toml", "run hold.toml -q --no-log --duration 1"}) {
    write_text(folder_ / "run.json", R"({"ok": true, "ended": "as planned"})");
    const Outcome outcome = tandem(std::string(command) + " --json run.json");
    EXPECT_NE(outcome.err.find("error: lazy: the controller crashed before its first cycle: "
                               "segmentation fault (SIGSEGV)"),
              std::string::npos)
        << outcome.err;
    EXPECT_EQ(outcome.status, 128 + SIGSEGV);
    expect_crash("the controller crashed before its first cycle: segmentation fault (SIGSEGV) in ");
    EXPECT_EQ(json("run.json")["errors"][0]["key"], "lazy");
  }
  edit("hold.toml", "\"null\"", "\"exit\"");
  EXPECT_EQ(tandem("check hold.toml --json run.json").status, 2);
  EXPECT_EQ(json("run.json")["errors"][0]["message"], "the controller called exit()");
}

// The process had ended by the signal, or with status 0: no controller's name, no NMT stop.
TEST_F(Stops, OfAControllerThatCrashesAreThoseOfOneThatHangs) {
  const std::pair<const char*, const char*> crashes[] = {
      {"null", "the loop crashed, and stands still: segmentation fault (SIGSEGV) at hangs.so+0x"},
      {"stack", "the loop crashed, and stands still: segmentation fault (SIGSEGV) at hangs.so+0x"},
      {"abort", "fault: the loop crashed, and stands still: abort() (SIGABRT) at hangs.so+0x"},
      {"divide", "the loop crashed, and stands still: arithmetic error (SIGFPE) at hangs.so+0x"},
      {"wild", "the loop crashed, and stands still: segmentation fault (SIGSEGV) at hangs.so+0x"},
      {"smash", "the loop crashed, and stands still: "},
      {"exit", "fault: exit() was called in the loop, which stands still at hangs.so+0x"}};
  // A crash is no hang: nothing waits for the watchdog's time.
  hang("0.0", "crash = \"none\"\n[faults]\nwatchdog_s = 3600\n");
  std::string before = "none";
  for (const auto& [crash, text] : crashes) {
    if (TANDEM_SANITIZED != 0 && crash != std::string("exit")) continue;  // handles signals itself
    edit("hold.toml", "crash = \"" + before + "\"", std::string("crash = \"") + crash + "\"");
    before = crash;
    const Outcome run = tandem("run hold.toml --no-socket -q --json run.json");
    EXPECT_EQ(run.status, 1) << crash;
    EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
    for (const char* said : {"the loop stands still, it is in the controller 'lazy'. The emergency "
                             "stop is latched",
                             "the loop crashed in the controller 'lazy': "}) {
      EXPECT_NE(run.err.find(said), std::string::npos) << run.err;
    }
    EXPECT_EQ(run.err.find("hung"), std::string::npos) << run.err;
    if (crash == std::string("wild")) {
      const Outcome watched = tandem("run hold.toml --gate --no-socket -q");
      EXPECT_EQ(watched.status, 1) << "the gate looks at the stack of each system call";
      EXPECT_NE(watched.err.find(text), std::string::npos) << watched.err;
    }
    if (crash == std::string("smash")) {  // where the way back is overwritten, nobody can say
      EXPECT_NE(json("run.json")["errors"][0]["hint"].dump().find("-fsanitize=address"),
                std::string::npos)
          << json("run.json");
    } else {
      const char* const place = crash == std::string("stack")  ? "fill at "
                                : crash == std::string("wild") ? "\n  crash at "
                                                               : "\n  update at ";
      EXPECT_NE(run.err.find(place), std::string::npos) << crash << "\n" << run.err;
      EXPECT_NE(run.err.find("(hangs.so+0x"), std::string::npos) << crash << "\n" << run.err;
      expect_crash("the loop crashed in the controller 'lazy': ");
    }
    if (crash == std::string("null")) {
      const std::string log = tandem("log info runs/*.mcap").out;
      EXPECT_NE(log.find("hangs.cpp:"), std::string::npos) << log;
    }
    std::filesystem::remove_all(folder_ / "runs");
  }
}

// Nothing had been said of the place, and the thread had read on for ever: here the library's file
// is a pipe by then, whose end never comes.
TEST_F(Stops, OfACrashHaveItsOffsetWhereNoDebugInformationCanBeRead) {
  if (TANDEM_SANITIZED != 0) GTEST_SKIP() << "a sanitizer handles signals itself";
  const std::filesystem::path library = folder_ / "gone.so";
  std::filesystem::copy_file(TANDEM_BINARY_DIR "/tests/test_plugins/hangs.so", library);
  edit("hold.toml", "plugin = \"hold\"",
       "name = \"lazy\"\nplugin = \"./gone.so\"\n[controller.parameters]\ncrash = \"null\"\n");
  log_flags_ = "--log l";
  start("--start-paused");
  until(R"("paused": true)");
  std::filesystem::remove(library);
  ASSERT_EQ(::mkfifo(library.c_str(), 0600), 0);
  (void)to_run("clock resume");
  EXPECT_EQ(join(), 1);
  const std::string said = read_text(folder_ / "run.txt");
  EXPECT_NE(said.find("segmentation fault (SIGSEGV) at gone.so+0x"), std::string::npos) << said;
  EXPECT_NE(said.find("called from (innermost first):\n  "), std::string::npos) << said;
  EXPECT_NE(said.find(" (gone.so+0x"), std::string::npos) << said;
  const std::string message = json("run.json")["errors"][0]["message"];
  EXPECT_TRUE(message.starts_with("the loop crashed in the controller 'lazy': segmentation"))
      << message;
  EXPECT_NE(message.find("gone.so+0x"), std::string::npos) << message;
  const Outcome info = tandem("log info l/*.mcap");
  EXPECT_NE(info.out.find("gone.so+0x"), std::string::npos) << info.out;
  EXPECT_EQ(info.out.find("no index"), std::string::npos) << info.out;
}

TEST_F(Stops, OfALoopThatComesBackEndTheRunInOrder) {
  hang("1.0", "[faults]\nwatchdog_s = 0.2\n");
  const Outcome run = tandem("run hold.toml --no-log --no-socket --json run.json");
  EXPECT_EQ(run.status, 1);
  for (const char* text : {"the loop hangs: no cycle for 0.2 s, it is in the controller 'lazy'",
                           "lazy: emergency stop by the watchdog: the loop hung"}) {
    EXPECT_NE(run.err.find(text), std::string::npos) << text << "\nin: " << run.err;
  }
  EXPECT_EQ(json("run.json")["fault_log"][0]["joint"], "lazy");
  EXPECT_LT(json("run.json")["cycles"].get<int>(), 200);
}

// Neither is a hang, whatever the watchdog's time.
TEST_F(Stops, OfTheWatchdogAreNotForALoopThatWaits) {
  edit("hold.toml", "[[controller]]", "[faults]\nwatchdog_s = 0.2\n[[controller]]");
  start("--start-paused --duration 3");
  until(R"("paused": true)");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  (void)to_run("clock rate 2");
  (void)to_run("clock resume");
  until(R"("phase": "running")");
  signal("STOP");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  signal("CONT");
  EXPECT_EQ(join(), 0);
  EXPECT_EQ(read_text(folder_ / "run.txt"), "");
}

TEST_F(Stops, AreNotConfirmedByAProcessThatDoesNotAnswer) {
  begin("--on-fault wait");
  signal("STOP");
  const Outcome stop = to_run("estop");
  EXPECT_EQ(stop.status, 1);
  EXPECT_EQ(stop.err,
            "error: no answer within 3 s (a process that was stopped carries the stop out when it "
            "continues; until then stop the robot by its own stop circuit)\n");
  signal("CONT");
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1);
}

TEST_F(Stops, CannotBeToldToAnImpostorInAFolderThatIsOpen) {
  const std::filesystem::path open = folder_ / "open";
  std::filesystem::create_directory(open);
  std::filesystem::permissions(open, std::filesystem::perms::all);
  const Outcome run = tandem("run hold.toml --no-log --socket open/s.sock");
  EXPECT_EQ(run.status, 2);
  EXPECT_EQ(run.err,
            "error: the socket's folder " + open.string() +
                " may be changed by everybody (its mode is 777): somebody else's socket could take "
                "the place of open/s.sock, and receive its emergency stops (give it to "
                "this user, and take the right to write from others: chmod go-w " +
                shell_word(open.string()) + "; or choose another folder with --socket)\n");
}

TEST_F(Stops, OfNoRunAreNoSuccess) { EXPECT_EQ(to_run("estop").status, 1); }

}  // namespace
}  // namespace tandem::apps
