// Keeps the CPUs out of deep sleep while the loop runs.
// Layer: rt.  Thread: non-RT only.
#pragma once

namespace tandem::rt {

/// While one lives, the kernel lets no CPU into a sleep state that takes time to leave
/// (/dev/cpu_dma_latency at 0 us): what a wake-up costs otherwise is tens of microseconds.
class NoCpuSleep {
 public:
  NoCpuSleep();
  ~NoCpuSleep();
  NoCpuSleep(const NoCpuSleep&) = delete;
  NoCpuSleep& operator=(const NoCpuSleep&) = delete;

  /// False without the device or the right to write it.
  [[nodiscard]] bool granted() const { return file_ >= 0; }

 private:
  int file_ = -1;
};

}  // namespace tandem::rt
