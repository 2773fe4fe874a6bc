// What is asked of the loop, and how a stop is confirmed.
#include "runtime/requests.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace tandem::runtime {
namespace {

using hal::StopCategory;

struct Asking : ::testing::Test {
  rt::Doorbell bell;
  Requests requests{bell};
};

TEST_F(Asking, AStopIsConfirmedWhenItsCycleIsOverAndNotBefore) {
  const std::uint32_t number = requests.emergency_stop(StopCategory::kCategory0);
  EXPECT_TRUE(requests.pending());
  EXPECT_EQ(requests.confirmed(number), std::nullopt);
  requests.confirm(6);
  EXPECT_EQ(requests.confirmed(number), std::nullopt) << "nobody has taken it";
  EXPECT_EQ(requests.take().emergency_stop, StopCategory::kCategory0);
  EXPECT_EQ(requests.confirmed(number), std::nullopt) << "its command is not out yet";
  requests.confirm(7);
  EXPECT_EQ(requests.confirmed(number), 7U);
  EXPECT_FALSE(requests.pending());
}

TEST_F(Asking, StopsOfOneCycleAreConfirmedTogetherAndTheHardestIsTaken) {
  const std::uint32_t one = requests.emergency_stop(StopCategory::kCategory1);
  const std::uint32_t other = requests.emergency_stop(StopCategory::kCategory0);
  requests.end_run();
  requests.reset_faults();
  const Requests::Pending asked = requests.take();
  EXPECT_EQ(asked.emergency_stop, StopCategory::kCategory0);
  EXPECT_TRUE(asked.end);
  EXPECT_TRUE(asked.reset);
  requests.confirm(1);
  EXPECT_EQ(requests.confirmed(one), 1U);
  EXPECT_EQ(requests.confirmed(other), 1U);
  const std::uint32_t later = requests.emergency_stop(StopCategory::kCategory1);
  requests.confirm(2);
  EXPECT_EQ(requests.confirmed(later), std::nullopt);
  EXPECT_EQ(requests.take().emergency_stop, StopCategory::kCategory1);
}

// Between a stop's flag and its number the loop may take the flag.
TEST_F(Asking, NoStopOfManyThreadsIsLostOrConfirmedTooEarly) {
  constexpr int kThreads = 4, kStops = 2000;
  std::atomic<int> asking{kThreads};
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < kStops; ++i) {
        const std::uint32_t number = requests.emergency_stop(StopCategory::kCategory1);
        while (!requests.confirmed(number)) std::this_thread::yield();
      }
      --asking;
    });
  }
  std::uint64_t stopped = 0;
  for (std::uint64_t cycle = 0; asking > 0; ++cycle) {
    if (requests.take().emergency_stop != StopCategory::kWarn) ++stopped;
    requests.confirm(cycle);
    std::this_thread::yield();
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GE(stopped, static_cast<std::uint64_t>(kStops)) << "each thread waits for its own";
  EXPECT_FALSE(requests.pending());
}

}  // namespace
}  // namespace tandem::runtime
