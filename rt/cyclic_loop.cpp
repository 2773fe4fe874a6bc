// The pacing of a loop: wall clock, scaled, free running or external; its overrun accounting.
// Lateness under 1 ms of scaled time is recovered, beyond that the grid shifts.
#include "rt/cyclic_loop.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "base/archive.hpp"
#include "rt/clock_control.hpp"

namespace tandem::rt {
namespace {

/// Simulated time that is late by less catches up, which keeps the rate where a sleep is long
/// compared with a cycle. Beyond it the grid shifts: there is never a burst of cycles.
constexpr std::int64_t kMostCaughtUp_ns = 1'000'000;

std::int64_t scaled(std::int64_t period_ns, double rate) {
  if (rate <= 0.0) return 0;
  return std::max<std::int64_t>(1, std::llround(static_cast<double>(period_ns) / rate));
}

std::int64_t grid_step(const CyclicLoopConfig& config) {
  switch (config.pacing) {
    case Pacing::kWallClock: return config.period_ns;
    case Pacing::kSimulated: return scaled(config.period_ns, config.rate);
    case Pacing::kExternal: return 0;
  }
  return 0;
}

}  // namespace

CyclicLoop::CyclicLoop(const CyclicLoopConfig& config, Clock& clock, ClockControl* control)
    : config_(config),
      clock_(&clock),
      control_(config.pacing == Pacing::kSimulated ? control : nullptr),
      step_ns_(grid_step(config)) {
  assert(config.period_ns > 0 && config.rate >= 0.0);
  assert(1 <= config.stop_late && config.stop_late <= config.stop_window);
  assert(config.stop_window <= 64);
}

Tick CyclicLoop::wait() noexcept {
  Tick tick;
  if (replays_) {
    begin_ns_ = clock_->now_ns();
  } else if (control_ == nullptr) {
    pace(tick);
  } else {
    do {
      if (!obey()) return {.called = true};
    } while (!pace(tick) || !control_->begin());
  }
  tick.cycle = next_cycle_++;
  tick.time_ns = static_cast<std::int64_t>(tick.cycle) * config_.period_ns;
  tick.begin_ns = begin_ns_;
  if (replays_) return tick;
  if (paced()) {
    if (started_) {
      tick.wakeup_ns = begin_ns_ - grid_ns_;
      statistics_.wakeup.record(tick.wakeup_ns);
    }
    grid_ns_ += step_ns_;
  }
  started_ = true;
  ++statistics_.cycles;
  return tick;
}

/// What was asked of simulated time; blocks while it is paused. False: the loop is called away.
bool CyclicLoop::obey() noexcept {
  const bool hurries = paced() && stop_requested();
  if (started_ && !hurries && !control_->changed()) return true;
  const ClockControl::Pace pace = control_->attend(*clock_, next_cycle_, !started_);
  if (pace.stood) started_ = false;
  set_step(scaled(config_.period_ns, pace.rate));
  return !pace.called;
}

/// The next grid point follows from the last. Where it has passed already, the grid restarts: lost
/// time is not caught up, and does not count as late.
void CyclicLoop::set_step(std::int64_t step_ns) noexcept {
  if (step_ns == step_ns_) return;
  grid_ns_ += step_ns - step_ns_;
  if (!paced() || grid_ns_ < clock_->now_ns()) started_ = false;
  step_ns_ = step_ns;
}

/// Sleeps until the cycle's grid point. False: it was woken before.
bool CyclicLoop::pace(Tick& tick) noexcept {
  begin_ns_ = clock_->now_ns();
  if (!paced()) {
    late_mask_ <<= 1;
    return true;
  }
  if (!started_) {
    grid_ns_ = begin_ns_;
    return true;
  }
  if (begin_ns_ > grid_ns_) {
    // The last cycle ran into this grid point: the next one in the future takes its place.
    const std::int64_t missed = (begin_ns_ - grid_ns_ + step_ns_ - 1) / step_ns_;
    judge(tick, static_cast<std::uint64_t>(missed));
    if (config_.pacing == Pacing::kSimulated) {
      grid_ns_ = std::max(grid_ns_, begin_ns_ - kMostCaughtUp_ns);
      return true;
    }
    grid_ns_ += missed * step_ns_;
  } else {
    late_mask_ <<= 1;
  }
  if (control_ == nullptr) {
    clock_->sleep_until(grid_ns_);
  } else {
    control_->sleep_until(*clock_, grid_ns_);
  }
  begin_ns_ = clock_->now_ns();
  return begin_ns_ >= grid_ns_;
}

void CyclicLoop::judge(Tick& tick, std::uint64_t missed) noexcept TANDEM_RT {
  ++statistics_.overruns;
  tick.late = true;
  if (config_.pacing == Pacing::kWallClock) {  // simulated time cannot be missed, only delayed
    tick.skipped = missed;
    statistics_.skipped += missed;
    next_cycle_ += missed;
    tick.hold = config_.on_overrun == OverrunPolicy::kHold;
  }
  late_mask_ = (late_mask_ << 1) | 1U;
  if (config_.on_overrun != OverrunPolicy::kStop || config_.pacing != Pacing::kWallClock) return;
  tick.stop = is_late_often();
}

bool CyclicLoop::is_late_often() const noexcept TANDEM_RT {
  const std::uint64_t window =
      config_.stop_window == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << config_.stop_window) - 1;
  return std::popcount(late_mask_ & window) >= config_.stop_late;
}

std::int64_t CyclicLoop::exchanged() noexcept TANDEM_RT {
  const std::int64_t now_ns = clock_->now_ns();
  last_bus_ns_ = now_ns - begin_ns_;
  statistics_.bus.record(last_bus_ns_);
  begin_ns_ = now_ns;
  return now_ns;
}

std::int64_t CyclicLoop::finish() noexcept TANDEM_RT {
  const std::int64_t now_ns = clock_->now_ns();
  if (replays_) return now_ns;
  last_work_ns_ = now_ns - begin_ns_;
  statistics_.work.record(last_work_ns_);
  return now_ns;
}

void CyclicLoop::shift(std::int64_t ns) noexcept TANDEM_RT {
  if (config_.pacing != Pacing::kWallClock || !started_) return;
  const std::int64_t most_ns = config_.period_ns / 100;
  grid_ns_ += std::clamp(ns, -most_ns, most_ns);
}

std::int64_t CyclicLoop::due_ns() const noexcept TANDEM_RT {
  switch (config_.pacing) {
    case Pacing::kWallClock: return grid_ns_;
    case Pacing::kExternal: return begin_ns_ + config_.period_ns;
    case Pacing::kSimulated: break;
  }
  return std::numeric_limits<std::int64_t>::max();
}

void CyclicLoop::skip(Tick& tick, std::uint64_t cycles) noexcept TANDEM_RT {
  ++statistics_.overruns;
  statistics_.skipped += cycles;
  next_cycle_ += cycles;
  tick.skipped += cycles;
  tick.cycle += cycles;
  tick.time_ns = static_cast<std::int64_t>(tick.cycle) * config_.period_ns;
  if (config_.pacing != Pacing::kSimulated) return;
  tick.hold = config_.on_overrun == OverrunPolicy::kHold;
  late_mask_ |= 1U;
  tick.stop = config_.on_overrun == OverrunPolicy::kStop && is_late_often();
}

void CyclicLoop::archive(Archive& ar) {
  ar(next_cycle_);
  if (ar.reading()) {
    started_ = false;
    late_mask_ = 0;
  }
}

}  // namespace tandem::rt
