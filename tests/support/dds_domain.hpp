// A DDS domain of this test program's own.
// Layer: tests.  Thread: main.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <string>

#include "dds/config.hpp"

namespace tandem::dds::test {

/// The number of a domain that nothing else in the tests of this network has, whoever's they are,
/// until this program ends; each call gives another one.
inline int another_domain() {
  for (int number = 100; number < 200; ++number) {
    // An abstract socket: a name that one process of the network namespace can have, and no file.
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    const std::size_t length = ("tandem-test-dds-" + std::to_string(number))
                                   .copy(name.sun_path + 1, sizeof name.sun_path - 1);
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (::bind(fd, reinterpret_cast<const sockaddr*>(&name), size) == 0) return number;  // kept
    ::close(fd);
  }
  return 200;
}

/// The one of this program.
inline int own_domain() {
  static const int domain = another_domain();
  return domain;
}

inline Config own_config() {
  Config config;
  config.enabled = true;
  config.domain = own_domain();
  return config;
}

}  // namespace tandem::dds::test
