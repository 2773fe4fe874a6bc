// The datagrams that a service manager gets.
#include "apps/run/service_notice.hpp"

#include <gtest/gtest.h>

#include "tests/apps/service_manager.hpp"

namespace tandem::apps {
namespace {

using std::chrono::microseconds;
using Heard = std::vector<std::string>;

/// A limit that is never over within a test: one sign of life is enough then.
constexpr microseconds kLong{3'600'000'000};

TEST(ServiceNotice, IsReadyWhenTheLoopCyclesAndLivesFromThenOn) {
  ServiceManager manager;
  ASSERT_TRUE(manager.listens());
  ServiceNotice notice(manager.name(), kLong);
  notice.status("bring-up");
  notice.status("bring-up");
  EXPECT_EQ(manager.heard(), Heard{"STATUS=bring-up"}) << "not ready, no sign of life";
  for (int i = 0; i < 100; ++i) notice.cycles();
  notice.status("running");
  notice.stops();
  notice.stops();
  EXPECT_EQ(manager.heard(),
            (Heard{"STATUS=bring-up", "READY=1", "WATCHDOG=1", "STATUS=running", "STOPPING=1"}))
      << "and not at every look";
}

TEST(ServiceNotice, EachQuarterOfTheLimitHasASignOfLife) {
  ServiceManager manager;
  ServiceNotice notice(manager.name(), microseconds(4));  // every call is a quarter later
  for (int i = 0; i < 5; ++i) {
    notice.cycles();
    ::usleep(100);
  }
  EXPECT_EQ(manager.heard(), (Heard{"READY=1", "WATCHDOG=1", "WATCHDOG=1", "WATCHDOG=1",
                                    "WATCHDOG=1", "WATCHDOG=1"}));
}

// Nothing is lost by a manager that is busy.
TEST(ServiceNotice, SaysAtTheNextCallWhatAManagerHadNoRoomFor) {
  ServiceManager manager;
  ServiceNotice notice(manager.name(), {});
  for (int i = 0; i < 5000; ++i) notice.status(std::to_string(i));  // more than any queue has
  notice.status("last");
  EXPECT_NE(manager.heard().back(), "STATUS=last");
  notice.status("last");
  EXPECT_EQ(manager.heard().back(), "STATUS=last");
}

// The manager would kill a simulation that somebody has paused.
TEST(ServiceNotice, PausedTimeGivesNoSignOfLifeAndNoneIsExpected) {
  ServiceManager manager;
  ServiceNotice notice(manager.name(), kLong);
  notice.cycles();
  for (int i = 0; i < 10; ++i) notice.suspend();
  EXPECT_EQ(manager.heard(), (Heard{"READY=1", "WATCHDOG=1", "WATCHDOG_USEC=0"}));
  notice.cycles();
  EXPECT_EQ(manager.heard(), (Heard{"READY=1", "WATCHDOG=1", "WATCHDOG_USEC=0",
                                    "WATCHDOG_USEC=3600000000", "WATCHDOG=1"}));
}

TEST(ServiceNotice, ARunThatWaitsForAPersonIsReadyAndSaysSo) {
  ServiceManager manager;
  ServiceNotice notice(manager.name(), kLong);
  notice.waits("waits for its start\nREADY=0");
  EXPECT_EQ(manager.heard(),
            (Heard{"READY=1\nSTATUS=waits for its start READY=0", "WATCHDOG_USEC=0"}))
      << "and no words are lines of their own";
  notice.cycles();
  EXPECT_EQ(manager.place("WATCHDOG_USEC=3600000000"), 2U);
}

TEST(ServiceNotice, WhyItFailsIsTheLastWord) {
  ServiceManager manager;
  ServiceNotice notice(manager.name(), {});
  notice.fails("the loop hangs");
  notice.status("running");
  EXPECT_EQ(manager.heard(), Heard{"STATUS=the loop hangs"});
}

TEST(ServiceNotice, WithoutALimitThereAreNoSignsOfLife) {
  ServiceManager manager(true);
  ASSERT_TRUE(manager.listens());
  ServiceNotice notice(manager.name(), {});
  notice.cycles();
  notice.cycles();
  notice.suspend();
  EXPECT_EQ(manager.heard(), Heard{"READY=1"});
}

TEST(ServiceNotice, NobodyWhoListensIsNoError) {
  for (const std::string& name :
       {std::string(), std::string("relative"), std::string("/nowhere/at/all"),
        "/" + std::string(200, 'x'), std::string("vsock:2:1")}) {
    ServiceNotice notice(name, kLong);
    notice.cycles();
    notice.stops();
  }
}

TEST(ServiceNotice, TheEnvironmentSaysWhoListens) {
  ServiceManager manager;
  const auto told = [&](const char* limit, const std::string& process) {
    ::setenv("NOTIFY_SOCKET", manager.name().c_str(), 1);
    ::setenv("WATCHDOG_USEC", limit, 1);
    ::setenv("WATCHDOG_PID", process.c_str(), 1);
    const std::size_t before = manager.heard().size();
    ServiceNotice notice;
    notice.cycles();
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
    return manager.heard().size() - before;
  };
  const std::string here = std::to_string(::getpid());
  EXPECT_EQ(told("10000000", here), 2U) << "READY and WATCHDOG";
  EXPECT_EQ(told("10000000", "1"), 1U) << "the limit is another process'";
  for (const char* none : {"", "0", "-5", "x", "99999999999999999999"})
    EXPECT_EQ(told(none, here), 1U) << none;
}

}  // namespace
}  // namespace tandem::apps
