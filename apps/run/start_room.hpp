// Where a run waits for a person before it touches its robot: `tandem run --wait-for-start`.
// Layer: apps/run.  Thread: main waits; the control socket's threads ask.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "apps/control/control_registry.hpp"
#include "apps/run/service_notice.hpp"
#include "apps/transport/control_socket.hpp"
#include "base/result.hpp"
#include "hal/stop_category.hpp"
#include "runtime/fault.hpp"

namespace tandem::apps {

/// Nothing is opened and no drive is enabled: its bus is silent, or not there. Over the control
/// socket `tandem controller start` is the deliberate act; who asks gets what comes of it. An
/// emergency stop is confirmed, and latched until `tandem fault reset`: nothing starts before.
class StartRoom {
 public:
  /// Why it waits again.
  struct Before {
    std::string why{};                            ///< empty: it waits for the first time
    std::optional<runtime::FaultReport> stop{};   ///< an emergency stop, which stays latched
    std::unique_ptr<ControlListener> listener{};  ///< of the run; null: it waits for the first time
  };
  /// @param declared  the robot's emergency stop
  /// Errors: apps::serve()'s of a socket that is needed.
  [[nodiscard]] static Result<std::unique_ptr<StartRoom>> open(const std::string& socket,
                                                               ServiceNotice& notice, Before before,
                                                               hal::StopCategory declared);

  /// Blocks until somebody asks for the start. @return false: for the run's end instead, by a
  /// signal or over the socket
  [[nodiscard]] bool await();
  /// The answer to who asked. @param refused  why the robot cannot be started
  /// @return whether the run goes on to its robot. Else it waits on: it was refused, or an
  /// emergency stop came meanwhile. A stop that comes later is the first thing that the run sees
  [[nodiscard]] bool answer(std::optional<Error> refused);
  /// For the run: who connects from now on waits for it. Between the two nobody was found there.
  [[nodiscard]] std::unique_ptr<ControlListener> end() {
    return ControlSocket::end(std::move(socket_));
  }

 private:
  StartRoom(ServiceNotice& notice, hal::StopCategory declared)
      : notice_(notice), declared_(declared) {}
  void add_commands();
  [[nodiscard]] Json status();
  [[nodiscard]] Result<Json> start(const Json& request);
  void tell(const std::string& why);
  [[nodiscard]] std::unexpected<Error> not_started();
  // With the mutex locked:
  void latch(hal::FaultCause cause, hal::StopCategory category);
  void look_for_stop();

  ServiceNotice& notice_;
  hal::StopCategory declared_;
  ControlRegistry commands_;
  std::mutex mutex_;
  std::condition_variable news_;
  bool wanted_ = false, ends_ = false, left_ = false;
  std::optional<runtime::FaultReport> stop_;  // that is latched
  std::uint64_t answers_ = 0;
  std::optional<Error> refused_;           // of the last answer
  std::unique_ptr<ControlSocket> socket_;  // last: its threads use the others
};

}  // namespace tandem::apps
