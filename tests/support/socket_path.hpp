// Where a test's run listens.
// Layer: tests.  Thread: any.
#pragma once

#include <unistd.h>

#include <string>

namespace tandem::test {

/// A path of this process: short, as a socket's has to be, and of this user, whose left-over of a
/// process that was killed may be replaced; another user's may not.
/// @param what  of several
inline std::string socket_path(const std::string& what = "") {
  return "/tmp/tandem-test-" + std::to_string(::getuid()) + "-" + std::to_string(::getpid()) +
         what + ".sock";
}

}  // namespace tandem::test
