// Sleeps until frames come, on one or several buses, and knows the time.
// Layer: hal/ethercat-can.  Thread: the loop's, or the emulator's.
#pragma once

#include <cstdint>

namespace tandem::hal::can {

class FrameWait {
 public:
  virtual ~FrameWait() = default;

  /// Monotonic [ns].
  [[nodiscard]] virtual std::int64_t now_ns() noexcept = 0;
  /// Blocks until a frame is there on bus `bus`, or on any (kAnyBus), the time is over, or the
  /// process was asked to stop; may return early without a reason. No allocation.
  virtual void wait(std::int64_t at_most_ns, int bus) noexcept = 0;
  static constexpr int kAnyBus = -1;
  /// True once the process was asked to stop: nobody should wait any longer.
  [[nodiscard]] virtual bool stopping() const noexcept { return false; }
};

}  // namespace tandem::hal::can
