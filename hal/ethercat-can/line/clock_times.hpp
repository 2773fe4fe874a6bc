// What the master computes from the time stamps of one frame at two slaves.
// Layer: hal/ethercat-can/line.  Thread: any.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"

namespace tandem::hal::ecat {

/// Time stamps of one broadcast frame at a slave of a line, by its own clock.
struct Latched {
  std::uint32_t arrived = 0;   ///< at port 0 [ns, around]
  std::uint32_t returned = 0;  ///< at port 1
  bool behind = false;         ///< whether slaves are behind it; without, returned means nothing
  std::uint64_t local_ns = 0;  ///< its clock when the frame arrived

  /// How long the frame was behind this slave.
  [[nodiscard]] constexpr std::uint32_t behind_ns() const noexcept {
    return behind ? returned - arrived : 0;
  }
};

/// From the reference clock to the slave, one way: half of what the frame's way behind the
/// reference is longer than that behind the slave. @pre both are in one line, the reference first
[[nodiscard]] constexpr std::uint32_t delay_ns(const Latched& reference,
                                               const Latched& slave) noexcept TANDEM_RT {
  const std::uint32_t far = reference.behind_ns();
  const std::uint32_t near = slave.behind_ns();
  return far > near ? (far - near) / 2 : 0;  // jitter may turn it round
}

/// What makes the slave's clock show the reference's system time.
/// @param reference_offset  the reference's own offset [ns]
[[nodiscard]] constexpr std::uint64_t offset_ns(const Latched& reference,
                                                std::uint64_t reference_offset,
                                                const Latched& slave) noexcept TANDEM_RT {
  return reference.local_ns + reference_offset + delay_ns(reference, slave) - slave.local_ns;
}

/// When SYNC0 begins: a multiple of the cycle, at least `lead_ns` from now, the same for all slaves
/// that are asked within one cycle's grid.
[[nodiscard]] constexpr std::uint64_t sync0_start_ns(std::uint64_t now_ns, std::uint64_t lead_ns,
                                                     std::uint64_t cycle_ns) noexcept TANDEM_RT {
  return ((now_ns + lead_ns) / cycle_ns + 1) * cycle_ns;
}

}  // namespace tandem::hal::ecat
