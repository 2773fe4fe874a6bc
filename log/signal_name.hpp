// What one number of a logged image is called.
// Layer: log.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <string>

#include "hal/image.hpp"
#include "log/info.hpp"

namespace tandem::log {

/// "position_rad.LHipSag", "sensor.left_foot.2", "cycle".
[[nodiscard]] std::string signal_name(const hal::Field& field, std::size_t index,
                                      const RunInfo& info);

}  // namespace tandem::log
