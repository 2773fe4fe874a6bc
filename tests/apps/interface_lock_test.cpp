// One process per end of an interface.
#include "apps/can/interface_lock.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

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
