// Calls into the code of a controller's library, before it runs in the cycle.
// Layer: controllers.  Thread: any, non-RT.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "base/process.hpp"
#include "base/result.hpp"

namespace tandem {

/// As long as one lives, exit() on its thread is the controller's doing: it is reported on standard
/// error, and the status is 2, whatever the library gave to exit().
class HostedCode {
 public:
  /// @param controller  outlives this
  explicit HostedCode(const std::string& controller);
  /// exit() ends nothing: `exits` is called, and the thread waits for ever.
  HostedCode(const std::string& controller, const std::function<void()>& exits);
  ~HostedCode();
  HostedCode(const HostedCode&) = delete;
  HostedCode& operator=(const HostedCode&) = delete;

 private:
  const std::string* outer_;
  const std::function<void()>* outer_exits_;
};

/// The controller whose code this thread is in, null: in none's. For a signal handler.
[[nodiscard]] const char* hosted_controller() noexcept;

/// Whether a bounded_call() was given up, and goes on all the same.
using GivenUp = std::shared_ptr<const std::atomic<bool>>;
/// That of the call that this thread is in; null: it is in none.
[[nodiscard]] const GivenUp& hosted_call_given_up() noexcept;
/// The thread is that call's, which outlives it.
void this_thread_is_of(const GivenUp& call) noexcept;

/// From now on called with the controller that ends the process by exit(), before it ends.
void tell_hosted_exit(void (*told)(const std::string& controller, const char* message)) noexcept;

/// Whether a call was given up that may still go on: then the process ends by _exit(), and what the
/// call uses stays.
[[nodiscard]] bool a_hosted_call_goes_on() noexcept;
/// Says so from now on.
void note_hosted_call_goes_on() noexcept;

/// @return what `call` returns, or what it threw as an error of `controller`
template <class Call>
[[nodiscard]] auto hosted_call(const std::string& controller, const Call& call)
    -> decltype(call()) {
  const HostedCode inside(controller);  // within bounded_call(): exit() stays what it is there
  const auto threw = [&](const std::string& what) {
    return std::unexpected(Error{.message = "the controller threw an exception: " + what,
                                 .hint = "a controller returns its errors; correct it",
                                 .file = {},
                                 .key = controller});
  };
  try {
    return call();
  } catch (const std::exception& error) {
    return threw(error.what());
  } catch (...) {
    return threw("one that is no std::exception");
  }
}

/// As hosted_call(), for at most `limit`, on a thread of its own: the process goes on when `call`
/// does not return, or calls exit(). Then the thread stays behind, with what `call` owns. While
/// time limits are waived, as in a debugger, it waits.
template <class Call>
[[nodiscard]] auto bounded_call(const std::string& controller, std::chrono::milliseconds limit,
                                Call call) -> decltype(call()) {
  using Answer = decltype(call());
  struct Job {
    std::string controller;
    std::optional<Call> call;
    std::mutex mutex{};
    std::condition_variable over{};
    std::optional<Answer> answer{};
    bool exited = false;
    std::atomic<bool> given_up{false};
  };
  const auto job = std::make_shared<Job>(controller, std::optional<Call>(std::move(call)));
  std::thread([job] {
    const std::function<void()> exits = [&job] {
      const std::lock_guard lock(job->mutex);
      job->exited = true;
      job->over.notify_all();
    };
    const GivenUp given_up(job, &job->given_up);
    this_thread_is_of(given_up);
    const HostedCode inside(job->controller, exits);
    Answer answer = hosted_call(job->controller, *job->call);
    job->call.reset();  // nothing that it owns outlives the answer's reader here
    const std::lock_guard lock(job->mutex);
    job->answer.emplace(std::move(answer));
    job->over.notify_all();
  }).detach();
  std::unique_lock lock(job->mutex);
  // In short waits, which do not count while limits are waived.
  const auto is_over = [&] { return job->answer || job->exited; };
  for (auto left = limit; left.count() > 0;) {
    const auto tick = std::min(left, std::chrono::milliseconds(20));
    if (job->over.wait_for(lock, tick, is_over)) break;
    if (!time_limits_are_waived()) left -= tick;
  }
  if (job->answer) return std::move(*job->answer);
  job->given_up = true;
  note_hosted_call_goes_on();
  const bool exited = job->exited;
  return std::unexpected(Error{
      .message =
          exited ? "the controller called exit()"
                 : "the controller did not return within " + std::to_string(limit.count()) + " ms",
      .hint = exited ? "a controller returns its errors; correct it"
                     : "correct it; what it does goes on until this process ends",
      .file = {},
      .key = controller});
}

}  // namespace tandem
