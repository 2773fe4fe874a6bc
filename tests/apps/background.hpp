// A `tandem` in the background of a test, which ends with the test whatever happens to that.
#pragma once

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "base/quoting.hpp"

namespace tandem::apps {

/// Killed by the destructor; and by the kernel, when the thread that started it is gone.
class Background {
 public:
  /// Starts `tandem ARGUMENTS` in `folder`, as a shell reads them. It writes NAME.txt and NAME.err.
  /// @param program  another one than that of the build
  Background(const std::filesystem::path& folder, const std::string& arguments,
             const std::string& name,
             const std::string& program = TANDEM_BINARY_DIR "/bin/tandem") {
    const std::string command = "cd " + shell_word(folder.string()) + " && exec " +
                                shell_word(program) + " " + arguments + " >" + name + ".txt 2>" +
                                name + ".err </dev/null";
    const pid_t test = ::getpid();
    process_ = ::fork();
    if (process_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (const int of_terminal : {SIGINT, SIGQUIT}) {
      ::signal(of_terminal, SIG_DFL);  // a shell's background job ignores it, and so would this one
    }
    if (::getppid() == test) ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
  ~Background() {
    if (process_ <= 0 || ended()) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  Background(Background&& other) noexcept
      : process_(std::exchange(other.process_, -1)), status_(other.status_) {}
  Background& operator=(Background&&) = delete;

  [[nodiscard]] pid_t id() const { return process_; }
  [[nodiscard]] bool ended() { return status().has_value(); }
  /// 128 + signal when a signal ended it; empty: it is there.
  [[nodiscard]] std::optional<int> status() {
    int raw = 0;
    if (!status_ && ::waitpid(process_, &raw, WNOHANG) == process_)
      status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
    return status_;
  }

 private:
  pid_t process_ = -1;
  std::optional<int> status_;
};

}  // namespace tandem::apps
