// Another program, started, watched and ended; it never outlives its owner.
// Layer: apps/machine.  Thread: main.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace tandem::apps {

/// One child. Its standard input is empty; what it prints goes to a file.
class ChildProcess {
 public:
  /// Starts `arguments`, the first being the program, looked for in $PATH.
  /// @param output  file for standard output and standard error.
  /// Errors: the program cannot be started.
  [[nodiscard]] static Result<ChildProcess> start(const std::vector<std::string>& arguments,
                                                  const std::string& output);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  /// Ends it, when it still runs: SIGTERM to it and to what it started, SIGKILL 2 s later.
  ~ChildProcess();

  /// Its exit status once it has ended (128 + signal when a signal ended it); empty before.
  [[nodiscard]] std::optional<int> poll();
  /// Ends it now, as the destructor does.
  void end();

 private:
  explicit ChildProcess(pid_t pid) : pid_(pid) {}

  pid_t pid_;  // also its process group's; 0: moved from
  std::optional<int> status_;
};

}  // namespace tandem::apps
