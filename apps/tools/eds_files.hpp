// The electronic data sheets of a robot's nodes: one per type of board and of sensor.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::apps {

/// One type of node.
struct EdsFile {
  std::string name;                ///< "board_2_axes_fd.eds"
  std::vector<std::string> nodes;  ///< boards or sensors of this type
  std::size_t objects = 0;         ///< sub-indices
  std::string text;
};

/// From the firmware's own object dictionary, with its values after power-on as defaults. Nodes
/// whose sheets are equal are of one type. A drive of another make has a sheet already: it is left
/// out.
/// Errors: those of make_pdo_layout().
[[nodiscard]] Result<std::vector<EdsFile>> make_eds_files(const hal::RobotConfig& robot);

}  // namespace tandem::apps
