// What the loop told its robot in each cycle, for a second robot that gets the same.
// Layer: internal_model.  Thread: made non-RT; the loop writes, one other thread reads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "base/spsc_ring.hpp"
#include "hal/backend.hpp"
#include "hal/image.hpp"

namespace tandem::internal_model {

/// A call of the loop's beside read() and write().
struct BackendCall {
  enum class What : std::uint8_t { kStop, kReset, kHome, kStopHoming };
  What what = What::kStop;
  hal::StopCategory category = hal::StopCategory::kWarn;  ///< of kStop
  std::uint16_t joint = 0;                                ///< of kHome, kStopHoming

  bool operator==(const BackendCall&) const = default;
};

/// One cycle: every call that the loop made, and what the first robot answered.
struct CommandRecord {
  static constexpr std::size_t kMostCalls = 8;

  CommandRecord(const hal::ImageShape& shape, const hal::ParameterImage& gains_in)
      : state(shape), command(shape), gains(gains_in) {}

  /// Adds a call, unless it repeats the last one. Beyond kMostCalls they are left out: a stop that
  /// follows so many is no harder.
  void add(const BackendCall& call) noexcept TANDEM_RT {
    if (calls_made > 0 && calls[calls_made - 1] == call) return;
    if (calls_made < kMostCalls) calls[calls_made++] = call;
  }

  std::uint64_t number = 0;  ///< of all cycles, those without a place included
  hal::CycleTime time;
  hal::Phase phase = hal::Phase::kBringUp;  ///< of the first robot after read()
  bool written = false;                     ///< write(command, gains) was called
  bool shut_down = false;                   ///< shut_down() was called instead
  bool again = false;                       ///< it has been, and is played again: nothing is logged
  bool new_gains = true;                    ///< `gains` are not those of the record before
  std::size_t calls_made = 0;
  std::size_t calls_before = 0;  ///< of them: made before read(), after the last cycle's write()
  std::array<BackendCall, kMostCalls> calls{};
  hal::StateImage state;         ///< of the first robot
  std::array<double, 7> base{};  ///< its base by its truth: position [m], quaternion x y z w
  hal::CommandImage command;
  hal::ParameterImage gains;
};

/// A wait-free ring of records whose memory is allocated and touched once.
class CommandTape {
 public:
  /// @param records  rounded up to a power of two
  CommandTape(const hal::ImageShape& shape, const hal::ParameterImage& gains, std::size_t records)
      : order_(sizeof(std::uint64_t), records),
        records_(order_.capacity(), CommandRecord(shape, gains)) {}

  /// The loop's: the next record, to be filled; null, and counted, when none is free.
  [[nodiscard]] CommandRecord* begin_push() noexcept TANDEM_RT {
    return order_.begin_push().empty() ? nullptr : &records_[pushed_ % records_.size()];
  }
  /// The loop's: the record is whole.
  void end_push() noexcept TANDEM_RT {
    ++pushed_;
    order_.end_push();
  }
  /// The reader's: the oldest record, until pop(); null when there is none.
  [[nodiscard]] const CommandRecord* front() const noexcept {
    return order_.front().empty() ? nullptr : &records_[popped_ % records_.size()];
  }
  void pop() noexcept {
    ++popped_;
    order_.pop();
  }
  /// Records that wait: exact for the reader, a bound for the loop.
  [[nodiscard]] std::size_t size() const noexcept { return order_.size(); }
  [[nodiscard]] std::size_t capacity() const noexcept { return records_.size(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return order_.dropped(); }

 private:
  SpscRing order_;  // hands over whose turn it is; the records have types of their own
  std::vector<CommandRecord> records_;
  std::uint64_t pushed_ = 0;  // the loop's
  std::uint64_t popped_ = 0;  // the reader's
};

}  // namespace tandem::internal_model
