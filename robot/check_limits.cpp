// Limits of a description that its robot.toml goes beyond.
#include <cmath>
#include <vector>

#include "base/counted.hpp"
#include "model/urdf_extras.hpp"
#include "robot/check_rows.hpp"

namespace tandem::robot {
namespace {

constexpr double kRounding = 1e-5;  // of a limit: robot.toml has six digits

bool above(double value, double limit) { return value > limit + kRounding * std::abs(limit); }

void warn(const std::string& what, const std::vector<std::string>& joints, const std::string& keys,
          const model::Tree& tree, Diagnostics& warnings) {
  if (joints.empty()) return;
  const model::Joint& first =
      tree.joints[static_cast<std::size_t>(tree.joint_index(joints.front()))];
  warnings.push_back({what + " of " + counted(joints.size(), "joint") + " is not used",
                      "give " + keys + " in [[joint]] to have it", tree.file, first.line,
                      "joint " + first.name});
}

}  // namespace

void check_unused_limits(const CheckedRobot& s, Findings& findings) {
  const hal::RobotConfig& robot = s.robot.config;
  const model::Tree& tree = s.robot.tree;
  const auto extras = model::joint_extras(text_in(s.robot.files, robot.model.urdf));
  std::vector<std::string> soft, rates;
  for (const hal::JointConfig& joint : robot.joints) {
    const auto own = extras.find(joint.name);
    if (own == extras.end() || tree.joint_index(joint.name) < 0) continue;
    const model::JointExtras& described = own->second;
    // What the description does not give is NaN, which nothing is above.
    if (above(joint.max_position_rad, described.soft_upper) ||
        above(-joint.min_position_rad, -described.soft_lower)) {
      soft.push_back(joint.name);
    }
    if (above(joint.max_acceleration_rad_s2, described.acceleration) ||
        above(joint.max_jerk_rad_s3, described.jerk)) {
      rates.push_back(joint.name);
    }
  }
  warn("the soft limit (<safety_controller>)", soft, "min_position_rad and max_position_rad", tree,
       findings.warnings);
  warn("the acceleration or jerk of <limit>", rates, "max_acceleration_rad_s2 and max_jerk_rad_s3",
       tree, findings.warnings);
}

}  // namespace tandem::robot
