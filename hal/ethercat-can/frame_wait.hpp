// Sleeps until frames come, on one or several buses, and knows the time that the deadline is in.
// Layer: hal/ethercat-can.  Thread: the loop's, or the emulator's.
#pragma once

#include <cstdint>

namespace tandem::hal::can {

class FrameWait {
 public:
  virtual ~FrameWait() = default;

  /// Monotonic [ns].
  [[nodiscard]] virtual std::int64_t now_ns() noexcept = 0;
  /// Blocks until a frame is there, the deadline has passed, or the process was asked to stop; may
  /// return early without a reason. No allocation.
  virtual void wait(std::int64_t deadline_ns) noexcept = 0;
  /// True once the process was asked to stop: nobody should wait any longer.
  [[nodiscard]] virtual bool stopping() const noexcept { return false; }
};

}  // namespace tandem::hal::can
