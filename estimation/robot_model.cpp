#include "estimation/robot_model.hpp"

#include <algorithm>
#include <array>

#include "base/nearest.hpp"
#include "base/quoting.hpp"

namespace tandem::estimation {

int index_of(const char* const* names, std::size_t count, const std::string& name) {
  for (std::size_t i = 0; i < count; ++i)
    if (name == names[i]) return static_cast<int>(i);
  return -1;
}

Error passive_joint(const hal::Robot& robot) {
  return fail("the joint '" + robot.passive.front().name +
                  "' is passive: nothing measures its torque and position",
              "leave [estimation] out for a robot with [[passive]] joints")
      .error();
}

Result<ModelJoints> ModelJoints::make(const hal::Robot& robot, const tandem_kernels* kernels) {
  if (kernels == nullptr) {
    return fail("estimation needs the robot's generated model",
                "run `tandem model build " + shell_word(robot.file) + "`");
  }
  if (!robot.passive.empty()) return std::unexpected(passive_joint(robot));
  ModelJoints map;
  for (const hal::DrivenJoint& joint : robot.joints) {
    const int at = index_of(kernels->joint_names, kernels->joints, joint.name);
    if (at < 0) {
      return fail(
          "the model of " + std::string(kernels->robot) + " has no joint '" + joint.name + "'",
          suggest(joint.name, std::vector<std::string>(kernels->joint_names,
                                                       kernels->joint_names + kernels->joints)));
    }
    map.index_.push_back(static_cast<std::size_t>(at));
  }
  if (map.index_.size() != kernels->joints) {
    return fail("the model has joints that the robot does not drive",
                "give each a [[joint]] in " + robot.file + ", or lock it in [model.lock]");
  }
  return map;
}

int imu_site(const hal::Robot& robot, const hal::Sensor& imu, const tandem_kernels& kernels) {
  const std::array<double, 3> zero{};
  std::string name = imu.name;
  for (const hal::Site& site : robot.sites) {
    if (site.link != imu.link || site.xyz_m != zero || site.rpy_rad != zero) continue;
    name = site.name;
    break;
  }
  return index_of(kernels.site_names, kernels.sites, name);
}

}  // namespace tandem::estimation
