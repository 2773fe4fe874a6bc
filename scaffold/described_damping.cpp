#include "scaffold/described_damping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/counted.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kMostShare = 0.5;  // of the effort, at the largest speed

class Damper {
 public:
  explicit Damper(NewRobot& robot) : robot_(robot) {}

  void run() {
    std::erase_if(robot_.warnings, [](const Error& one) { return one.key == "dynamics"; });
    std::vector<DriveSize> drives;
    for (const DriveSize& drive : robot_.drives) split(drive, drives);
    robot_.drives = std::move(drives);
    warn("damping", too_much_, "it would take more than half of the effort at full speed",
         "check its unit, Nms/rad; or set damping_Nms_rad of [actuator.NAME]");
    warn("friction", friction_, "robot.toml has no key for it", {});
    robot_.remarks.push_back("Drives have the damping of the description's <dynamics>.");
  }

 private:
  void split(const DriveSize& drive, std::vector<DriveSize>& drives) {
    std::map<double, std::vector<int>> groups;  // damping -> joints
    for (const int j : drive.joints) groups[usable(j)].push_back(j);
    std::size_t number = 0;
    for (auto& [damping, joints] : groups) {
      DriveSize own = drive;
      own.joints = std::move(joints);
      own.actuator.damping_Nms_rad = rounded(own.actuator.damping_Nms_rad + damping, 4);
      if (groups.size() > 1) own.actuator.name += fmt::format("_d{}", ++number);
      if (damping > 0.0)
        own.remark += fmt::format(", {:.3g} of its damping the description's", damping);
      drives.push_back(std::move(own));
    }
  }

  double usable(int j) {
    const model::Joint& joint = robot_.tree.joints[static_cast<std::size_t>(j)];
    const JointLimits& limit = robot_.limits[static_cast<std::size_t>(j)];
    const auto own = robot_.extras.find(joint.name);
    if (own == robot_.extras.end()) return 0.0;
    if (own->second.friction != 0.0) friction_.push_back(joint.name);
    const double damping = rounded(std::max(own->second.damping, 0.0));
    if (damping * limit.velocity <= kMostShare * limit.effort) return damping;
    too_much_.push_back(joint.name);
    return 0.0;
  }

  void warn(const std::string& what, const std::vector<std::string>& joints, const std::string& why,
            const std::string& hint) {
    if (joints.empty()) return;
    robot_.warnings.push_back({fmt::format("the {} of {} (<dynamics>) is not used: {}", what,
                                           counted(joints.size(), "joint"), why),
                               hint, robot_.tree.file, 0, "joint " + joints[0]});
  }

  NewRobot& robot_;
  std::vector<std::string> too_much_, friction_;
};

}  // namespace

void add_described_damping(NewRobot& robot) { Damper(robot).run(); }

}  // namespace tandem::scaffold
