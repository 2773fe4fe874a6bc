// What a URDF says beside its kinematics and masses: collision shapes, sensors.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "model/tree.hpp"

namespace tandem::scaffold {

/// One <collision>, in its link's frame.
struct Shape {
  enum class Kind : std::uint8_t { kBox, kSphere, kCylinder, kMesh } kind = Kind::kMesh;
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();  ///< box: edges; sphere: radius in x;
                                                     ///< cylinder: radius in x, length in z
  model::Placement in_link;
};

/// One <sensor>, as some simulators write it outside <gazebo>.
struct SensorElement {
  std::string name;
  std::string type;
  std::string parent;  ///< a joint or a link
};

struct Outfit {
  std::map<std::string, std::vector<Shape>> shapes;  ///< by link
  std::vector<SensorElement> sensors;
};

/// Reads a description that model::parse_urdf() has accepted. What cannot be understood here is
/// left out: it is only ever the ground of a guess.
[[nodiscard]] Outfit read_outfit(std::string_view text);

}  // namespace tandem::scaffold
