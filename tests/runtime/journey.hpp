// A run that goes back in time, and a witness that knows every cycle by its bits.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/logged_state.hpp"
#include "runtime/time_machine.hpp"
#include "tests/runtime/bundled_run.hpp"

namespace tandem::runtime {

inline std::uint64_t hash_of(std::span<const std::byte> bytes, std::uint64_t hash) {
  for (const std::byte one : bytes) {
    hash = (hash ^ static_cast<std::uint64_t>(one)) * 0x100000001B3U;
  }
  return hash;
}

/// Compares each cycle with what it was when it was first shown.
class Witness final : public hal::CycleObserver {
 public:
  void take(const hal::CycleView& view) noexcept TANDEM_RT override {
    std::uint64_t hash = hash_of(view.state.bytes(), 0xCBF29CE484222325U);
    hash = hash_of(view.command.bytes(), hash);
    if (view.truth != nullptr) hash = hash_of(view.truth->bytes(), hash);
    if (view.time.cycle >= hashes.size()) return;
    std::uint64_t& known = hashes[view.time.cycle];
    ++shown;
    if (known == 0) {
      known = hash;
    } else if (known == hash) {
      ++again;
    } else {
      ++others;
    }
    last = view.time.cycle;
  }
  std::vector<std::uint64_t> hashes = std::vector<std::uint64_t>(100'000);
  std::atomic<std::uint64_t> shown{0}, again{0}, others{0}, last{0};
};

/// A run that stands before its first cycle, with a loop on a thread of its own.
struct Journey {
  explicit Journey(const std::string& robot, const std::string& experiment,
                   log::Recorder* recorder = nullptr,
                   const std::vector<ExpectationSpec>& expectations = {})
      : Journey(
            robot, experiment, [expectations](Experiment& e) { e.expectations = expectations; },
            recorder) {}
  Journey(const std::string& robot, const std::string& experiment,
          std::function<void(Experiment&)> change, log::Recorder* recorder = nullptr)
      : Journey(robot, experiment, paused(std::move(change)), {}, recorder) {}
  /// @param overrides  begin paused: paused()
  Journey(const std::string& robot, const std::string& experiment, Overrides overrides,
          const Run::Connect& connect, log::Recorder* recorder = nullptr,
          std::size_t budget_bytes = TimeMachine::kBudget_bytes)
      : machine(1'000'000, budget_bytes, true),
        run(robot, experiment, std::move(overrides),
            {.recorder = recorder, .observer = &witness, .time_machine = &machine}, connect),
        loop([this, recorder] {
          if (recorder != nullptr) machine.log_to(states_to(*recorder, 1'000'000));
          run.cycle->run();
        }) {}
  ~Journey() { end(); }
  /// No cycle comes any more.
  void end() {
    run.cycle->inbox().end_run();
    if (loop.joinable()) loop.join();
  }
  static Overrides paused(std::function<void(Experiment&)> change) {
    Overrides overrides;
    overrides.start_paused = true;
    overrides.change = std::move(change);
    return overrides;
  }
  rt::ClockControl& clock() { return run.cycle->inbox().clock(); }
  void step(std::uint64_t cycles) {
    const Status stepped = clock().step(cycles);
    ASSERT_TRUE(stepped) << stepped.error().to_string();
    ASSERT_TRUE(clock().await_standing(60'000'000'000));
  }
  std::uint64_t now() { return clock().state().next_cycle; }
  void go(std::uint64_t next) {
    const auto travel = machine.go_to(*run.cycle, next);
    ASSERT_TRUE(travel) << travel.error().to_string();
    EXPECT_EQ(travel->to, next);
    EXPECT_EQ(travel->asked, next);
    if (next > 0) {
      EXPECT_EQ(witness.last, next - 1);
    }
  }
  std::string refusal(std::uint64_t next) {
    const auto travel = machine.go_to(*run.cycle, next);
    return travel ? "none" : travel.error().to_string();
  }

  Witness witness;
  TimeMachine machine;
  BundledRun run;
  std::thread loop;
};

}  // namespace tandem::runtime
