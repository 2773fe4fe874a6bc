#include "apps/machine/child_process.hpp"

#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "base/process.hpp"

namespace tandem::apps {

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& arguments,
                                         const std::string& output) {
  const Result<pid_t> child = spawn({.command = arguments, .output = output, .own_group = true});
  if (!child) return std::unexpected(child.error());
  return ChildProcess(*child);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, 0)), status_(other.status_) {}

ChildProcess::~ChildProcess() { end(); }

std::optional<int> ChildProcess::poll() {
  if (pid_ == 0 || status_) return status_;
  int raw = 0;
  if (waitpid(pid_, &raw, WNOHANG) == pid_) {
    status_ = exit_status(raw);
  }
  return status_;
}

void ChildProcess::end() {
  using namespace std::chrono_literals;
  if (pid_ == 0 || poll()) return;
  kill(-pid_, SIGTERM);
  for (int tries = 0; tries < 200 && !poll(); ++tries) std::this_thread::sleep_for(10ms);
  if (poll()) return;
  kill(-pid_, SIGKILL);
  int raw = 0;
  waitpid(pid_, &raw, 0);
  status_ = 128 + SIGKILL;
}

}  // namespace tandem::apps
