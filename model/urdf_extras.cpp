#include "model/urdf_extras.hpp"

#include <cmath>

#include "model/urdf_outline.hpp"

namespace tandem::model {

std::map<std::string, JointExtras> joint_extras(std::string_view text) {
  std::map<std::string, JointExtras> all;
  const std::string file;
  for (const OutlineJoint& joint : outline_urdf(text, file, {}).joints) {
    const JointExtras& extras = joint.extras;
    const bool any = !std::isnan(extras.soft_lower) || !std::isnan(extras.soft_upper) ||
                     !std::isnan(extras.acceleration) || !std::isnan(extras.jerk) ||
                     extras.damping != 0.0 || extras.friction != 0.0 || extras.no_effort;
    if (any) all.emplace(joint.name, extras);
  }
  return all;
}

}  // namespace tandem::model
