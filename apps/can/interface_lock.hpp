// One process per end of an interface: a lock that goes with the process.
// Layer: apps/can.  Thread: main.
#pragma once

#include <string>

#include "base/result.hpp"
#include "hal/ethercat-can/socket_can_bus.hpp"

namespace tandem::apps {

/// An abstract Unix socket with the interface's name: there is one of a name in a network
/// namespace, as there is one interface, whoever asks. The kernel takes it away with the process,
/// however that ends. Nobody is served there. Everybody may take such a name: a holder
/// who is neither this user nor root locks nothing, and is reported.
class InterfaceLock {
 public:
  /// @param side  kMaster or kBoards: one process each
  /// Errors: another process of this user or root has it, with its number and user.
  [[nodiscard]] static Result<InterfaceLock> take(const std::string& interface,
                                                  hal::can::SocketSide side);
  ~InterfaceLock();
  InterfaceLock(InterfaceLock&& other) noexcept;
  InterfaceLock& operator=(InterfaceLock&&) = delete;

  /// Who else holds the name; empty: nobody.
  [[nodiscard]] const std::string& remark() const noexcept { return remark_; }

 private:
  explicit InterfaceLock(int socket) : socket_(socket) {}
  int socket_;
  std::string remark_;
};

}  // namespace tandem::apps
