// What a test says that only root can run.
// Layer: tests.  Thread: any.
#pragma once

#include <unistd.h>

#include <string>

namespace tandem::test {

/// The reason of a skip. An ordinary user's begins with "needs root", and .ci/run runs this test as
/// root after that; root's says that the machine grants not even him `what`.
/// @param what  "a network of its own"
[[nodiscard]] inline std::string needs_root(const std::string& what) {
  return (::geteuid() != 0 ? "needs root: " : "this machine grants not even root ") + what;
}

}  // namespace tandem::test
