#include "apps/can/interface_lock.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

namespace tandem::apps {
namespace {

struct Address {
  sockaddr_un address{};
  socklen_t size = 0;
  [[nodiscard]] const sockaddr* raw() const { return reinterpret_cast<const sockaddr*>(&address); }
};

/// The first byte stays 0: an abstract name.
Address address_of(const std::string& interface, const char* end) {
  Address made;
  made.address.sun_family = AF_UNIX;
  std::string name = fmt::format("tandem/{}/{}", interface, end);
  name.resize(std::min(name.size(), sizeof made.address.sun_path - 1));
  std::memcpy(made.address.sun_path + 1, name.data(), name.size());
  made.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  return made;
}

/// "process 1234 of user 1000", as the kernel knows who listens.
std::string holder(const Address& address) {
  std::string text = "another process";
  const int asking = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  ucred peer{};
  socklen_t size = sizeof peer;
  if (asking >= 0 && ::connect(asking, address.raw(), address.size) == 0 &&
      ::getsockopt(asking, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0) {
    text = fmt::format("process {} of user {}", peer.pid, peer.uid);
  }
  if (asking >= 0) ::close(asking);
  return text;
}

}  // namespace

Result<InterfaceLock> InterfaceLock::take(const std::string& interface, hal::can::SocketSide side) {
  const bool master = side == hal::can::SocketSide::kMaster;
  const Address address = address_of(interface, master ? "master" : "boards");
  InterfaceLock lock(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (lock.socket_ >= 0 && ::bind(lock.socket_, address.raw(), address.size) == 0 &&
      ::listen(lock.socket_, 64) == 0) {
    return lock;
  }
  if (errno != EADDRINUSE) {
    return fail(fmt::format("cannot lock {}: {}", interface, std::strerror(errno)),
                "is the process out of file descriptors?");
  }
  return fail(fmt::format("{} has its {} already: {}", interface, master ? "master" : "boards",
                          holder(address)),
              master ? "end that run first: two masters would take the nodes from each other"
                     : "end that emulator first, or use another interface");
}

InterfaceLock::~InterfaceLock() {
  if (socket_ >= 0) ::close(socket_);
}

InterfaceLock::InterfaceLock(InterfaceLock&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)) {}

}  // namespace tandem::apps
