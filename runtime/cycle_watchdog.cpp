#include "runtime/cycle_watchdog.hpp"

#include <algorithm>
#include <utility>

#include "base/process.hpp"

namespace tandem::runtime {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using SteadyClock = std::chrono::steady_clock;

/// Between two looks: a tenth of the limit, so that it is kept within that.
nanoseconds tick_of(nanoseconds limit) {
  return std::clamp<nanoseconds>(limit / 10, milliseconds(1), milliseconds(50));
}

}  // namespace

CycleWatchdog::CycleWatchdog(const Heartbeat& heartbeat, const WatchdogConfig& config, Hooks hooks)
    : heartbeat_(&heartbeat),
      config_(config),
      hooks_(std::move(hooks)),
      tick_(tick_of(config.limit)),
      thread_([this] { run(); }) {}

CycleWatchdog::~CycleWatchdog() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

/// @return false: the watchdog is to end
bool CycleWatchdog::sleep() {
  std::unique_lock lock(mutex_);
  return !ended_.wait_for(lock, tick_, [this] { return ending_; });
}

void CycleWatchdog::run() {
  std::uint64_t seen = 0;
  nanoseconds silent{};
  bool hung = false;
  SteadyClock::time_point before = SteadyClock::now();
  while (sleep()) {
    const SteadyClock::time_point now = SteadyClock::now();
    const nanoseconds awake = std::min<nanoseconds>(now - before, 2 * tick_);
    before = now;
    const std::uint64_t beats = heartbeat_->beats();
    if (beats != seen) {
      if (hung) hooks_.on_return();
      hung = false;
      silent = {};
      seen = beats;
      if (hooks_.on_cycles) hooks_.on_cycles();
      continue;
    }
    const bool at_work = Heartbeat::at_work(beats);
    const bool crashed = heartbeat_->stands_still();
    nanoseconds limit = at_work ? config_.limit : config_.wait_limit;
    if (beats == 0) continue;
    if (limit == nanoseconds{} && !crashed) {
      if (hooks_.on_wait) hooks_.on_wait();
      continue;
    }
    if (crashed) limit = {};  // there is nothing to wait for
    silent += awake;
    if (silent > limit && !crashed && config_.waits_for_debugger && time_limits_are_waived()) {
      silent = {};
    }
    if (!hung && silent > limit) {
      hung = true;
      hooks_.on_hang(at_work);
    } else if (hung && silent > limit + config_.grace) {
      hooks_.on_given_up();
      return;
    }
  }
}

}  // namespace tandem::runtime
