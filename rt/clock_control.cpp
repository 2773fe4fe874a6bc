// Requests wait under a mutex; the loop takes them between two cycles, in attend(), and sleeps on
// the doorbell while time is paused.
#include "rt/clock_control.hpp"

#include <chrono>
#include <utility>

namespace tandem::rt {

Status check_rate(double rate) {
  if (rate == 0.0 || (kSlowest <= rate && rate <= kFastest)) return {};
  return fail("the rate is neither 0 nor from 0.01 to 1000",
              "it is simulated seconds per wall second; 0 runs as fast as the machine goes");
}

ClockControl::ClockControl(const CyclicLoopConfig& config, Doorbell& bell)
    : pacing_(config.pacing),
      bell_(&bell),
      gated_(config.start_paused && config.pacing == Pacing::kSimulated),
      seen_(bell.count()) {
  state_.pacing = pacing_;
  state_.period_ns = config.period_ns;
  state_.paused = gated_;
  state_.rate = config.rate;
}

Status ClockControl::check() const {
  if (pacing_ == Pacing::kSimulated) {
    if (!bell_->ended()) return {};
    return fail("the run is ending, which nothing holds up", "start another one");
  }
  return fail(pacing_ == Pacing::kWallClock
                  ? "the run is in real time: a robot's time cannot be paused, stepped or scaled"
                  : "the run is paced by a bus: its time cannot be paused, stepped or scaled",
              "simulated time can: run in simulation, or over CAN with --lockstep");
}

Result<std::uint64_t> ClockControl::pause() {
  std::uint64_t dropped = 0;
  {
    const std::lock_guard lock(mutex_);
    if (Status possible = check(); !possible) return std::unexpected(possible.error());
    state_.paused = true;
    dropped = std::exchange(state_.pending_steps, 0);
  }
  bell_->ring();
  return dropped;
}

Status ClockControl::resume() {
  {
    const std::lock_guard lock(mutex_);
    if (Status possible = check(); !possible) return possible;
    state_.paused = false;
    state_.standing = false;
    state_.pending_steps = 0;
  }
  stands_.notify_all();
  bell_->ring();
  return {};
}

Status ClockControl::step(std::uint64_t cycles) {
  {
    const std::lock_guard lock(mutex_);
    if (Status possible = check(); !possible) return possible;
    if (!state_.paused) return fail("time is running", "pause it first: tandem clock pause");
    if (cycles < 1 || cycles > kMostSteps) {
      return fail("a step is of 1 to 1000000000 cycles", "resume to go on without a limit");
    }
    state_.pending_steps += cycles;
    state_.standing = false;
  }
  bell_->ring();
  return {};
}

Status ClockControl::set_rate(double rate) {
  {
    const std::lock_guard lock(mutex_);
    if (Status possible = check(); !possible) return possible;
    if (Status right = check_rate(rate); !right) return right;
    state_.rate = rate;
  }
  bell_->ring();
  return {};
}

Status ClockControl::call() {
  {
    const std::lock_guard lock(mutex_);
    if (Status possible = check(); !possible) return possible;
    called_ = true;
  }
  bell_->ring();
  return {};
}

ClockState ClockControl::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

bool ClockControl::await_standing(std::int64_t at_most_ns) const {
  std::unique_lock lock(mutex_);
  stands_.wait_for(lock, std::chrono::nanoseconds(at_most_ns),
                   [this] { return state_.standing || !state_.paused; });
  return state_.standing;
}

bool ClockControl::while_standing(const std::function<void()>& look) const {
  const std::lock_guard lock(mutex_);  // without which the loop does not go on
  if (state_.standing) look();
  return state_.standing;
}

ClockControl::Pace ClockControl::attend(Clock& clock, std::uint64_t cycle, bool restart) noexcept {
  std::unique_lock lock(mutex_);
  bool stood = false;
  for (;;) {
    seen_ = bell_->count();
    if (bell_->ended()) {
      state_.paused = false;
      state_.pending_steps = 0;
      state_.rate = 0.0;
      stands_.notify_all();
    }
    if (called_ || !state_.paused || state_.pending_steps > 0) break;
    stood = true;
    stand(lock, cycle);
  }
  const bool called = std::exchange(called_, false);
  state_.standing = false;
  state_.next_cycle = cycle;
  if (restart || stood || state_.rate != rate_) {
    state_.since_ns = clock.now_ns();
    state_.since_cycle = cycle;
  }
  rate_ = state_.rate;
  gated_ = state_.paused;
  return {.rate = rate_, .stood = stood || called, .called = called};
}

/// Lets go of the lock meanwhile.
void ClockControl::stand(std::unique_lock<std::mutex>& lock, std::uint64_t cycle) noexcept {
  state_.standing = true;
  state_.next_cycle = cycle;
  stands_.notify_all();
  lock.unlock();
  bell_->wait(seen_);
  lock.lock();
}

void ClockControl::sleep_until(Clock& clock, std::int64_t deadline_ns) noexcept {
  clock.sleep_until_rung(deadline_ns, *bell_, seen_);
}

bool ClockControl::take_step() noexcept {
  const std::lock_guard lock(mutex_);
  if (!state_.paused) return true;
  if (state_.pending_steps == 0) return false;
  --state_.pending_steps;
  return true;
}

}  // namespace tandem::rt
