// Runs in processes of their own, a few at once.
// Layer: apps/search.  Thread: main.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "apps/run/child_run.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// A run that has ended.
struct EndedRun {
  std::size_t number = 0;  ///< the caller's
  ChildRun run;
};

/// Starts them, and ends those that take too long. Its destructor ends all.
class ChildRuns {
 public:
  /// @param jobs  at once, at least one; 0: as many as there are cores
  /// @param timeout_s  of each, on the wall clock
  ChildRuns(std::size_t jobs, double timeout_s);
  ~ChildRuns();
  ChildRuns(const ChildRuns&) = delete;
  ChildRuns& operator=(const ChildRuns&) = delete;

  /// `tandem WORDS`. Errors: no folder for what it writes; it cannot be started.
  [[nodiscard]] Status start(std::size_t number, std::vector<std::string> words);
  [[nodiscard]] bool is_full() const { return going_.size() >= jobs_; }
  [[nodiscard]] bool is_empty() const { return going_.empty(); }
  /// Waits a little. @return those that have ended meanwhile
  [[nodiscard]] std::vector<EndedRun> take_ended();
  void end_all();

  /// A folder for what the processes read and write, gone at the end; empty: none can be made.
  [[nodiscard]] const std::string& folder() const { return folder_; }

 private:
  using Clock = std::chrono::steady_clock;
  /// A process that goes on.
  struct Going {
    std::size_t number = 0;
    std::size_t files = 0;  // the number of what it writes
    pid_t child = 0;
    Clock::time_point begin;
    bool late = false;  // it was ended for that
  };
  [[nodiscard]] std::string file_of(std::size_t files, const char* ending) const;
  [[nodiscard]] EndedRun ended(const Going& one, int status) const;

  std::size_t jobs_;
  double timeout_s_;
  std::string folder_;
  std::vector<Going> going_;
  std::size_t started_ = 0;
};

/// The command of such a run, for a shell. @param more  of its flags
[[nodiscard]] std::string command_of_run(const std::string& file,
                                         const std::vector<std::string>& more = {});

}  // namespace tandem::apps
