// `tandem fault` and `tandem estop` against a running `tandem run`.
#include "tests/apps/program.hpp"

#include <chrono>
#include <thread>

namespace tandem::apps {
namespace {

/// A run in the background, with a socket in the test's folder.
class Faults : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    socket_ = "/tmp/tandem-test-" + std::to_string(::getpid()) + ".sock";
  }
  void begin(const std::string& more) {
    run_ = std::thread([this, more] {
      const std::string command =
          "cd '" + folder_.string() + "' && echo $$ >pid && exec '" + TANDEM_BINARY_DIR +
          "/bin/tandem' run hold.toml --rate 20 --duration 2000 --no-log -q --json run.json "
          "--socket " + socket_ + " " + more + " 2>run.txt";
      const int raw = std::system(command.c_str());
      status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : -1;
    });
    until(R"("phase": "running")");
  }
  /// Asks for the status until the answer holds `text`.
  void until(const std::string& text) const {
    std::string answer;
    for (int i = 0; i < 2000 && answer.find(text) == std::string::npos; ++i) {
      answer = tandem("ask '{\"do\": \"status\"}' --socket " + socket_).out;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    EXPECT_NE(answer.find(text), std::string::npos) << answer;
  }
  [[nodiscard]] Outcome to_run(const std::string& command) const {
    return tandem(command + " --socket " + socket_);
  }
  int end() {
    (void)to_run("ask '{\"do\": \"run.stop\"}'");
    run_.join();
    return status_;
  }

  std::string socket_;
  std::thread run_;
  int status_ = -1;
};

TEST_F(Faults, AreShownAndResetWhileTheRunWaits) {
  begin("--on-fault wait");
  EXPECT_EQ(to_run("fault reset").out, "nothing is latched\n");
  EXPECT_EQ(to_run("estop --category 0").out, "emergency stop, category0\n");
  until(R"("phase": "faulted")");
  const Outcome shown = to_run("fault show");
  for (const char* text : {"phase faulted, 1 latched", "emergency stop on request", "torque off"}) {
    EXPECT_NE(shown.out.find(text), std::string::npos) << text << "\nin: " << shown.out;
  }
  const Outcome reset = to_run("fault reset");
  EXPECT_EQ(reset.status, 0) << reset.err;
  EXPECT_NE(reset.out.find("every joint is enabled where it is"), std::string::npos) << reset.out;
  EXPECT_NE(reset.out.find("cleared at"), std::string::npos) << reset.out;
  EXPECT_EQ(end(), 0) << "what was reset is no failure of the run";
  const auto result = json("run.json");
  EXPECT_TRUE(result["faults"].empty());
  ASSERT_EQ(result["fault_log"].size(), 1U);
  EXPECT_EQ(result["fault_log"][0]["category"], "category0");
  EXPECT_EQ(result["fault_log"][0]["latched"], false);
}

TEST_F(Faults, BySignalAreOfTheRobotsCategory) {
  begin("--on-fault wait");
  ASSERT_EQ(std::system(("kill -USR1 $(cat '" + (folder_ / "pid").string() + "')").c_str()), 0);
  until(R"("phase": "faulted")");
  const Outcome shown = to_run("fault show --json -");
  const auto answer = nlohmann::json::parse(shown.out, nullptr, false);
  EXPECT_EQ(answer["faults"][0]["cause"], "emergency stop by a signal");
  EXPECT_EQ(answer["faults"][0]["category"], "category1");
  EXPECT_EQ(end(), 1) << "it is still latched";
}

TEST_F(Faults, EndASimulatedRunThatWasNotToldToWait) {
  begin("");
  EXPECT_EQ(to_run("estop").status, 0);
  run_.join();
  EXPECT_EQ(status_, 1);
  EXPECT_NE(read_text(folder_ / "run.txt").find("emergency stop on request"), std::string::npos);
}

TEST_F(Faults, OfNoRunAreAnError) {
  const Outcome outcome = to_run("fault show");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("nobody listens"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tandem::apps
