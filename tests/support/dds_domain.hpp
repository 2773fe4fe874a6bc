// A DDS domain of this test program's own.
// Layer: tests.  Thread: main.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <string>

#include "dds/config.hpp"

namespace tandem::dds::test {

/// The number of a domain that nothing else in the tests of this machine has, until this program
/// ends; each call gives another one.
inline int another_domain() {
  for (int number = 100; number < 200; ++number) {
    std::string file = "/tmp/tandem-test-dds-";
    file.append(std::to_string(number)).append(".lock");
    const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd >= 0 && ::flock(fd, LOCK_EX | LOCK_NB) == 0) return number;  // open until the end
    if (fd >= 0) ::close(fd);
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
