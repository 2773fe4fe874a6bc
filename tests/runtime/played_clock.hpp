// A run whose time is paused, stepped, slowed down and hurried at random while it runs.
// Layer: tests.  Thread: the test's; the run has its own.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <thread>

#include "runtime/robot_cycle.hpp"

namespace tandem::runtime::test {

/// Runs it to its end, from standing before its first cycle.
/// @return how many commands its clock obeyed: the first round's, six, at least.
inline int run_with_played_clock(RobotCycle& cycle, std::uint32_t seed) {
  std::mt19937 random(seed);
  rt::ClockControl& clock = cycle.inbox().clock();
  EXPECT_TRUE(clock.pause());
  std::thread loop([&cycle] { cycle.run(); });
  int obeyed = 0;
  const auto is_done = [&cycle] { return cycle.progress().phase.load() == RunPhase::kDone; };
  const auto stand = [&] {
    while (!is_done() && !clock.await_standing(1'000'000)) {
    }
  };
  const double rates[] = {1000.0, 50.0, 5.0, 1.0};
  for (int round = 0; !is_done(); ++round) {
    if (clock.set_rate(rates[random() % 4])) ++obeyed;
    if (clock.pause()) ++obeyed;
    stand();
    if (clock.step(1 + random() % 20)) ++obeyed;
    stand();
    if (round % 16 == 0 && clock.set_rate(0.01)) {
      if (clock.step(3)) ++obeyed;
      stand();
    }
    if (clock.resume()) ++obeyed;
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
  }
  loop.join();
  return obeyed;
}

}  // namespace tandem::runtime::test
