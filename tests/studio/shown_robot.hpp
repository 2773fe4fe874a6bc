// A robot of two joints whose cycles the test makes up, for taps.
// Layer: tests.  Thread: main.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <memory>
#include <string>

#include "hal/cycle_observer.hpp"
#include "hal/signal_block.hpp"
#include "studio/signal_table.hpp"
#include "studio/tap.hpp"

namespace tandem::studio::test {

/// Number `i` of a block in that cycle.
inline double number_of(std::uint64_t cycle, std::size_t i) {
  return static_cast<double>(cycle) + 0.001 * static_cast<double>(i);
}

/// A signal of so many numbers, and where they are written.
struct Block : hal::SignalBlock {
  explicit Block(std::size_t count) : numbers_at(declare("number", "m", "of a test", count)) {
    EXPECT_TRUE(close());
  }
  void set(std::uint64_t cycle) {
    for (std::size_t i = 0; i < numbers(); ++i) numbers_at[i] = number_of(cycle, i);
    publish(cycle, static_cast<std::int64_t>(cycle) * 1'000'000);
  }
  double* numbers_at;
};
inline std::shared_ptr<Block> block_of(std::size_t count) { return std::make_shared<Block>(count); }

inline SignalId id_of(const SignalTable& table, const std::string& name) {
  for (SignalId id = 0; id < table.size(); ++id) {
    if (table.name(id) == name) return id;
  }
  ADD_FAILURE() << "no signal " << name;
  return 0;
}

struct ShownRobot {
  static constexpr std::int64_t kPeriod_ns = 1'000'000;

  static double position(std::uint64_t cycle, std::size_t joint) {
    return 0.01 * static_cast<double>(cycle) + static_cast<double>(joint);
  }
  [[nodiscard]] Tap::Images images() const { return {&state, &command, &truth}; }
  [[nodiscard]] log::RunInfo names() const {
    log::RunInfo info;
    info.joints = {"a", "b"};
    return info;
  }
  /// One cycle, and the blocks of controllers that were active in it.
  void show(hal::CycleObserver& observer, std::uint64_t cycle,
            std::initializer_list<std::shared_ptr<Block>> blocks) {
    const hal::CycleTime time{cycle, static_cast<std::int64_t>(cycle) * kPeriod_ns, kPeriod_ns};
    state.cycle()[0] = cycle;
    state.time_ns()[0] = time.time_ns;
    for (std::size_t j = 0; j < 2; ++j) state.position_rad()[j] = position(cycle, j);
    for (const std::shared_ptr<Block>& block : blocks) {
      block->set(cycle);
      observer.take_signals(time, *block);
    }
    observer.take({.time = time,
                   .phase = phase,
                   .read_code = Code::kOk,
                   .state = state,
                   .command = command,
                   .truth = &truth,
                   .estimate = nullptr,
                   .times = {}});
  }

  struct Counter final : hal::CycleObserver {
    void take(const hal::CycleView&) noexcept TANDEM_RT override { ++cycles; }
    std::uint64_t cycles = 0;
  } counter;
  hal::RunPhase phase = hal::RunPhase::kRunning;
  hal::StateImage state{{.joints = 2, .sensor_channels = {}}};
  hal::CommandImage command{{.joints = 2, .sensor_channels = {}}};
  hal::TruthImage truth{2, 0};
};

}  // namespace tandem::studio::test
