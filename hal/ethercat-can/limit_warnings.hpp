// Limits of a drive's sheet (LowLimit, HighLimit) that speak against what the master sends it.
// Layer: hal/ethercat-can.  Thread: non-RT.
#pragma once

#include "base/result.hpp"
#include "canopen/data_sheet.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::hal::can {

/// An object that the master sends whose LowLimit is more than its HighLimit; a 6060 that does not
/// take a mode which the drive is used in. Each with the sheet's file and line.
/// @param node  the plan of a board with this sheet
[[nodiscard]] Diagnostics limit_warnings(const NodePlan& node, const canopen::DataSheet& sheet);

}  // namespace tandem::hal::can
