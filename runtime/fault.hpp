// What ended or disturbed a run: noted in the cycle without heap, readable while it runs.
// Layer: runtime.  Thread: RT to note and clear, any to read.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/limit_met.hpp"
#include "hal/stop_category.hpp"

namespace tandem::runtime {

struct FaultRecord {
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  /// Joint, sensor or controller, as the cause's row says. A collision of the base: -1 - k, k of
  /// estimation::kBaseChannels; a fall: thousandths of what was found.
  std::int32_t index = -1;
  std::uint32_t code = 0;  ///< of a drive, a controller or the backend, an age: as the row says
  hal::FaultCause cause = hal::FaultCause::kBackend;
  hal::StopCategory category = hal::row_of(cause).category;
  std::uint8_t padding[2] = {};
  std::int32_t controller = -1;  ///< whose doing it is, for ControllerHost::name(); -1: nobody's
  hal::LimitMet met{};           ///< of kCommand: what was commanded
};

/// Whether it is of the link to a robot far away.
[[nodiscard]] constexpr bool is_of_link(const FaultRecord& record) noexcept {
  return record.cause == hal::FaultCause::kLinkCommands ||
         record.cause == hal::FaultCause::kLinkStates;
}

/// Every fault of a run, in the order of their times. What does not fit is counted.
class FaultLog {
 public:
  static constexpr std::size_t kCapacity = 256;
  static constexpr std::int64_t kLatched = -1;

  // The loop's.
  void note(const FaultRecord& record) noexcept TANDEM_RT;
  void clear(std::size_t index, std::int64_t time_ns) noexcept TANDEM_RT;
  /// Clears those latched ones that `which`, a function of a record, picks.
  template <class Which>
  void clear_latched(std::int64_t time_ns, const Which& which) noexcept TANDEM_RT {
    for (std::size_t i = 0; i < size(); ++i) {
      if (cleared_ns(i) == kLatched && which(records_[i])) clear(i, time_ns);
    }
  }
  /// Causes that were noted since the last call, a bit each: also those that did not fit.
  [[nodiscard]] std::uint64_t take_noted() noexcept TANDEM_RT { return std::exchange(noted_, 0); }
  void archive(Archive& ar);

  // Any thread's.
  [[nodiscard]] std::size_t size() const noexcept { return size_.load(std::memory_order_acquire); }
  /// @pre index < size()
  [[nodiscard]] const FaultRecord& operator[](std::size_t index) const noexcept {
    return records_[index];
  }
  /// When a reset cleared it, or kLatched.
  [[nodiscard]] std::int64_t cleared_ns(std::size_t index) const noexcept {
    return cleared_ns_[index].load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::size_t latched() const noexcept TANDEM_RT;
  /// Faults that did not fit.
  [[nodiscard]] std::uint64_t lost() const noexcept {
    return lost_.load(std::memory_order_relaxed);
  }

 private:
  std::array<FaultRecord, kCapacity> records_{};
  std::array<std::atomic<std::int64_t>, kCapacity> cleared_ns_{};
  std::atomic<std::size_t> size_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::uint64_t noted_ = 0;  // the loop's
};

/// A fault in words.
struct FaultReport {
  std::uint64_t cycle = 0;
  double time_s = 0.0;
  std::string joint;       ///< joint, sensor or controller; empty when the robot as a whole
  std::string board;       ///< the joint's; may be empty
  std::string text;        ///< one sentence, without `joint`
  std::string controller;  ///< whose doing it is; empty: nobody's
  hal::FaultCause cause = hal::FaultCause::kNone;
  hal::StopCategory category = hal::StopCategory::kWarn;
  bool latched = true;
  double cleared_s = 0.0;  ///< when it is not latched
};

}  // namespace tandem::runtime
