// Another program that runs for the time of a test, and what it prints.
// Layer: tests.  Thread: main.
#pragma once

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>
#include <vector>

namespace tandem::dds::test {

/// Ends when this does: its standard input is closed, and it is waited for.
class PeerProcess {
 public:
  explicit PeerProcess(const std::vector<std::string>& command) {
    std::array<int, 2> input{}, output{};
    if (::pipe2(input.data(), O_CLOEXEC) != 0 || ::pipe2(output.data(), O_CLOEXEC) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
    std::vector<char*> arguments;
    for (const std::string& one : command) arguments.push_back(const_cast<char*>(one.c_str()));
    arguments.push_back(nullptr);
    ::posix_spawn(&pid_, arguments[0], &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(input[0]);
    ::close(output[1]);
    stdin_ = input[1];
    stdout_ = output[0];
    ::fcntl(stdout_, F_SETFL, O_NONBLOCK);
  }
  ~PeerProcess() {
    ::close(stdin_);
    if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
    ::close(stdout_);
  }
  PeerProcess(const PeerProcess&) = delete;
  PeerProcess& operator=(const PeerProcess&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }

  /// Its next line of input.
  void say(const std::string& line) const {
    const std::string text = line + "\n";
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t some = ::write(stdin_, text.data() + done, text.size() - done);
      if (some <= 0) return;
      done += static_cast<std::size_t>(some);
    }
  }

  /// The lines that it has printed since the last call.
  std::vector<std::string> lines() {
    std::array<char, 4096> some;
    for (;;) {
      const ssize_t size = ::read(stdout_, some.data(), some.size());
      if (size <= 0) break;
      pending_.append(some.data(), static_cast<std::size_t>(size));
    }
    std::vector<std::string> out;
    for (std::size_t end; (end = pending_.find('\n')) != std::string::npos;) {
      out.push_back(pending_.substr(0, end));
      pending_.erase(0, end + 1);
    }
    return out;
  }

 private:
  pid_t pid_ = 0;
  int stdin_ = -1;
  int stdout_ = -1;
  std::string pending_;
};

}  // namespace tandem::dds::test
