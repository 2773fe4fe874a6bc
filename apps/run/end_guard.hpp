// The way from a run's last cycle to the end of its process, which nothing may block for ever.
// Layer: apps/run.  Thread: main; one of its own waits.
#pragma once

#include <fmt/core.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <functional>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "apps/text/console.hpp"
#include "base/process.hpp"

namespace tandem::apps {

/// While one exists, `limit` is the time for what its scope does: closing what threads wait for.
/// They may never come back, for instance where a controller has closed every descriptor of the
/// process. The robot has been stopped by then. What a client has asked for last may take its time,
/// as a controller's configure() may: no more than this, but in a debugger.
class EndGuard {
 public:
  static constexpr std::chrono::seconds kLimit{20};

  /// @param last_words  what is still to be done, on this class' thread; may be empty
  explicit EndGuard(std::function<void()> last_words = {}) : last_words_(std::move(last_words)) {
    try {
      thread_ = std::thread([this] { wait(); });
    } catch (const std::system_error&) {  // NOLINT(bugprone-empty-catch): without a thread for it,
    }                                     // nobody watches
  }
  ~EndGuard() {
    {
      const std::scoped_lock lock(mutex_);
      done_ = true;
    }
    news_.notify_all();
    if (thread_.joinable()) thread_.join();
  }
  EndGuard(const EndGuard&) = delete;
  EndGuard& operator=(const EndGuard&) = delete;

 private:
  void wait() {
    std::unique_lock lock(mutex_);
    do {
      if (news_.wait_for(lock, kLimit, [this] { return done_; })) return;
    } while (time_limits_are_waived());
    if (last_words_) last_words_();
    fmt::print(stderr,
               "fault: the run is over, and a thread of it does not end: the process ends without "
               "it after {} s (has a controller closed descriptors that are not its own?)\n",
               kLimit.count());
    ::_exit(static_cast<int>(Exit::kFault));
  }

  std::function<void()> last_words_;
  std::mutex mutex_;
  std::condition_variable news_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace tandem::apps
