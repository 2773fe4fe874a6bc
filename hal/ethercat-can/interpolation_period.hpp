// The interpolation period (60C2) of a drive: a cycle as a mantissa and a power of ten.
// Layer: hal/ethercat-can.  Thread: any.
#pragma once

#include <cstdint>
#include <optional>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "canopen/data_sheet.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::hal::can {

/// 60C2:1 units of 10^60C2:2 s.
struct InterpolationPeriod {
  std::uint8_t units = 0;
  std::int8_t power = 0;
};

/// What an axis' 60C2 takes, both ends included.
struct InterpolationLimits {
  std::uint8_t least_units = 1;
  std::uint8_t most_units = 255;
  std::int8_t least_power = -128;
  std::int8_t most_power = 63;

  /// Those of 60C2 in the sheet, where it has any. @param axis  from 0
  [[nodiscard]] static InterpolationLimits of(const canopen::DataSheet& sheet, int axis);
};

/// The period as 60C2 says it: in milliseconds where that is possible, which drives know best, else
/// in the nearest smaller unit, else in a larger one. None: 60C2 cannot say it.
[[nodiscard]] std::optional<InterpolationPeriod> interpolation_period(
    std::int64_t period_ns, const InterpolationLimits& limits) noexcept TANDEM_RT;

/// Whether every drive of another make takes the cycle: for each sheet whose 60C2 does not, an
/// error with the board and the nearest periods that every drive takes, which fit the boards'
/// control periods where there are such.
[[nodiscard]] Diagnostics check_interpolation(const RobotConfig& robot, std::int64_t period_ns);

}  // namespace tandem::hal::can
