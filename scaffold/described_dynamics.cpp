// Damping and friction of the description's joints, put into their drives.
#include "scaffold/steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/counted.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kMostShare = 0.5;  // of the effort

class Damper {
 public:
  explicit Damper(NewRobot& robot) : robot_(robot) {}

  void run() {
    std::erase_if(robot_.warnings, [](const Error& one) { return one.key == "dynamics"; });
    std::vector<DriveSize> drives;
    for (const DriveSize& drive : robot_.drives) split(drive, drives);
    robot_.drives = std::move(drives);
    warn("damping", too_much_damping_, "half of the effort at full speed", "Nms/rad",
         "damping_Nms_rad");
    warn("friction", too_much_friction_, "half of the effort", "Nm", "friction_Nm");
    robot_.remarks.push_back(
        "Drives have the damping and friction of the description's <dynamics>.");
  }

 private:
  using Losses = std::pair<double, double>;  // damping, friction

  void split(const DriveSize& drive, std::vector<DriveSize>& drives) {
    std::map<Losses, std::vector<int>> groups;
    for (const int j : drive.joints) groups[usable(j)].push_back(j);
    std::size_t number = 0;
    for (auto& [losses, joints] : groups) {
      const auto [damping, friction] = losses;
      DriveSize own = drive;
      own.joints = std::move(joints);
      own.actuator.damping_Nms_rad = rounded(own.actuator.damping_Nms_rad + damping, 4);
      own.actuator.friction_Nm = friction;
      if (groups.size() > 1) own.actuator.name += fmt::format("_d{}", ++number);
      if (damping > 0.0)
        own.remark += fmt::format(", {:.3g} of its damping the description's", damping);
      if (friction > 0.0) own.remark += ", its friction the description's";
      drives.push_back(std::move(own));
    }
  }

  Losses usable(int j) {
    const model::Joint& joint = robot_.tree.joints[static_cast<std::size_t>(j)];
    const JointLimits& limit = robot_.limits[static_cast<std::size_t>(j)];
    const auto own = robot_.extras.find(joint.name);
    if (own == robot_.extras.end()) return {};
    const auto within = [&](double value, double most, std::vector<std::string>& too_much) {
      const double positive = rounded(std::max(value, 0.0));
      if (positive <= most) return positive;
      too_much.push_back(joint.name);
      return 0.0;
    };
    const double most_Nm = kMostShare * limit.effort;
    return {within(own->second.damping, most_Nm / limit.velocity, too_much_damping_),
            within(own->second.friction, most_Nm, too_much_friction_)};
  }

  void warn(const char* what, const std::vector<std::string>& joints, const char* more_than,
            const char* unit, const char* key) {
    if (joints.empty()) return;
    robot_.warnings.push_back(
        {fmt::format("the {} of {} (<dynamics>) is not used: it would take more than {}", what,
                     counted(joints.size(), "joint"), more_than),
         fmt::format("check its unit, {}; or set {} of [actuator.NAME]", unit, key),
         robot_.tree.file, 0, "joint " + joints[0]});
  }

  NewRobot& robot_;
  std::vector<std::string> too_much_damping_, too_much_friction_;
};

}  // namespace

void add_described_dynamics(NewRobot& robot) { Damper(robot).run(); }

}  // namespace tandem::scaffold
