// Tasks of one thread that another thread runs and answers.
// Layer: apps/run.  Thread: run() any but the owner's; run_waiting() the owner's.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>

#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// Lets the thread that serves requests read and change what another thread owns.
class TaskQueue {
 public:
  using Work = std::function<Result<Json>()>;

  /// Has the owner do `work` and answers its result. Error: the owner does not come within two
  /// seconds; then the work is not done any more.
  [[nodiscard]] Result<Json> run(Work work);
  /// Runs what waits, between two steps of the owner. Takes one lock: not for real-time threads.
  void run_waiting();

 private:
  struct Task {
    Work work;
    Result<Json> result = Json();
    bool done = false;
  };
  std::mutex mutex_;
  std::condition_variable finished_;
  std::deque<std::shared_ptr<Task>> waiting_;
};

}  // namespace tandem::apps
