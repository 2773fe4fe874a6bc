// The periodic loop's time: when the next cycle starts, which number it has, whether it is late.
// Layer: rt.  Thread: the loop's own.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"
#include "rt/clock.hpp"
#include "rt/histogram.hpp"

namespace tandem {
class Archive;
}

namespace tandem::rt {

class ClockControl;

/// Who makes time pass.
enum class Pacing : std::uint8_t {
  kWallClock,  ///< cycle k starts at start + k * period; a missed grid point is a missed cycle
  kSimulated,  ///< time is the count of cycles; none is ever missed, a slow one delays the rest
  kExternal,   ///< somebody else blocks until the cycle comes round (a bus): wait() never sleeps
};

/// What follows a late cycle. In every case it is counted, the loop goes on at the next grid
/// point, and the phase of the grid stays.
enum class OverrunPolicy : std::uint8_t {
  kSkip,  ///< go on; controllers see the time that has passed
  kHold,  ///< the next cycle repeats the last command instead of running the controllers
  kStop,  ///< as kSkip, until `stop_late` of the last `stop_window` cycles were late
};

struct CyclicLoopConfig {
  std::int64_t period_ns = 1'000'000;
  Pacing pacing = Pacing::kSimulated;
  double rate = 0.0;          ///< simulated only: times real time; 0 runs as fast as it can
  bool start_paused = false;  ///< simulated only: no cycle before a ClockControl lets it
  OverrunPolicy on_overrun = OverrunPolicy::kSkip;
  int stop_late = 5;     ///< 1 to stop_window
  int stop_window = 50;  ///< 1 to 64 cycles
};

/// One cycle, as wait() announces it.
struct Tick {
  std::uint64_t cycle = 0;      ///< number of the cycle
  std::int64_t time_ns = 0;     ///< cycle * period_ns, exactly
  std::int64_t begin_ns = 0;    ///< clock time at which it began: the return of wait()
  std::int64_t wakeup_ns = -1;  ///< from the grid point to begin_ns; -1: not paced, or the first
  std::uint64_t skipped = 0;    ///< wall clock: cycles missed just before this one
  bool late = false;            ///< the cycle before overran into this one's grid point
  bool hold = false;            ///< the policy wants the last command repeated
  bool stop = false;            ///< the policy wants the robot stopped
  bool called = false;          ///< no cycle: somebody wants the loop between two (ClockControl)
};

/// Counts and histograms of one run.
struct CycleStatistics {
  std::uint64_t cycles = 0;    ///< started
  std::uint64_t overruns = 0;  ///< cycles whose work ended after the next grid point
  std::uint64_t skipped = 0;   ///< grid points without a cycle (wall clock)
  Histogram wakeup;            ///< from the grid point to the return of wait(); paced runs only
  Histogram bus;               ///< from the return of wait() to exchanged(); with a bus only
  Histogram work;              ///< the rest, to finish(): what the cycle itself computes
};

/// `for (;;) { const Tick tick = loop.wait(); …; loop.finish(); }`, and exchanged() between the
/// two by a cycle that waits for a bus.
class CyclicLoop {
 public:
  /// @pre config.period_ns > 0, rate >= 0, 1 <= stop_late <= stop_window <= 64.
  /// Clock and control outlive the loop; null: nobody pauses it. Real time obeys no control.
  CyclicLoop(const CyclicLoopConfig& config, Clock& clock, ClockControl* control = nullptr);

  /// Blocks until the next cycle's start. The first call starts the grid and returns cycle
  /// `next_cycle()` at once, and so does the first after a pause, which is no overrun. One sleep
  /// and one or two clock reads; no allocation, and no lock unless something was asked for.
  [[nodiscard]] Tick wait() noexcept;
  /// The answers of the bus are there: what follows is the cycle's own work.
  /// @return the clock's time [ns]. @rt one clock read.
  std::int64_t exchanged() noexcept TANDEM_RT;
  /// The cycle's work is done. @return the clock's time [ns]. @rt one clock read.
  std::int64_t finish() noexcept TANDEM_RT;

  /// The number that the next wait() gives when nothing is late.
  [[nodiscard]] std::uint64_t next_cycle() const noexcept { return next_cycle_; }
  [[nodiscard]] const CyclicLoopConfig& config() const noexcept { return config_; }
  [[nodiscard]] const CycleStatistics& statistics() const noexcept { return statistics_; }
  /// Bus time of the newest cycle that waited for one; -1: none did.
  [[nodiscard]] std::int64_t last_bus_ns() const noexcept { return last_bus_ns_; }
  /// Work time of the newest cycle that finished.
  [[nodiscard]] std::int64_t last_work_ns() const noexcept { return last_work_ns_; }

  /// External pacing: so many cycles went by unseen before the one that wait() has announced, which
  /// gets its number and time by that. Counted as an overrun's are. In simulated time it is an
  /// overrun that was: what the policy made of it on the wall clock follows again.
  void skip(Tick& tick, std::uint64_t cycles) noexcept TANDEM_RT;

  /// Moves the grid, and all that comes after, by `ns`: the wire has a clock of its own. At most a
  /// hundredth of the period a call; without effect where no clock paces the loop.
  void shift(std::int64_t ns) noexcept TANDEM_RT;

  /// While on, what has been is played again: cycles follow each other at once, nobody is asked
  /// whether they may, and none is counted or measured. Between two cycles.
  void replay(bool on) noexcept { replays_ = on; }

  /// Clock time at which the next cycle has to begin, in real time; of simulated time, which is
  /// never missed, the end of time. @rt
  [[nodiscard]] std::int64_t due_ns() const noexcept TANDEM_RT;
  /// A late cycle before this one counts no more towards OverrunPolicy::kStop.
  void forgive_late() noexcept TANDEM_RT { late_mask_ &= ~std::uint64_t{1}; }
  /// The overruns so far count no more towards OverrunPolicy::kStop.
  void forget_late() noexcept TANDEM_RT { late_mask_ = 0; }
  /// The cycle counter, which is all that simulated time is. The grid restarts at the next
  /// wait(); statistics go on.
  void archive(Archive& ar);

 private:
  [[nodiscard]] bool paced() const noexcept { return step_ns_ > 0; }
  bool obey() noexcept;
  void set_step(std::int64_t step_ns) noexcept;
  bool pace(Tick& tick) noexcept;
  void judge(Tick& tick, std::uint64_t missed) noexcept TANDEM_RT;
  [[nodiscard]] bool is_late_often() const noexcept TANDEM_RT;

  CyclicLoopConfig config_;
  Clock* clock_;
  ClockControl* control_;
  std::int64_t step_ns_ = 0;  // between grid points on the clock; 0: not paced
  std::int64_t grid_ns_ = 0;  // clock time of the next grid point
  bool started_ = false;
  bool replays_ = false;
  std::uint64_t next_cycle_ = 0;
  std::int64_t begin_ns_ = 0;  // clock time at which the current cycle's work began
  std::int64_t last_bus_ns_ = -1, last_work_ns_ = 0;
  std::uint64_t late_mask_ = 0;  // bit 0: the newest cycle was late
  CycleStatistics statistics_;
};

}  // namespace tandem::rt
