// Clock times of every stage of the last cycles: a ring of plain data, filled in the cycle.
// Layer: runtime.  Thread: made non-RT; marked RT; read when the loop has stopped.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "rt/cyclic_loop.hpp"
#include "runtime/controller_times.hpp"

namespace tandem::runtime {

/// The stages of a cycle, in their order; docs/realtime.md.
enum class CycleStage : std::uint8_t {
  kWait,      ///< for the grid point, and when time is simulated for the log
  kExchange,  ///< with the bus; only of a backend that waits for one
  kRead,
  kCheck,
  kUpdate,
  kLimit,
  kWrite,
  kHandOver,
};
inline constexpr std::size_t kCycleStages = 8;
[[nodiscard]] const char* to_string(CycleStage stage) noexcept;

/// One cycle's clock times [ns], of the loop's clock.
struct CycleStamps {
  std::uint64_t cycle = 0;
  std::int64_t begin_ns = 0;  ///< of the wait: the end of the cycle before
  std::array<std::int64_t, kCycleStages>
      end_ns{};                 ///< of each stage; it begins where the last ended
  std::int64_t wakeup_ns = -1;  ///< from the grid point to the end of the wait; -1: not paced
  std::uint64_t skipped = 0;    ///< grid points missed just before
  bool late = false;            ///< the cycle before overran into this one's grid point
  std::uint32_t called = 0;     ///< of `calls`
  std::array<ControllerCall, 32> calls{};  ///< of the controllers

  [[nodiscard]] std::int64_t stage_ns(CycleStage stage) const noexcept {
    const auto i = static_cast<std::size_t>(stage);
    return end_ns[i] - (i == 0 ? begin_ns : end_ns[i - 1]);
  }
};

/// The last `capacity` cycles.
class CycleTrace {
 public:
  /// @param capacity  cycles; 0 traces nothing.
  explicit CycleTrace(std::size_t capacity) : ring_(capacity) {}

  [[nodiscard]] bool on() const noexcept TANDEM_RT { return !ring_.empty(); }

  /// While on, nothing is traced. Between two cycles.
  void mute(bool on) noexcept {
    muted_ = on;
    if (on) stamps_ = nullptr;
  }

  // Without a capacity these do nothing.

  /// A cycle begins: the end of its wait. It takes the oldest one's place.
  void begin(const rt::Tick& tick) noexcept TANDEM_RT;
  /// The end of one of its stages, at `now_ns`.
  void mark(CycleStage stage, std::int64_t now_ns) noexcept TANDEM_RT {
    if (stamps_ != nullptr) stamps_->end_ns[static_cast<std::size_t>(stage)] = now_ns;
  }
  /// The same, now.
  void mark(CycleStage stage, rt::Clock& clock) noexcept TANDEM_RT {
    if (stamps_ != nullptr) mark(stage, clock.now_ns());
  }
  /// The calls of its controllers.
  void note(std::span<const ControllerCall> calls) noexcept TANDEM_RT;
  /// The end of its last stage.
  void end(std::int64_t now_ns) noexcept TANDEM_RT {
    mark(CycleStage::kHandOver, now_ns);
    ended_ns_ = now_ns;
  }

  /// Cycles traced, those that the ring has forgotten included.
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return ring_.size(); }
  /// What the ring holds, the oldest first. Allocates.
  [[nodiscard]] std::vector<CycleStamps> cycles() const;

 private:
  std::vector<CycleStamps> ring_;
  std::uint64_t count_ = 0;
  CycleStamps* stamps_ = nullptr;  // this cycle's
  bool muted_ = false;
  std::int64_t ended_ns_ = 0;  // when the last cycle ended; 0: there was none
};

}  // namespace tandem::runtime
