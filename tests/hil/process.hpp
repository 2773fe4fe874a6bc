// Programs that run beside a test: `tandem run`, `tandem emulate`, candump.
// Layer: tests.  Thread: any.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/hil/can_interfaces.hpp"

namespace tandem::test {

[[nodiscard]] inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// A child process; its output and its errors go to a file. Killed with its object.
class Process {
 public:
  Process(const std::vector<std::string>& command, std::filesystem::path output)
      : output_(std::move(output)) {
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, output_.c_str(),
                                       O_WRONLY | O_CREAT | O_TRUNC, 0644);
    ::posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
    const int error =
        ::posix_spawnp(&id_, arguments[0], &files, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&files);
    EXPECT_EQ(error, 0) << command[0] << ": " << std::strerror(error);
    if (error != 0) id_ = -1;
  }
  ~Process() {
    if (id_ < 0) return;
    signal(SIGKILL);
    (void)wait();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void signal(int number) const {
    if (id_ > 0) ::kill(id_, number);
  }
  /// @return the exit code; less than 0: the signal that ended it.
  int wait() {
    if (id_ < 0) return code_;
    int status = 0;
    while (::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
    }
    id_ = -1;
    code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    return code_;
  }
  /// Sends SIGINT and waits.
  int interrupt() {
    signal(SIGINT);
    return wait();
  }
  [[nodiscard]] std::string output() const { return text_of(output_); }
  /// Waits until `words` stand in the output. @return false when the process ended without them,
  /// or they did not come in `patience_s`: a slow machine takes 10 s to start a program in
  /// User-Mode Linux.
  [[nodiscard]] bool says(const std::string& words, std::int64_t patience_s = 60) const {
    bool said = false;
    const auto known = [&] {
      const bool over = ended();  // before the look: what was said last is still seen
      said = output().find(words) != std::string::npos;
      return said || over;
    };
    return eventually(known, patience_s) && said;
  }

 private:
  [[nodiscard]] bool ended() const {
    if (id_ < 0) return true;
    siginfo_t info{};
    const int flags = WEXITED | WNOHANG | WNOWAIT;
    return ::waitid(P_PID, static_cast<id_t>(id_), &info, flags) == 0 && info.si_pid != 0;
  }

  std::filesystem::path output_;
  pid_t id_ = -1;
  int code_ = -1;
};

/// The program under test.
[[nodiscard]] inline std::vector<std::string> tandem(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), TANDEM_BINARY_DIR "/bin/tandem");
  return arguments;
}

/// A folder of the test's own, in the machine's build folder, that stays when the test fails.
class OwnFolder : public testing::Test {
 protected:
  OwnFolder() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(TANDEM_BINARY_DIR) / "test_hil" /
              (std::string(info->test_suite_name()) + "." + info->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~OwnFolder() override {
    if (!HasFailure()) std::filesystem::remove_all(folder_);
  }

  std::filesystem::path folder_;
};

}  // namespace tandem::test
