// Leads a site by the model of the run's robot.
// Layer: apps/run.  Thread: main; what it gives is called on the serving thread.
#pragma once

#include "apps/control/joint_group.hpp"
#include "robot/site_step.hpp"

namespace tandem::apps {

/// For add_group_commands(). Robot and kernels outlive it.
[[nodiscard]] inline LeadSite lead_site(const hal::RobotConfig& robot,
                                        const tandem_kernels* kernels) {
  return [&robot, kernels](const std::string& site, std::size_t axis, bool own, double by,
                           const std::vector<double>& position_rad) -> Result<LedJoints> {
    auto step = robot::site_step(robot, kernels, {site, axis, own, by}, position_rad);
    if (!step) return std::unexpected(step.error());
    return LedJoints{std::move(step->joints), std::move(step->target_rad)};
  };
}

}  // namespace tandem::apps
