// What a running run can be asked for of several joints at once: a posture, a step of a site.
// Layer: apps/control.  Thread: main; the handlers run on the serving thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/control/control_registry.hpp"
#include "hal/config/robot_config.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// Joints that are to arrive together.
struct LedJoints {
  std::vector<std::size_t> joints;  ///< of the robot
  std::vector<double> target_rad;   ///< of each [rad, of a slide m]
};
/// Where joints are to go so that a site goes a step.
/// @param site  its name; @param axis  0 to 5: along x, y, z, about x, y, z
/// @param own  axes of the site; else of the base; @param by  [m, or rad]
/// @param position_rad  of every joint, as commanded
/// Errors: no such site; no joint leads it so, with a reason; a joint would be beyond its limits.
using LeadSite =
    std::function<Result<LedJoints>(const std::string& site, std::size_t axis, bool own, double by,
                                    const std::vector<double>& position_rad)>;

/// Adds "joint.posture", "joint.tuning" and, with `lead`, "site.move". Cycle and robot outlive the
/// registry.
void add_group_commands(ControlRegistry& registry, runtime::RobotCycle& cycle,
                        const hal::RobotConfig& robot, LeadSite lead = {});

}  // namespace tandem::apps
