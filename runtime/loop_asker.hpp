// The thread of the loop when it asks by itself, where others ask and wait.
// Layer: runtime.  Thread: set before the first cycle; here() the loop's, attends() any.
#pragma once

#include <atomic>
#include <functional>
#include <thread>
#include <utility>

namespace tandem::runtime {

/// Between the halves of a cycle the loop's thread may ask RunServices: where another thread would
/// wait for the loop's answer, `attend` is called instead.
class LoopAsker {
 public:
  /// @param alone  nobody else asks; else only the thread that here() says attends
  void attend_by(std::function<void()> attend, bool alone = true) {
    attend_ = std::move(attend);
    alone_ = alone;
  }
  /// Whether this thread is the loop's, until the next call.
  void here(bool yes) noexcept {
    asking_.store(yes ? std::this_thread::get_id() : std::thread::id(), std::memory_order_relaxed);
  }
  /// Whether this thread attends, and does not wait.
  [[nodiscard]] bool attends() const noexcept {
    return attend_ != nullptr &&
           (alone_ || asking_.load(std::memory_order_relaxed) == std::this_thread::get_id());
  }
  /// @pre attends()
  void attend() const { attend_(); }

 private:
  std::function<void()> attend_;  // empty: the loop never asks
  bool alone_ = true;
  std::atomic<std::thread::id> asking_{};
};

}  // namespace tandem::runtime
