// A network namespace of the test's own with two ends of one cable, in a child process.
// Layer: tests.  Thread: any.
#pragma once

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>

namespace tandem::test {

/// Ends of the cable.
inline constexpr const char* kMasterEnd = "ecat_m";
inline constexpr const char* kSlaveEnd = "ecat_s";

/// The child's exit status when this machine does not let it have a network.
inline constexpr int kNoNetwork = 77;

/// Enters a network namespace with both ends up; as root, or as root of a user namespace.
/// @return whether this machine lets it
[[nodiscard]] inline bool enter_own_network() {
  const uid_t user = ::getuid();
  const gid_t group = ::getgid();
  if (::unshare(CLONE_NEWNET) != 0) {
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
    std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
    std::ofstream("/proc/self/setgroups") << "deny";
    std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";  // tshark wants a group
  }
  const std::string command = std::string("ip link add ") + kMasterEnd + " type veth peer name " +
                              kSlaveEnd + " && ip link set " + kMasterEnd + " up && ip link set " +
                              kSlaveEnd + " up";
  return std::system(("{ " + command + "; } >/dev/null 2>&1").c_str()) == 0;
}

/// Runs `body` in a child in a network of its own. @return its exit status
template <class Body>
[[nodiscard]] int in_own_network(Body body) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (!enter_own_network()) ::_exit(kNoNetwork);
    body();
    ::_exit(::testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

}  // namespace tandem::test
