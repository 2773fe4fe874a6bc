// Keys that several bundled controllers read alike.
#include "controllers/parameters.hpp"

#include <algorithm>

#include "base/nearest.hpp"

namespace tandem {

std::vector<std::string> joint_names(const hal::Robot& robot) {
  std::vector<std::string> names;
  for (const hal::DrivenJoint& joint : robot.joints) names.push_back(joint.name);
  return names;
}

std::vector<std::size_t> joints_parameter(ControllerSetup& setup) {
  const std::vector<std::string> known = joint_names(setup.robot);
  std::vector<std::size_t> joints;
  for (const std::string& name : setup.parameters.texts_or("joints", known)) {
    const int index = setup.robot.joint_index(name);
    if (index < 0) {
      const Error none = setup.robot.no_joint(name);
      setup.parameters.error("joints", none.message, none.hint);
    } else if (std::ranges::find(joints, static_cast<std::size_t>(index)) != joints.end()) {
      setup.parameters.error("joints", "joint '" + name + "' stands twice", "name it once");
    } else {
      joints.push_back(static_cast<std::size_t>(index));
    }
  }
  return joints;
}

Parameter link_damping_parameter(ControllerSetup& setup) {
  return setup.parameter("link_damping_Nms_rad",
                         {.unit = "Nms/rad",
                          .min = 0,
                          .otherwise = 0,
                          .live = true,
                          .doc = "damps the links' swing on their springs"});
}

Parameter stop_at_end_parameter(ControllerSetup& setup) {
  return setup.parameter(
      "stop_at_end",
      {.otherwise = false, .live = true, .doc = "done at its end; else it stays there"});
}

const hal::Posture* posture_parameter(ControllerSetup& setup) {
  const std::string name = setup.parameters.text_or("posture", "");
  if (name.empty()) return nullptr;
  const hal::Posture* posture = setup.robot.posture(name);
  if (posture == nullptr) {
    std::vector<std::string> known;
    for (const hal::Posture& one : setup.robot.postures) known.push_back(one.name);
    setup.parameters.error(
        "posture", "the robot has no posture '" + name + "'",
        known.empty() ? "add [posture." + name + "] to " + setup.robot.file : suggest(name, known));
  }
  return posture;
}

}  // namespace tandem
