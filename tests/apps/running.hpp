// A `tandem run` in the background of a test, that others ask.
#pragma once

#include <chrono>
#include <string>
#include <thread>

#include "tests/apps/program.hpp"

namespace tandem::apps {

class Running : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    socket_ = "/tmp/tandem-test-" + std::to_string(::getpid()) + ".sock";
  }
  /// `tandem run hold.toml MORE`, twenty times faster than a clock, until its controllers run.
  void begin(const std::string& more) {
    run_ = std::thread([this, more] {
      const std::string command =
          "cd '" + folder_.string() + "' && echo $$ >pid && exec '" + TANDEM_BINARY_DIR +
          "/bin/tandem' run hold.toml --rate 20 --duration 2000 --no-log -q --json run.json "
          "--socket " +
          socket_ + " " + more + " 2>run.txt";
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

}  // namespace tandem::apps
