// Lets the thread that serves questions have its work done by the thread that owns the answers.
// Layer: apps/run.  Thread: ask() the serving thread's; do_all() the owner's, between two steps.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>

#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

class Errands {
 public:
  using Work = std::function<Result<Json>()>;

  /// Has `work` done by the owner and answers its result. An owner that does not come within two
  /// seconds is an error, and the work is not done any more.
  [[nodiscard]] Result<Json> ask(Work work);
  /// Does what waits. One lock when nothing does: for loops that are not real-time.
  void do_all();

 private:
  struct Errand {
    Work work;
    Result<Json> result = Json();
    bool done = false;
  };
  std::mutex mutex_;
  std::condition_variable finished_;
  std::deque<std::shared_ptr<Errand>> waiting_;
};

}  // namespace tandem::apps
