// What any thread asks of simulated time: pause, resume, step, rate.
// Layer: rt.  Thread: ask from any, not in a signal handler; the loop's own part says so.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "rt/cyclic_loop.hpp"
#include "rt/doorbell.hpp"

namespace tandem::rt {

/// Simulated seconds per wall second; beside them 0, which is as fast as the machine goes.
inline constexpr double kSlowest = 0.01, kFastest = 1000.0;
/// Cycles of one step(), at most.
inline constexpr std::uint64_t kMostSteps = 1'000'000'000;

/// Where simulated time stands.
struct ClockState {
  Pacing pacing = Pacing::kSimulated;
  std::int64_t period_ns = 0;
  bool paused = false;              ///< no cycle but those of a step
  bool standing = false;            ///< the loop waits: for a resume, a step, or the end
  double rate = 0.0;                ///< times real time; 0: free running
  std::uint64_t pending_steps = 0;  ///< cycles that were asked for and have not begun
  std::uint64_t next_cycle = 0;     ///< the first that has not begun; exact while standing
  std::int64_t since_ns = 0;        ///< wall clock: time has gone on at this rate since then
  std::uint64_t since_cycle = 0;    ///< and since this cycle
};

/// Errors: a rate that is neither 0 nor from kSlowest to kFastest.
[[nodiscard]] Status check_rate(double rate);

/// Simulated time is a count of cycles, so nothing of this changes a bit of the results.
///
/// A run that is asked to end is not kept: its time goes on, free running, and cannot be paused
/// any more. Every other request to a loop that stands is kept for its next cycle.
///
/// Real time cannot be asked for anything: every command is refused with the reason.
class ClockControl {
 public:
  /// Pacing, rate and start_paused of the loop. `bell` is what the loop waits by; it outlives
  /// this, and everything asked for rings it.
  ClockControl(const CyclicLoopConfig& config, Doorbell& bell);

  /// No cycle begins any more; the one at work ends. Nothing to do is no error.
  /// @return the cycles of steps that were still to begin: they are dropped.
  [[nodiscard]] Result<std::uint64_t> pause();
  /// Time goes on at its rate; steps that are still to begin are part of it.
  [[nodiscard]] Status resume();
  /// While paused: exactly so many cycles run, at the rate, then time stands again. Steps add up.
  /// Errors: time is running; 0 or more than kMostSteps.
  [[nodiscard]] Status step(std::uint64_t cycles);
  /// From the next cycle on; one that sleeps for its time to come is woken. Errors: check_rate()'s.
  [[nodiscard]] Status set_rate(double rate);

  [[nodiscard]] ClockState state() const;
  /// Blocks until the loop stands, or time is not paused any more, for at most so long.
  /// @return whether it stands.
  [[nodiscard]] bool await_standing(std::int64_t at_most_ns) const;
  /// Calls the loop away: the next wait() begins no cycle, whether time stands or goes on, and
  /// says so. Of several calls one counts. Errors: those of every command.
  [[nodiscard]] Status call();
  /// Calls `look` while the loop stands, and keeps it standing meanwhile: what the loop writes may
  /// be read. `look` is short, and asks nothing of this. @return whether it stood
  bool while_standing(const std::function<void()>& look) const;

  // The loop's own.

  /// How time goes on after attend().
  struct Pace {
    double rate;
    bool stood;   ///< the loop has been kept
    bool called;  ///< away, before the next cycle
  };
  /// Whether attend() has anything to do. @rt one relaxed load.
  [[nodiscard]] bool changed() const noexcept TANDEM_RT { return gated_ || bell_->peek() != seen_; }
  /// Blocks while time is paused and no step is pending.
  /// @param cycle    that would begin next
  /// @param restart  the loop has not begun, or was rewound: its speed is measured anew
  [[nodiscard]] Pace attend(Clock& clock, std::uint64_t cycle, bool restart) noexcept;
  /// Sleeps until `deadline_ns`, or until something is asked for.
  void sleep_until(Clock& clock, std::int64_t deadline_ns) noexcept;
  /// The cycle begins, and counts as a step while paused. False: time was paused just now.
  [[nodiscard]] bool begin() noexcept { return !gated_ || take_step(); }

 private:
  [[nodiscard]] Status check() const;
  [[nodiscard]] bool take_step() noexcept;
  void stand(std::unique_lock<std::mutex>& lock, std::uint64_t cycle) noexcept;

  const Pacing pacing_;
  Doorbell* bell_;
  // The loop's.
  bool gated_;  // cycles begin by take_step()
  std::uint32_t seen_;
  double rate_ = 0.0;

  mutable std::mutex mutex_;
  mutable std::condition_variable stands_;
  ClockState state_;
  bool called_ = false;
};

}  // namespace tandem::rt
