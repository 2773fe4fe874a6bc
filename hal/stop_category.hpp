// How a robot is stopped: the categories of IEC 60204-1, and two that stop less.
// Layer: hal.  Thread: any.
#pragma once

#include <cstdint>

namespace tandem::hal {

/// The lower, the harder: of two that are asked for, the lower one is carried out.
enum class StopCategory : std::uint8_t {
  kCategory0 = 0,  ///< the torque is taken away at once
  kCategory1 = 1,  ///< every axis is brought to rest, then its torque is taken away
  kHold = 2,       ///< every axis stays under control where it is
  kWarn = 3,       ///< nothing is stopped: it is told
};

/// As the TOML has it: "category0".
[[nodiscard]] constexpr const char* to_string(StopCategory category) noexcept {
  switch (category) {
    case StopCategory::kCategory0: return "category0";
    case StopCategory::kCategory1: return "category1";
    case StopCategory::kHold: return "hold";
    case StopCategory::kWarn: return "warn";
  }
  return "?";
}

}  // namespace tandem::hal
