// A `tandem run` in the background of a test, that others ask.
#pragma once

#include <chrono>
#include <string>
#include <thread>

#include "tests/apps/program.hpp"
#include "tests/support/socket_path.hpp"

namespace tandem::apps {

class Running : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    socket_ = tandem::test::socket_path();
  }
  /// A test that ends early leaves no run behind: it would stay in a domain that others have next.
  void TearDown() override {
    if (run_.joinable()) {
      (void)std::system(
          ("kill -KILL $(cat " + shell_word((folder_ / "pid").string()) + ") 2>/dev/null").c_str());
      run_.join();
    }
    Program::TearDown();
  }
  /// `tandem run hold.toml MORE`, twenty times faster than a clock, until its controllers run.
  void begin(const std::string& more) {
    start("--rate 20 --duration 2000 " + more);
    until(R"("phase": "running")");
  }
  /// The same with no flags but these, and without waiting.
  void start(const std::string& flags) {
    run_ = std::thread([this, flags] {
      const std::string command =
          "cd " + shell_word(folder_.string()) + " && echo $$ >pid && exec " +
          shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " run hold.toml " + log_flags_ +
          " -q --json run.json --socket " + socket_ + " " + flags + " 2>run.txt";
      const int raw = std::system(command.c_str());
      status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : -1;
    });
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
  void signal(const std::string& name) const {
    const std::string pid = (folder_ / "pid").string();
    EXPECT_EQ(std::system(("kill -" + name + " $(cat " + shell_word(pid) + ")").c_str()), 0);
  }
  /// Waits for the run's end. @return its exit status.
  int join() {
    run_.join();
    return status_;
  }
  int end() {
    (void)to_run("ask '{\"do\": \"run.stop\"}'");
    return join();
  }

  std::string log_flags_ = "--no-log";  // of begin() and start()
  std::string socket_;
  std::thread run_;
  int status_ = -1;
};

}  // namespace tandem::apps
