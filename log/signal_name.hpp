// What one number of a logged image is called.
// Layer: log.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "hal/image.hpp"
#include "log/info.hpp"

namespace tandem::log {

/// "position_rad.LHipSag", "sensor.left_foot.fz_N", "cycle".
[[nodiscard]] std::string signal_name(const hal::Field& field, std::size_t index,
                                      const RunInfo& info);

/// What tells the field's elements apart: "joints", "sensors", "channels"; empty: their number, or
/// there is one element only.
[[nodiscard]] std::string_view named_by(const hal::Field& field, const RunInfo& info);
/// The part of signal_name() after the field's name: "LHipSag", "left_foot.fz_N".
/// @pre !named_by(field, info).empty()
[[nodiscard]] std::string element_name(const hal::Field& field, std::size_t index,
                                       const RunInfo& info);

}  // namespace tandem::log
