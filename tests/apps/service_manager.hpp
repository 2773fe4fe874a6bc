// A service manager's end of sd_notify(3): a datagram socket, and what came over it.
// Layer: tests.  Thread: any, one at a time.
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "tests/support/eventually.hpp"
#include "tests/support/socket_path.hpp"

namespace tandem::apps {

class ServiceManager {
 public:
  /// @param abstract  a name without a file
  explicit ServiceManager(bool abstract = false)
      : name_((abstract ? "@" : "") + test::socket_path("-manager")) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name_.data(), name_.size());
    if (abstract) address.sun_path[0] = '\0';
    if (!abstract) ::unlink(name_.c_str());
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name_.size());
    listens_ = ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) == 0;
  }
  ~ServiceManager() {
    ::close(socket_);
    if (name_.front() != '@') ::unlink(name_.c_str());
  }
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  [[nodiscard]] bool listens() const { return listens_; }
  /// $NOTIFY_SOCKET
  [[nodiscard]] const std::string& name() const { return name_; }
  /// All that came so far, each as it was sent.
  const std::vector<std::string>& heard() {
    char bytes[4096];
    for (;;) {
      const ssize_t count = ::recv(socket_, bytes, sizeof bytes, MSG_DONTWAIT);
      if (count < 0) return heard_;
      heard_.emplace_back(bytes, static_cast<std::size_t>(count));
    }
  }
  /// Whether one that begins so comes.
  bool hears(const std::string& begin) {
    return test::eventually([&] { return place(begin) < heard_.size(); });
  }
  /// The first from `from` on that begins so.
  std::size_t place(const std::string& begin, std::size_t from = 0) {
    heard();
    for (std::size_t i = from; i < heard_.size(); ++i)
      if (heard_[i].starts_with(begin)) return i;
    return heard_.size();
  }
  /// How many between two places are that one.
  [[nodiscard]] std::ptrdiff_t count(const std::string& one, std::size_t from,
                                     std::size_t to) const {
    return std::count(heard_.begin() + static_cast<std::ptrdiff_t>(from),
                      heard_.begin() + static_cast<std::ptrdiff_t>(to), one);
  }

 private:
  std::string name_;
  int socket_ = -1;
  bool listens_ = false;
  std::vector<std::string> heard_;
};

}  // namespace tandem::apps
