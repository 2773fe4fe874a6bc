// The watchdog by itself: what is a hang, what is a wait, and what follows.
#include "runtime/cycle_watchdog.hpp"

#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "base/process.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::runtime {
namespace {

using std::chrono::milliseconds;

struct Watched : ::testing::Test {
  CycleWatchdog::Hooks hooks() {
    return {.on_hang = [this](bool at_work) { (at_work ? hangs : waits) += 1; },
            .on_return = [this] { returns += 1; },
            .on_given_up = [this] { given_up += 1; }};
  }
  void cycles(int count) {
    for (int i = 0; i < count; ++i) {
      heartbeat.enter();
      heartbeat.leave();
      std::this_thread::sleep_for(milliseconds(1));
    }
  }

  Heartbeat heartbeat;
  std::atomic<int> hangs = 0, waits = 0, returns = 0, given_up = 0;
};

TEST_F(Watched, ALoopThatDoesNotLeaveItsCycleHangsAndIsGivenUpOnce) {
  const CycleWatchdog watchdog(heartbeat, {.limit = milliseconds(50), .grace = milliseconds(50)},
                               hooks());
  cycles(3);
  heartbeat.enter();
  EXPECT_TRUE(tandem::test::eventually([&] { return given_up == 1; }));
  EXPECT_EQ(hangs, 1);
  EXPECT_EQ(waits, 0);
  EXPECT_EQ(returns, 0);
}

// Single steps in a controller had stopped the run. A robot is not left alone for them.
TEST_F(Watched, ALoopThatADebuggerHoldsHangsOnARobotOnly) {
  for (const bool waits_for_debugger : {true, false}) {
    const pid_t child = ::fork();
    if (child == 0) {
      if (!tandem::test::eventually(is_debugged)) ::_exit(2);
      const CycleWatchdog watchdog(heartbeat,
                                   {.limit = milliseconds(50),
                                    .grace = std::chrono::hours(1),
                                    .waits_for_debugger = waits_for_debugger},
                                   hooks());
      heartbeat.enter();
      if (!waits_for_debugger)
        ::_exit(tandem::test::eventually([&] { return hangs == 1; }) ? 0 : 1);
      std::this_thread::sleep_for(milliseconds(300));
      ::_exit(hangs == 0 ? 0 : 1);
    }
    ASSERT_EQ(::ptrace(PTRACE_SEIZE, child, nullptr, nullptr), 0);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0) << waits_for_debugger;
  }
}

TEST_F(Watched, ALoopThatStandsStillIsNotWaitedFor) {
  const CycleWatchdog watchdog(
      heartbeat, {.limit = std::chrono::hours(1), .grace = milliseconds(50)}, hooks());
  cycles(3);
  heartbeat.enter();
  heartbeat.stand_still();
  EXPECT_TRUE(tandem::test::eventually([&] { return given_up == 1; }));
  EXPECT_EQ(hangs, 1);
}

TEST_F(Watched, ALoopThatComesBackIsToldAndWatchedOn) {
  const CycleWatchdog watchdog(
      heartbeat, {.limit = milliseconds(30), .grace = std::chrono::hours(1)}, hooks());
  for (int i = 1; i <= 2; ++i) {
    heartbeat.enter();
    EXPECT_TRUE(tandem::test::eventually([&] { return hangs == i; }));
    heartbeat.leave();
    EXPECT_TRUE(tandem::test::eventually([&] { return returns == i; }));
  }
  EXPECT_EQ(given_up, 0);
}

TEST_F(Watched, AWaitIsAHangOnlyWhereItHasALimit) {
  {
    const CycleWatchdog simulated(heartbeat, {.limit = milliseconds(20), .grace = milliseconds(20)},
                                  hooks());
    std::this_thread::sleep_for(milliseconds(100));  // the first cycle has not begun
    cycles(1);
    std::this_thread::sleep_for(milliseconds(200));
    EXPECT_EQ(hangs + waits, 0);
  }
  const CycleWatchdog on_robot(
      heartbeat,
      {.limit = milliseconds(20), .wait_limit = milliseconds(40), .grace = std::chrono::hours(1)},
      hooks());
  EXPECT_TRUE(tandem::test::eventually([&] { return waits == 1; }));
  EXPECT_EQ(hangs, 0);
}

}  // namespace
}  // namespace tandem::runtime
