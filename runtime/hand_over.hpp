// What every cycle leaves behind: for the log, the statistics, and the threads that watch the run.
// Layer: runtime.  Thread: made non-RT; the loop's.
#pragma once

#include <cstdint>
#include <vector>

#include "hal/cycle_observer.hpp"
#include "runtime/joint_arbiter.hpp"
#include "runtime/run_services.hpp"
#include "runtime/run_statistics.hpp"
#include "runtime/text_history.hpp"

namespace tandem::runtime {

class HandOver {
 public:
  /// All outlive it.
  HandOver(CycleNow& now, const DriveResets& resets, const JointHoming& homing,
           JointArbiter& arbiter, RunServices& services);

  /// To RunServices, how things are.
  void show() noexcept TANDEM_RT;
  /// A limit that was met, for people. @rt wait-free
  void tell(const LimitNote& limit) noexcept TANDEM_RT {
    if (!muted_) limits_.write(limit);
  }
  /// Time went back to here: nobody reads limits any more that were met after it.
  void forget_after(std::int64_t time_ns) noexcept { limits_.forget_after(time_ns); }
  /// What tell() was told. Any thread.
  [[nodiscard]] const LimitHistory& limits() const noexcept { return limits_; }
  /// While on, cycles are for the statistics alone. Between two cycles.
  void mute(bool on) noexcept { muted_ = on; }
  /// Each cycle, when its command is out.
  void take() noexcept TANDEM_RT;
  /// The last cycle once more, to one who came later; for any thread while the loop stands.
  /// @return false: there was none
  bool show_to(hal::CycleObserver& observer) const;
  /// The cycle that take() was called for, as observers see it. Between two of them.
  [[nodiscard]] hal::CycleView view() const noexcept TANDEM_RT;
  [[nodiscard]] const RunStatistics& statistics() const noexcept { return statistics_; }
  /// After the controllers, whose gains it shows once they are read.
  void archive(Archive& ar) {
    ar(statistics_, noted_);
    if (ar.reading()) show_gains();
  }

 private:
  void show_controllers() noexcept TANDEM_RT;
  void tell_ended_shadows() noexcept TANDEM_RT;
  void show_progress() noexcept TANDEM_RT;
  void show_joints(const hal::CommandImage& told) noexcept TANDEM_RT;
  void show_sensors() noexcept TANDEM_RT;
  void show_gains() noexcept TANDEM_RT;

  CycleNow& now_;
  const DriveResets& resets_;
  const JointHoming& homing_;
  JointArbiter& arbiter_;
  RunServices& services_;
  RunStatistics statistics_;
  LimitHistory limits_;
  std::vector<JointStatus> joints_;  // as services_ shows them
  std::vector<SensorStatus> sensors_;
  std::uint64_t shown_gains_ = 0;  // their revision
  std::uint64_t noted_ = 0;        // causes of faults, a bit each, since the cycle before
  bool muted_ = false;
};

}  // namespace tandem::runtime
