// What the master does with a drive's sheet, and what it misses in it, in words.
// Layer: hal/ethercat-can.  Thread: non-RT.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "canopen/data_sheet.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::hal::can {

/// One fact about a drive's use: "position" and "mode 8 (CSP), target 607A".
struct DriveFact {
  std::string what;
  std::string how;
};

struct DriveUse {
  std::vector<DriveFact> does;
  std::vector<std::string> misses;  ///< a sentence each
};

/// @param node  the plan of a board with this sheet
[[nodiscard]] DriveUse use_of(const NodePlan& node, const canopen::DataSheet& sheet);

/// The same of a sheet alone: one axis, node 1, classic CAN.
/// Error: the master cannot drive it, and why.
[[nodiscard]] Result<DriveUse> use_of(const canopen::DataSheet& sheet);

/// How the drives of other makes stop, hold and are homed, and what `stop_options` change on our
/// own boards: joints, and what their drive does.
[[nodiscard]] std::vector<DriveFact> drive_facts(const RobotConfig& robot);

/// What keeps the master from using a drive as its file means it, whether it can drive it or not.
[[nodiscard]] Diagnostics sheet_warnings(const RobotConfig& robot);

/// What the drives of other makes miss that their joints' safety rests on, each with its board;
/// scale_warnings() and limit_warnings().
/// Errors: those of make_pdo_layout().
[[nodiscard]] Result<Diagnostics> drive_warnings(const RobotConfig& robot);

}  // namespace tandem::hal::can
