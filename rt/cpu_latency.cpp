// Holds /dev/cpu_dma_latency open at 0 us: the kernel drops the request when the file closes.
#include "rt/cpu_latency.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdint>

namespace tandem::rt {

NoCpuSleep::NoCpuSleep() : file_(open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC)) {
  const std::int32_t most_us = 0;
  if (file_ < 0 || write(file_, &most_us, sizeof most_us) == sizeof most_us) return;
  close(file_);
  file_ = -1;
}

NoCpuSleep::~NoCpuSleep() {
  if (file_ >= 0) close(file_);
}

}  // namespace tandem::rt
