// A slave's distributed clock: set once after the first slave's, and how far it is off after that.
// Layer: hal/ethercat-can/line.  Thread: construction non-RT; the rest the loop's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/ethercat-can/line/clock_times.hpp"
#include "hal/ethercat-can/line/exchange.hpp"

namespace tandem::hal::ecat {

/// The reference clock, for those that follow it.
struct ClockReference {
  std::uint16_t station = 0;  ///< 0: there is none
  bool set = false;           ///< whether its offset has been written
  std::uint64_t offset_ns = 0;
  std::uint64_t time_ns = 0;  ///< its system time in the last cycle
};

/// How far a slave's clock was ahead of the reference in OP [ns]. A measurement, no state.
struct ClockFigures {
  std::int32_t least = 0;
  std::int32_t most = 0;
  std::uint64_t count = 0;
};

class SlaveClock {
 public:
  static constexpr std::uint64_t kSync0LeadNs = 100'000'000;
  static constexpr std::uint32_t kSettledNs = 1'000;

  SlaveClock(std::uint16_t station, std::int64_t sync0_cycle_ns)
      : station_(station), sync0_cycle_ns_(static_cast<std::uint64_t>(sync0_cycle_ns)) {}

  /// What the chip's features say; without, nothing else is called.
  void found(bool present) noexcept TANDEM_RT { present_ = present; }
  /// Its slave begins again.
  void restart() noexcept TANDEM_RT {
    is_reference_ = false;
    difference_ns_ = 0;
  }
  /// Asks for a part of setting it: delay, offset, SYNC0; 0 is the first.
  void ask(int part, Exchange& exchange, std::size_t channel,
           const ClockReference& reference) const noexcept TANDEM_RT;
  /// Takes that part's answer. @return whether it was the last one
  bool take(int part, std::span<const std::uint8_t> data, std::int64_t now_ns,
            ClockReference& reference) noexcept TANDEM_RT;
  /// @param counts  for figures()
  void take_difference(std::span<const std::uint8_t> data, bool counts) noexcept TANDEM_RT;
  /// It is near the reference, and SYNC0 has begun.
  [[nodiscard]] bool settled(const ClockReference& reference) const noexcept TANDEM_RT;

  [[nodiscard]] bool present() const noexcept { return present_; }
  [[nodiscard]] std::uint32_t delay_ns() const noexcept { return delay_ns_; }
  /// By how much it was ahead of the reference when it was last asked.
  [[nodiscard]] std::int32_t difference_ns() const noexcept { return difference_ns_; }
  [[nodiscard]] const ClockFigures& figures() const noexcept { return figures_; }
  void archive(Archive& ar);

 private:
  std::uint16_t station_;
  std::uint64_t sync0_cycle_ns_;
  bool present_ = false;
  bool is_reference_ = false;
  bool behind_ = false;
  Latched reference_times_;
  std::uint32_t delay_ns_ = 0;
  std::uint64_t offset_ns_ = 0;
  std::uint64_t sync0_start_ns_ = 0;
  std::int32_t difference_ns_ = 0;
  ClockFigures figures_;
};

}  // namespace tandem::hal::ecat
