// What a frame goes through when no wire is between master and slaves.
// Layer: ethercat.  Thread: the loop's.
#pragma once

#include <cstdint>
#include <span>

#include "base/realtime.hpp"

namespace tandem::ethercat {

/// A line of slaves that a frame enters at one end and leaves at the same end.
class Medium {
 public:
  virtual ~Medium() = default;
  /// Passes the frame through all slaves, changed in place.
  /// @return false when it does not come back
  virtual bool pass(std::span<std::uint8_t> frame, std::int64_t now_ns) noexcept TANDEM_RT = 0;
};

}  // namespace tandem::ethercat
