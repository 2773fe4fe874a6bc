#include "runtime/estimation_options.hpp"

#include <algorithm>

#include "base/nearest.hpp"
#include "estimation/collision.hpp"
#include "estimation/site_wrenches.hpp"

namespace tandem::runtime {
namespace {

using estimation::BaseConfig;
using estimation::CollisionConfig;
using estimation::ObserverConfig;
using estimation::WrenchConfig;

BaseConfig read_base(TomlTable table) {
  BaseConfig base;
  base.imu = table.text_or("imu", {});
  const auto positive = [&](const char* key, double& value, double most) {
    value = table.number_or(key, value, {1e-9, most});
  };
  positive("gyro_noise_rad_s", base.gyro_noise_rad_s, 1.0);
  positive("accelerometer_noise_m_s2", base.accelerometer_noise_m_s2, 10.0);
  positive("gyro_drift_rad_s2", base.gyro_drift_rad_s2, 1.0);
  positive("accelerometer_drift_m_s3", base.accelerometer_drift_m_s3, 10.0);
  positive("gyro_bias_rad_s", base.gyro_bias_rad_s, 1.0);
  positive("accelerometer_bias_m_s2", base.accelerometer_bias_m_s2, 10.0);
  positive("foot_noise_m", base.foot_noise_m, 0.1);
  positive("foot_slip_m_s", base.foot_slip_m_s, 10.0);
  if (table.has("contact_force_N")) positive("contact_force_N", base.contact_force_N, 1e5);
  base.rest_s = table.number_or("rest_s", base.rest_s, {0.01, 60.0});
  table.finish();
  return base;
}

ObserverConfig read_observer(TomlTable table) {
  ObserverConfig observer;
  observer.bandwidth_Hz = table.number_or("bandwidth_Hz", observer.bandwidth_Hz, {0.1, 1000.0});
  table.finish();
  return observer;
}

CollisionConfig read_collision(TomlTable table, const hal::RobotConfig& robot) {
  CollisionConfig collision;
  const std::string reaction =
      table.choice_or("reaction", "warn", {"warn", "hold", "zero_torque", "retract"});
  if (reaction == "hold") collision.reaction = hal::StopCategory::kHold;
  if (reaction == "zero_torque") collision.reaction = hal::StopCategory::kCategory0;
  if (reaction == "retract") collision.reaction = hal::StopCategory::kCategory2;
  TomlTable limits = table.table("threshold_Nm");
  for (const hal::JointConfig& joint : robot.joints) {
    if (!limits.has(joint.name)) continue;
    collision.thresholds.push_back({joint.name, limits.number(joint.name, {1e-3, 1e5})});
  }
  std::vector<std::string> joints;
  for (const hal::JointConfig& joint : robot.joints) joints.push_back(joint.name);
  joints.insert(joints.end(), estimation::kBaseChannels.begin(), estimation::kBaseChannels.end());
  (void)limits.holds_only(joints);
  for (const char* channel : estimation::kBaseChannels) {
    if (robot.joint_index(channel) >= 0 || !limits.has(channel)) continue;
    const double limit = limits.number(channel, {1e-3, 1e5});
    if (robot.model.floating_base) {
      collision.thresholds.push_back({channel, limit});
    } else {
      limits.error(channel, "the base does not float: nothing is felt there",
                   "remove it; a joint's threshold has the joint's name");
    }
  }
  if (table.has("threshold_Nm") && collision.thresholds.empty()) {
    table.error("threshold_Nm", "no joint has a threshold, so nothing is watched",
                "take what `tandem log thresholds` prints of free motion");
  }
  table.finish();
  return collision;
}

std::vector<WrenchConfig> read_wrenches(TomlTable& parent, const hal::RobotConfig& robot) {
  std::vector<std::string> sites;
  for (const hal::SiteConfig& site : robot.model.sites) sites.push_back(site.name);
  std::vector<WrenchConfig> wrenches;
  for (TomlTable& table : parent.tables("wrench")) {
    WrenchConfig wrench{.site = table.text("site")};
    if (!wrench.site.empty() && std::ranges::find(sites, wrench.site) == sites.end()) {
      table.error("site", "the robot has no site '" + wrench.site + "'",
                  sites.empty() ? "declare the place as a [[site]] in " + robot.file
                                : suggest(wrench.site, sites));
    }
    if (std::ranges::find(wrenches, wrench.site, &WrenchConfig::site) != wrenches.end())
      table.error("site", "the site '" + wrench.site + "' is there twice", "leave one out");
    table.finish();
    wrenches.push_back(std::move(wrench));
  }
  if (wrenches.size() > estimation::kMostWrenches) {
    parent.error("wrench",
                 "wrenches at more than " + std::to_string(estimation::kMostWrenches) + " sites",
                 "leave out those that nothing touches");
  }
  return wrenches;
}

}  // namespace

estimation::EstimationConfig read_estimation(TomlTable table, const hal::RobotConfig& robot) {
  estimation::EstimationConfig config;
  if (table.has("base")) config.base = read_base(table.table("base"));
  if (table.has("observer")) config.observer = read_observer(table.table("observer"));
  if (table.has("collision")) config.collision = read_collision(table.table("collision"), robot);
  if (table.has("wrench")) config.wrenches = read_wrenches(table, robot);
  table.finish();
  return config;
}

}  // namespace tandem::runtime
