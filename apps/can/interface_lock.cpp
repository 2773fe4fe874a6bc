#include "apps/can/interface_lock.hpp"

#include <fmt/core.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <linux/sock_diag.h>
#include <linux/unix_diag.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

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

/// A part of an answer of sock_diag(7), as far as there is one.
template <class T>
std::optional<T> part_of(const nlmsghdr& answer, std::uint16_t type) {
  const auto* part = reinterpret_cast<const rtattr*>(static_cast<const char*>(NLMSG_DATA(&answer)) +
                                                     NLMSG_ALIGN(sizeof(unix_diag_msg)));
  auto left = static_cast<int>(answer.nlmsg_len - NLMSG_LENGTH(sizeof(unix_diag_msg)));
  for (; RTA_OK(part, left); part = RTA_NEXT(part, left)) {
    if (part->rta_type != type) continue;
    const auto* bytes = static_cast<const char*>(RTA_DATA(part));
    if constexpr (std::is_same_v<T, std::string>) {
      return std::string(bytes, RTA_PAYLOAD(part));
    } else if (RTA_PAYLOAD(part) == sizeof(T)) {
      T value;
      std::memcpy(&value, bytes, sizeof value);
      return value;
    }
  }
  return std::nullopt;
}

/// The user of the socket with this address, by the kernel's list of all; empty: it does not say.
std::optional<std::uint32_t> user_of(const Address& address) {
  struct {
    nlmsghdr head;
    unix_diag_req body;
  } question{};
  question.head.nlmsg_len = sizeof question;
  question.head.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  question.head.nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP;
  question.body.sdiag_family = AF_UNIX;
  question.body.udiag_states = ~0U;
  question.body.udiag_show = UDIAG_SHOW_NAME | UDIAG_SHOW_UID;
  const std::string name(address.address.sun_path, address.size - offsetof(sockaddr_un, sun_path));
  const int asking = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_SOCK_DIAG);
  std::optional<std::uint32_t> user;
  bool more = asking >= 0 && ::send(asking, &question, sizeof question, 0) > 0;
  std::vector<char> room(65'536);
  while (more) {
    const ssize_t count = ::recv(asking, room.data(), room.size(), 0);
    auto left = static_cast<unsigned>(std::max<ssize_t>(count, 0));
    auto* answer = reinterpret_cast<const nlmsghdr*>(room.data());
    more = left > 0;
    for (; NLMSG_OK(answer, left); answer = NLMSG_NEXT(answer, left)) {
      if (answer->nlmsg_type == NLMSG_DONE || answer->nlmsg_type == NLMSG_ERROR) more = false;
      if (answer->nlmsg_type != SOCK_DIAG_BY_FAMILY) continue;
      if (part_of<std::string>(*answer, UNIX_DIAG_NAME) == name)
        user = part_of<std::uint32_t>(*answer, UNIX_DIAG_UID);
    }
  }
  if (asking >= 0) ::close(asking);
  return user;
}

/// Who has an address.
struct Holder {
  std::optional<std::uint32_t> user{};
  pid_t process = 0;  ///< 0: it takes no connections, or too many wait
  /// The name is free to everybody: only a run of this user, or root's, holds it by right. So does
  /// one that nobody knows.
  [[nodiscard]] bool trusted() const { return !user || *user == ::geteuid() || *user == 0; }
  [[nodiscard]] std::string text() const {
    const std::string who =
        process > 0 ? fmt::format("process {}", process) : std::string("another process");
    return user ? fmt::format("{} of user {}", who, *user) : who;
  }
};

Holder holder(const Address& address) {
  Holder found{.user = user_of(address)};
  const int asking = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  ucred peer{};
  socklen_t size = sizeof peer;
  if (asking >= 0 && ::connect(asking, address.raw(), address.size) == 0 &&
      ::getsockopt(asking, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0) {
    found.process = peer.pid;
    found.user = peer.uid;
  }
  if (asking >= 0) ::close(asking);
  return found;
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
  const char* end = master ? "master" : "boards";
  const Holder who = holder(address);
  if (who.trusted()) {
    return fail(fmt::format("{} has its {} already: {}", interface, end, who.text()),
                master ? "end that run first: two masters would take the nodes from each other"
                       : "end that emulator first, or use another interface");
  }
  lock.remark_ = fmt::format(
      "{}: the lock's name @tandem/{}/{} is held by {}, which is neither this user's nor root's, "
      "and "
      "locks nothing: a master that is at work there is found by its frames",
      interface, interface, end, who.text());
  return lock;
}

InterfaceLock::~InterfaceLock() {
  if (socket_ >= 0) ::close(socket_);
}

InterfaceLock::InterfaceLock(InterfaceLock&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), remark_(std::move(other.remark_)) {}

}  // namespace tandem::apps
