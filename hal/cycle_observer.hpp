// What every cycle shows to whoever watches the loop from another thread.
// Layer: hal.  Thread: take() the loop's.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/backend.hpp"
#include "hal/estimate.hpp"
#include "hal/image.hpp"
#include "hal/run_phase.hpp"
#include "hal/signal_block.hpp"
#include "hal/truth.hpp"

namespace tandem::hal {

/// How long a cycle took, on the loop's clock.
struct CycleTimes {
  std::int64_t begin_ns = 0;    ///< clock time of the cycle's begin
  std::int64_t wakeup_ns = -1;  ///< from the grid point to the cycle's begin; -1: not paced
  std::int64_t bus_ns = -1;     ///< then to the bus' answers; -1: waits for none
  std::int64_t work_ns = 0;     ///< the rest, of the cycle before this one
  std::uint64_t overruns = 0;   ///< so far
  std::uint64_t skipped = 0;    ///< grid points without a cycle so far
};

/// One cycle when everything of it is done. References are good during the call.
struct CycleView {
  CycleTime time;
  RunPhase phase;
  Code read_code;  ///< of the backend's read()
  const StateImage& state;
  const CommandImage&
      command;              ///< as the log has it: what went to the drives, and wanted positions
  const TruthImage* truth;  ///< null without a simulation
  const EstimateImage* estimate;  ///< null where nothing is estimated
  CycleTimes times;
  std::uint64_t faults = 0;  ///< causes that were noted since the cycle before, a bit each
};

class CycleObserver {
 public:
  virtual ~CycleObserver() = default;
  /// The last step of every cycle.
  /// @rt wait-free: copies what it needs into a ring, and counts what does not fit.
  virtual void take(const CycleView& view) noexcept TANDEM_RT = 0;
  /// Before take() of the same cycle, for each controller that has written signals in it.
  /// @param block  good during the call; its image() has the numbers
  /// @rt the same
  virtual void take_signals(const CycleTime& /*time*/,
                            const SignalBlock& /*block*/) noexcept TANDEM_RT {}
};

/// A place for an observer that comes while the loop runs, and stays until there are no more
/// cycles.
class LateObserver final : public CycleObserver {
 public:
  /// Any thread, once. It may see the end of a cycle whose signals it was not shown.
  /// @param observer  outlives the cycles
  void attach(CycleObserver& observer) noexcept { to_.store(&observer, std::memory_order_release); }
  /// @rt one load where nobody watches
  void take(const CycleView& view) noexcept TANDEM_RT override {
    CycleObserver* to = to_.load(std::memory_order_acquire);
    if (to != nullptr) to->take(view);
  }
  void take_signals(const CycleTime& time, const SignalBlock& block) noexcept TANDEM_RT override {
    CycleObserver* to = to_.load(std::memory_order_acquire);
    if (to != nullptr) to->take_signals(time, block);
  }

 private:
  std::atomic<CycleObserver*> to_{nullptr};
};

/// Several observers of one loop, in the order in which they were added.
class CycleFanOut final : public CycleObserver {
 public:
  /// Before the first cycle. @param observer  outlives the cycles; null is left out
  void add(CycleObserver* observer) {
    if (observer != nullptr) observers_.push_back(observer);
  }
  /// What a cycle gets: null where nobody watches.
  [[nodiscard]] CycleObserver* observer() noexcept {
    if (observers_.size() < 2) return observers_.empty() ? nullptr : observers_.front();
    return this;
  }
  void take(const CycleView& view) noexcept TANDEM_RT override {
    for (CycleObserver* one : observers_) one->take(view);
  }
  void take_signals(const CycleTime& time, const SignalBlock& block) noexcept TANDEM_RT override {
    for (CycleObserver* one : observers_) one->take_signals(time, block);
  }

 private:
  std::vector<CycleObserver*> observers_;
};

}  // namespace tandem::hal
