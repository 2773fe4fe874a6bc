// What a URDF says beside links and joints: its sensors.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tandem::scaffold {

/// One <sensor>, as some simulators write it outside <gazebo>.
struct SensorElement {
  std::string name;
  std::string type;
  std::string parent;  ///< a joint or a link
};

struct Outfit {
  std::vector<SensorElement> sensors;
};

/// Reads a description that model::parse_urdf() has accepted. What cannot be understood here is
/// left out: it is only ever the ground of a guess.
[[nodiscard]] Outfit read_outfit(std::string_view text);

}  // namespace tandem::scaffold
