// One homing of an axis, as CiA 402 has it: mode 6, bit 4, and what the drive answers.
// Layer: hal/ethercat-can.  Thread: the loop's.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"
#include "canopen/objects.hpp"
#include "hal/homing.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::can {

/// ```
/// kMode:   mode 6, bit 4 off       until the drive shows mode 6
/// kSeeks:  bit 4 on                until bits 10 and 12 (attained), bit 13 (error), or time is
/// over kEnds:   the same a little on, so that what the drive sends is of the new counts; or, after
/// a
///          failure, halt (bit 8) until it rests
/// kOver:   the axis' own mode again, where it stands
/// ```
class HomingSequence {
 public:
  enum class Step : std::uint8_t { kOver = 0, kMode, kSeeks, kEnds };

  /// What was found is no more, and a homing begins.
  void begin(std::int64_t now_ns, std::int64_t timeout_ns) noexcept TANDEM_RT;
  /// Halts it.
  void stop(std::int64_t now_ns) noexcept TANDEM_RT;
  /// The axis does something else now: a homing under way has failed.
  void interrupt() noexcept TANDEM_RT;
  /// Its drive has lost its power, or may have.
  void forget() noexcept TANDEM_RT;

  /// One cycle of it. @pre under_way()
  /// @param shows_mode  the drive is in mode 6, as far as it tells
  /// @return the controlword; mode 6 goes with it
  std::uint16_t step(std::uint16_t statusword, bool shows_mode,
                     std::int64_t now_ns) noexcept TANDEM_RT;

  [[nodiscard]] bool under_way() const noexcept { return step_ != Step::kOver; }
  [[nodiscard]] bool homed() const noexcept { return homed_; }
  [[nodiscard]] FaultCause error() const noexcept { return error_; }

  void archive(Archive& ar);

 private:
  void enter(Step step, std::int64_t now_ns) noexcept;
  void fail(FaultCause error, std::int64_t now_ns) noexcept;

  Step step_ = Step::kOver;
  FaultCause error_ = FaultCause::kNone;
  bool homed_ = false;
  std::uint32_t cycles_ = 0;     ///< of the step
  std::int64_t since_ns_ = 0;    ///< the step's begin
  std::int64_t begun_ns_ = 0;    ///< the homing's
  std::int64_t timeout_ns_ = 0;  ///< from there
};

}  // namespace tandem::hal::can
