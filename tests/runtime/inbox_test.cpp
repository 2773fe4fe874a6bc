// What is asked of the loop, and how a stop is confirmed.
#include "runtime/inbox.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace tandem::runtime {
namespace {

using hal::StopCategory;

struct Asking : ::testing::Test {
  Inbox inbox{rt::CyclicLoopConfig{}};
};

TEST_F(Asking, AStopIsConfirmedWhenItsCycleIsOverAndNotBefore) {
  const std::uint32_t number = inbox.emergency_stop(StopCategory::kCategory0);
  EXPECT_TRUE(inbox.is_urgent());
  EXPECT_EQ(inbox.confirmed(number), std::nullopt);
  inbox.confirm(6);
  EXPECT_EQ(inbox.confirmed(number), std::nullopt) << "nobody has taken it";
  EXPECT_EQ(inbox.take_urgent().emergency_stop, StopCategory::kCategory0);
  EXPECT_EQ(inbox.confirmed(number), std::nullopt) << "its command is not out yet";
  inbox.confirm(7);
  EXPECT_EQ(inbox.confirmed(number), 7U);
  EXPECT_FALSE(inbox.is_urgent());
}

TEST_F(Asking, StopsOfOneCycleAreConfirmedTogetherAndTheHardestIsTaken) {
  const std::uint32_t one = inbox.emergency_stop(StopCategory::kCategory1);
  const std::uint32_t other = inbox.emergency_stop(StopCategory::kCategory0);
  inbox.end_run();
  inbox.reset_faults();
  const Inbox::Urgent asked = inbox.take_urgent();
  EXPECT_EQ(asked.emergency_stop, StopCategory::kCategory0);
  EXPECT_TRUE(asked.end);
  EXPECT_TRUE(asked.reset);
  EXPECT_FALSE(inbox.take_urgent().reset) << "taken";
  inbox.confirm(1);
  EXPECT_EQ(inbox.confirmed(one), 1U);
  EXPECT_EQ(inbox.confirmed(other), 1U);
  const std::uint32_t later = inbox.emergency_stop(StopCategory::kCategory1);
  inbox.confirm(2);
  EXPECT_EQ(inbox.confirmed(later), std::nullopt);
  EXPECT_EQ(inbox.take_urgent().emergency_stop, StopCategory::kCategory1);
}

// Between a stop's flag and its number the loop may take the flag.
TEST_F(Asking, NoStopOfManyThreadsIsLostOrConfirmedTooEarly) {
  constexpr int kThreads = 4, kStops = 2000;
  std::atomic<int> asking{kThreads};
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < kStops; ++i) {
        const std::uint32_t number = inbox.emergency_stop(StopCategory::kCategory1);
        while (!inbox.confirmed(number)) std::this_thread::yield();
      }
      --asking;
    });
  }
  std::uint64_t stopped = 0;
  for (std::uint64_t cycle = 0; asking > 0; ++cycle) {
    if (inbox.take_urgent().emergency_stop != StopCategory::kWarn) ++stopped;
    inbox.confirm(cycle);
    std::this_thread::yield();
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GE(stopped, static_cast<std::uint64_t>(kStops)) << "each thread waits for its own";
  EXPECT_FALSE(inbox.is_urgent());
}

}  // namespace
}  // namespace tandem::runtime
