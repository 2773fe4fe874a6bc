// A child that works for this process: how long it is waited for.
#include "base/own_child.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>

namespace tandem {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// Longer than a child had that gets little of the processor.
void work_for_3_s(void*) {
  const auto end = SteadyClock::now() + std::chrono::seconds(3);
  while (SteadyClock::now() < end) asm volatile("" ::: "memory");
}

TEST(OwnChild, ThatWorksHasTheTimeForIt) { EXPECT_TRUE(run_in_child(&work_for_3_s, nullptr)); }

TEST(OwnChild, ThatWorksForTooLongIsEnded) {
  EXPECT_FALSE(run_in_child(&work_for_3_s, nullptr, {.longest = std::chrono::seconds(1)}));
}

TEST(OwnChild, ThatWaitsForWhatNeverComesIsEnded) {
  const auto waits = [](void*) {
    while (true) ::pause();
  };
  EXPECT_FALSE(run_in_child(waits, nullptr, {.longest = std::chrono::hours(1)}));
}

TEST(OwnChild, ThatCrashesTakesNobodyWithIt) {
  EXPECT_FALSE(run_in_child([](void*) { std::raise(SIGKILL); }, nullptr));
}

}  // namespace
}  // namespace tandem
