// Runs in processes of their own, a few at once: each is forked from one that has loaded
// everything, so a run costs its simulation, and a crash costs one run. Layer: apps/run.  Thread:
// main, while no other is there.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "apps/run/child_run.hpp"
#include "base/open_file.hpp"

namespace tandem::apps {

/// A run that has ended.
struct EndedRun {
  std::uint64_t number = 0;  ///< the caller's
  ChildRun run{};
  double seconds = 0.0;  ///< on the wall clock
};

/// Starts them, and ends those that take too long. Its destructor ends all. Kernels that a run
/// lacks are built by a process of their own, one robot at a time, without a limit of time; then it
/// runs.
class RunWorkers {
 public:
  /// @param folder  for what the processes write: it is made here, and removed at the end; empty:
  /// nothing can be started
  /// @param jobs  at once, at least one; 0: as many as there are cores
  /// @param limit_s  of each, on the wall clock
  RunWorkers(std::string folder, std::size_t jobs, double limit_s);
  ~RunWorkers();
  RunWorkers(const RunWorkers&) = delete;
  RunWorkers& operator=(const RunWorkers&) = delete;

  /// What they read instead of files; it outlives them.
  void read_instead(const TextsInstead::Texts& texts) { texts_ = &texts; }

  [[nodiscard]] bool is_full() const { return going_.size() + lacking_.size() >= jobs_; }
  [[nodiscard]] bool is_empty() const { return going_.empty() && lacking_.empty(); }
  /// What `tandem run` does with these options. Errors: no process can be made; the folder cannot
  /// be written.
  [[nodiscard]] Status start(std::uint64_t number, RunOptions options);
  /// Waits for one to end, a tenth of a second at most; ends those that are too slow.
  /// Errors: a result could not be written.
  [[nodiscard]] Result<std::vector<EndedRun>> take_ended();
  void end_all();

  [[nodiscard]] const std::string& folder() const { return folder_; }

 private:
  enum class Work : std::uint8_t { kRun, kRunAgain, kBuild };
  struct Going {
    std::uint64_t number = 0;
    RunOptions options{};
    Work work = Work::kRun;
    std::size_t files = 0;  // the number of what it writes
    pid_t child = 0;
    Descriptor ended{};  // can be read when it has
    std::chrono::steady_clock::time_point begin;
    bool late = false;  // it was ended for that
  };
  [[nodiscard]] std::string file_of(std::size_t files, const char* ending) const;
  [[nodiscard]] Status begin(Work work, std::uint64_t number, RunOptions options);
  [[nodiscard]] Status build_next();
  [[nodiscard]] bool lacks_kernels(const Going& one) const;
  [[nodiscard]] Result<EndedRun> ended(const Going& one, int status) const;

  std::string folder_;
  std::size_t jobs_;
  double limit_s_;
  const TextsInstead::Texts* texts_ = nullptr;
  std::vector<Going> going_;
  std::vector<Going> lacking_;  // runs that wait for their kernels
  std::size_t started_ = 0;
};

}  // namespace tandem::apps
