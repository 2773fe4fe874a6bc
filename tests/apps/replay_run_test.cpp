// `tandem replay` as people type it: its words, its status, its log, and each build that follows.
#include <thread>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

class ReplayProgram : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    ASSERT_EQ(tandem("run hold.toml --no-socket -q --duration 0.2 --log logs").status, 0);
    for (const auto& entry : fs::directory_iterator(folder_ / "logs"))
      log_ = "logs/" + entry.path().filename().string();
  }
  void copy_hold() const {
    fs::copy_file(TANDEM_BINARY_DIR "/lib/controllers/hold.so", folder_ / "hold.so.new");
    fs::rename(folder_ / "hold.so.new", folder_ / "hold.so");
  }
  [[nodiscard]] int count(const std::string& file, const std::string& words) const {
    const std::string text = read_text(folder_ / file);
    int found = 0;
    for (std::size_t at = 0; (at = text.find(words, at)) != std::string::npos; ++at) ++found;
    return found;
  }
  bool await(const std::string& words, int times) const {
    for (int i = 0; i < 2000 && count("watch.txt", words) < times; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return count("watch.txt", words) == times;
  }

  std::string log_;
};

TEST_F(ReplayProgram, SaysThatItIsEqualAndHowFast) {
  const Outcome outcome = tandem("replay " + log_ + " --json replay.json");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("equal, "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("times real time"), std::string::npos) << outcome.out;
  EXPECT_EQ(json("replay.json")["equal"], true);
  EXPECT_TRUE(json("replay.json")["first"].is_null());
  EXPECT_FALSE(fs::exists(folder_ / fs::path(log_).replace_extension("replay.mcap")));
}

TEST_F(ReplayProgram, RefusesWhatIsNoReplayToWriteOver) {
  const Outcome outcome = tandem("replay " + log_ + " -o " + log_);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("is there, and is no replay's log"), std::string::npos) << outcome.err;
  EXPECT_EQ(tandem("replay hold.toml").status, 2);
  EXPECT_EQ(tandem("replay " + log_ + " --plugin hold").status, 2);
}

TEST_F(ReplayProgram, RepeatsItAtEachBuildAndGoesOnAfterAnError) {
  copy_hold();
  const std::string command = "cd " + shell_word(folder_.string()) + " && { " +
                              shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " replay " + log_ +
                              " --plugin hold=hold.so --watch >watch.txt 2>&1 & echo $! >pid; }";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_TRUE(await("watching hold.so", 1));
  EXPECT_EQ(count("watch.txt", "equal, "), 1);
  EXPECT_TRUE(fs::exists(folder_ / fs::path(log_).replace_extension("replay.mcap")));
  write_text(folder_ / "hold.so", "no library");
  EXPECT_TRUE(await("watching hold.so", 2));
  EXPECT_EQ(count("watch.txt", "equal, "), 1);
  copy_hold();
  EXPECT_TRUE(await("watching hold.so", 3));
  EXPECT_EQ(count("watch.txt", "equal, "), 2) << read_text(folder_ / "watch.txt");
  const std::string end = "p=$(cat " + shell_word((folder_ / "pid").string()) +
                          "); kill -TERM $p; while kill -0 $p 2>/dev/null; do sleep 0.02; done";
  EXPECT_EQ(std::system(end.c_str()), 0);
}

// It died by the signal, without a word, and left its draft behind; one that hangs had to be
// killed.
TEST_F(ReplayProgram, NamesAControllerThatCrashesOrHangsAndLeavesNothing) {
  const auto run = [this](const std::string& how) {
    write_text(
        folder_ / "hangs.toml",
        "robot = \"robot.toml\"\nposture = \"ready\"\nduration_s = 0.3\n"
        "[faults]\nwatchdog_s = 1.0\n[[controller]]\nplugin = \"" TANDEM_BINARY_DIR
        "/tests/test_plugins/hangs.so\"\n[controller.parameters]\nafter_cycles = 1_000_000\n" +
            how);
    fs::remove_all(folder_ / "crashed");
    EXPECT_EQ(tandem("run hangs.toml --no-socket -q --log crashed").status, 0);
  };
  for (const auto& [how, what] :
       {std::pair("crash = \"null\"",
                  "the replay crashed in the controller 'hangs': "
                  "segmentation fault (SIGSEGV) in "),
        {"throws = true", "the replay crashed in the controller 'hangs': an exception"},
        {"crash = \"exit\"", "the replay crashed in the controller 'hangs': exit()"},
        {"", "the replay hangs: no cycle for 1 s, it is in the controller 'hangs'"}}) {
    run(how);
    const Outcome outcome = tandem(
        "replay crashed/double_pendulum-hangs-001.mcap -o crashed/again.mcap --json replay.json",
        "HANGS_AFTER_CYCLES=100");
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(what), std::string::npos) << outcome.err;
    EXPECT_NE(json("replay.json")["errors"].dump().find(what), std::string::npos)
        << json("replay.json").dump();
    int files = 0;
    for (const auto& entry : fs::directory_iterator(folder_ / "crashed"))
      files += entry.path().extension() == ".mcap" ? 1 : 0;
    EXPECT_EQ(files, 1) << "the run's log";
  }
}

}  // namespace
}  // namespace tandem::apps
