// What a run tells the service manager that started it: sd_notify(3), without its library.
// Layer: apps/run.  Thread: any but the loop's.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>

namespace tandem::apps {

/// A datagram each to $NOTIFY_SOCKET; without that variable none is sent, and nothing here
/// fails. No call blocks but the last: what the manager has no room for is said at the next call.
class ServiceNotice {
 public:
  /// As the environment says it: NOTIFY_SOCKET, WATCHDOG_USEC, WATCHDOG_PID.
  ServiceNotice();
  /// @param socket    a path, or a name after '@'; empty: nobody listens
  /// @param watchdog  within which the manager wants a sign of life; zero: it wants none
  ServiceNotice(std::string socket, std::chrono::microseconds watchdog)
      : socket_(std::move(socket)), watchdog_(watchdog) {}

  /// READY: it waits for a person. No sign of life follows until the loop cycles.
  void waits(std::string_view status);
  /// The loop has cycled since it was asked last: READY at first, then a sign of life four times
  /// within the manager's limit.
  void cycles();
  /// The loop waits as long as it likes, as simulated time is paused: the manager expects no sign
  /// of life until it cycles again.
  void suspend();
  /// Words for people, where they are others than before.
  void status(std::string_view text);
  /// The same of why the run fails: nothing follows them.
  void fails(std::string_view text);
  /// The run ends. Tries for a tenth of a second at most.
  void stops();

 private:
  using Clock = std::chrono::steady_clock;
  void expect_life(bool expected);
  /// False: the manager has no room now.
  [[nodiscard]] bool send(const std::string& lines) const;

  const std::string socket_;
  const std::chrono::microseconds watchdog_;
  std::mutex mutex_;
  std::string status_;
  bool ready_ = false, expected_ = true, stops_ = false, fails_ = false;
  Clock::time_point fed_{};
};

}  // namespace tandem::apps
