// A DDS domain of this test program's own.
// Layer: tests.  Thread: main.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <string>

#include "dds/config.hpp"

namespace tandem::dds::test {

/// The number of a domain that no other test program of this machine has, until this one ends.
inline int own_domain() {
  static const int domain = [] {
    for (int number = 100; number < 200; ++number) {
      std::string file = "/tmp/tandem-test-dds-";
      file.append(std::to_string(number)).append(".lock");
      const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      if (fd >= 0 && ::flock(fd, LOCK_EX | LOCK_NB) == 0) return number;  // open until the end
      if (fd >= 0) ::close(fd);
    }
    return 200;
  }();
  return domain;
}

inline Config own_config() {
  Config config;
  config.enabled = true;
  config.domain = own_domain();
  return config;
}

}  // namespace tandem::dds::test
