// One process per end of an interface.
#include "apps/can/interface_lock.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>

#include "tests/support/needs_root.hpp"

namespace tandem::apps {
namespace {

using hal::can::SocketSide;

/// Unlike those of other tests' processes.
std::string own_name() { return "t" + std::to_string(::getpid()); }

TEST(InterfaceLock, IsRefusedToASecondMasterWithTheFirstOnesProcess) {
  const auto first = InterfaceLock::take(own_name(), SocketSide::kMaster);
  ASSERT_TRUE(first) << first.error().to_string();
  for (int time = 0; time < 100; ++time) {  // whoever asks leaves nothing behind
    const auto second = InterfaceLock::take(own_name(), SocketSide::kMaster);
    ASSERT_FALSE(second);
    EXPECT_TRUE(second.error().message.starts_with(own_name() + " has its master already: "));
    if (time > 0) continue;
    EXPECT_EQ(second.error().message, own_name() + " has its master already: process " +
                                          std::to_string(::getpid()) + " of user " +
                                          std::to_string(::geteuid()));
  }
}

TEST(InterfaceLock, IsOfOneEndAndOneInterface) {
  const auto master = InterfaceLock::take(own_name(), SocketSide::kMaster);
  EXPECT_TRUE(master);
  EXPECT_TRUE(InterfaceLock::take(own_name(), SocketSide::kBoards));
  EXPECT_TRUE(InterfaceLock::take(own_name() + "x", SocketSide::kMaster));
}

/// Takes the master's name of `interface`. @param listens  as a lock does
int squat(const std::string& interface, bool listens) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = "tandem/" + interface + "/master";
  name.copy(address.sun_path + 1, sizeof address.sun_path - 1);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), size), 0);
  EXPECT_TRUE(!listens || ::listen(fd, 8) == 0);
  return fd;
}

// "can0 has its master already": whoever took the name kept every run from the interface.
void expect_no_lock_of_another_user(bool listens) {
  const std::string name = own_name();
  int said[2];
  ASSERT_EQ(::pipe(said), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(1);
    (void)squat(name, listens);
    (void)!::write(said[1], "y", 1);
    ::pause();
  }
  char taken = 0;
  ASSERT_EQ(::read(said[0], &taken, 1), 1);
  const auto lock = InterfaceLock::take(name, SocketSide::kMaster);
  ASSERT_TRUE(lock) << lock.error().to_string();
  const std::string process = listens ? "process " + std::to_string(child) : "another process";
  EXPECT_NE(lock->remark().find(process + " of user 65534"), std::string::npos) << lock->remark();
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ::close(said[0]);
  ::close(said[1]);
}

TEST(InterfaceLock, OfAnotherUserIsNoneAndIsToldOf) {
  if (::geteuid() != 0) GTEST_SKIP() << tandem::test::needs_root("another user");
  expect_no_lock_of_another_user(true);
  expect_no_lock_of_another_user(false);
}

TEST(InterfaceLock, OfThisUserIsOneEvenIfNobodyListens) {
  const int fd = squat(own_name(), false);
  EXPECT_FALSE(InterfaceLock::take(own_name(), SocketSide::kMaster));
  ::close(fd);
}

TEST(InterfaceLock, GoesWithItsProcessHoweverThatEnds) {
  { EXPECT_TRUE(InterfaceLock::take(own_name(), SocketSide::kMaster)); }
  const std::string name = own_name();
  int said[2];
  ASSERT_EQ(::pipe(said), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const auto lock = InterfaceLock::take(name, SocketSide::kMaster);
    const char done = lock ? 'y' : 'n';
    (void)!::write(said[1], &done, 1);
    ::pause();
  }
  char taken = 0;
  ASSERT_EQ(::read(said[0], &taken, 1), 1);
  EXPECT_EQ(taken, 'y');
  const auto refused = InterfaceLock::take(name, SocketSide::kMaster);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("process " + std::to_string(child)), std::string::npos);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_TRUE(InterfaceLock::take(name, SocketSide::kMaster));
  ::close(said[0]);
  ::close(said[1]);
}

}  // namespace
}  // namespace tandem::apps
