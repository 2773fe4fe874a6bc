// `tandem estop` without --socket, where several runs of this user go on.
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class SeveralRuns : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    std::filesystem::create_directory(runtime_);
  }
  void TearDown() override {
    for (const pid_t run : runs_) (void)::kill(run, SIGKILL);
    std::filesystem::remove_all(runtime_);
    Program::TearDown();
  }
  /// A run with the flags, whose controllers run. @return its process
  pid_t begin(const std::string& flags) {
    const std::string command =
        "cd " + shell_word(folder_.string()) + " && { " + environment() + " " +
        shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " " + flags +
        " --no-log -q --rate 20 >>runs.txt 2>&1 </dev/null & echo $! >pid; }";
    EXPECT_EQ(std::system(command.c_str()), 0);
    runs_.push_back(std::stoi(read_text(folder_ / "pid")));
    EXPECT_TRUE(until(runs_.back(), "\"phase\": \"running\""));
    return runs_.back();
  }
  [[nodiscard]] std::string environment() const {
    return "TANDEM_SOCKETS=" + shell_word((runtime_ / "tandem").string());
  }
  [[nodiscard]] std::string socket(pid_t run) const {
    return (runtime_ / "tandem" / ("run-" + std::to_string(run) + ".sock")).string();
  }
  [[nodiscard]] Outcome ask(const std::string& command) const {
    return tandem(command, environment());
  }
  /// Whether the run's status holds `text`, soon.
  [[nodiscard]] bool until(pid_t run, const std::string& text) const {
    for (int i = 0; i < 2000; ++i) {
      const Outcome status = ask("ask '{\"do\": \"status\"}' --socket " + socket(run));
      if (status.out.find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  static void expect(const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << "'" << words << "' is not in: " << text;
  }
  static std::string process(pid_t run) { return " (process " + std::to_string(run) + ")"; }

  // In /tmp: a socket's path is short.
  const std::filesystem::path runtime_ =
      "/tmp/tandem-test-" + std::to_string(::getuid()) + "-" + std::to_string(::getpid()) + "-runs";
  std::vector<pid_t> runs_;
};

// None of them was stopped: "2 running, and none of them was asked".
TEST_F(SeveralRuns, AreAllStopped) {
  const pid_t first = begin("run hold.toml --duration 2000 --on-fault wait");
  const pid_t second = begin("run trajectory.toml --duration 2000 --on-fault wait");
  const Outcome stop = ask("estop --category 0");
  EXPECT_EQ(stop.status, 0) << stop.err;
  expect(stop.out, "tandem run hold.toml --duration 2000 --on-fault wait");
  expect(stop.out, process(first) + ": emergency stop, category 0\n");
  expect(stop.out, "tandem run trajectory.toml");
  expect(stop.out, process(second) + ": emergency stop, category 0\n");
  for (const pid_t run : {first, second}) EXPECT_TRUE(until(run, "\"phase\": \"faulted\""));
}

// It printed "emergency stop, category 1" and did not say of what.
TEST_F(SeveralRuns, AreNamedEvenWhenThereIsOne) {
  const pid_t only = begin("run hold.toml --duration 2000 --on-fault wait");
  const Outcome stop = ask("estop");
  EXPECT_EQ(stop.status, 0) << stop.err;
  expect(stop.out, "tandem run hold.toml --duration 2000 --on-fault wait");
  expect(stop.out, process(only) + ": emergency stop, category 1\n");
}

// "no running `tandem run` (start one …)": while a robot moves, that is no help.
TEST_F(SeveralRuns, OfWhichThereIsNoneAreNoReasonToStartOne) {
  const Outcome stop = ask("estop");
  EXPECT_EQ(stop.status, 1);
  expect(stop.err,
         "no run was stopped: none of this user was found in " + (runtime_ / "tandem").string());
  expect(stop.err, "press its emergency stop or cut its power");
  EXPECT_EQ(stop.err.find("start one"), std::string::npos) << stop.err;
}

TEST_F(SeveralRuns, AreStoppedBesideOneThatDoesNotAnswer) {
  const pid_t dumb = begin("run hold.toml --duration 2000 --on-fault wait");
  const pid_t other = begin("run trajectory.toml --duration 2000 --on-fault wait");
  ASSERT_EQ(::kill(dumb, SIGSTOP), 0);
  const Outcome stop = ask("estop");
  EXPECT_EQ(stop.status, 1) << "one did not confirm";
  expect(stop.err, process(dumb) + ": no answer within 3 s");
  expect(stop.out, process(other) + ": emergency stop, category 1\n");
  EXPECT_TRUE(until(other, "\"phase\": \"faulted\""));
  ASSERT_EQ(::kill(dumb, SIGCONT), 0);
  EXPECT_TRUE(until(dumb, "\"phase\": \"faulted\"")) << "it carries the stop out later";
}

TEST_F(SeveralRuns, AreListedWithWhatTheyAreForEveryOtherCommand) {
  const pid_t first = begin("run hold.toml --duration 2000 --on-fault wait");
  const pid_t second = begin("run trajectory.toml --duration 2000 --on-fault wait");
  const Outcome list = ask("joint list");
  EXPECT_EQ(list.status, 2);
  expect(list.err, "2 running `tandem run`, and none of them was asked");
  expect(list.err, "--socket " + socket(first) + "  tandem run hold.toml");
  expect(list.err, "--socket " + socket(second) + "  tandem run trajectory.toml");
  const Outcome stop = ask("estop --socket " + socket(first));
  EXPECT_EQ(stop.out, "emergency stop, category 1\n") << stop.err;
  EXPECT_TRUE(until(second, "\"phase\": \"running\"")) << "it was not named";
}

}  // namespace
}  // namespace tandem::apps
