// Sensors that a description names.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "model/tree.hpp"

namespace tandem::scaffold {

/// A sensor without its place on a bus.
struct FoundSensor {
  hal::SensorConfig config;  ///< name, type, joint, link
  int body = 0;              ///< that it sits on
  std::string guess;         ///< what was assumed; empty: a <sensor> of the description
};

/// Force/torque sensors: <sensor> elements, and joints and links with "ft" or "force" in their
/// names, one for each wrench. IMUs: links with "imu" in their names, one for each body; a
/// floating base without any gets one at its root. Their names are such as topics may have.
/// @param description  its text, which model::parse_urdf() has accepted; may be empty
[[nodiscard]] std::vector<FoundSensor> find_sensors(const model::Tree& tree,
                                                    std::string_view description);

}  // namespace tandem::scaffold
