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

// A key a line.
// clang-format off
constexpr Key<BaseConfig> kBase[] = {
  key<&BaseConfig::imu>("imu", "name of the sensor").by_default("the only one"),
  key<&BaseConfig::gyro_noise_rad_s>("gyro_noise_rad_s", {1e-9, 1.0}, "of the IMU"),
  key<&BaseConfig::accelerometer_noise_m_s2>("accelerometer_noise_m_s2", {1e-9, 10.0}, "of the IMU"),
  key<&BaseConfig::gyro_drift_rad_s2>("gyro_drift_rad_s2", {1e-9, 1.0}, "random walk of the bias, per root of a second"),
  key<&BaseConfig::accelerometer_drift_m_s3>("accelerometer_drift_m_s3", {1e-9, 10.0}, "random walk of the bias, per root of a second"),
  key<&BaseConfig::gyro_bias_rad_s>("gyro_bias_rad_s", {1e-9, 1.0}, "deviation of the bias at the start"),
  key<&BaseConfig::accelerometer_bias_m_s2>("accelerometer_bias_m_s2", {1e-9, 10.0}, "deviation of the bias at the start"),
  key<&BaseConfig::foot_noise_m>("foot_noise_m", {1e-9, 0.1}, "of a foot's place as the encoders give it"),
  key<&BaseConfig::foot_slip_m_s>("foot_slip_m_s", {1e-9, 10.0}, "random walk of a standing foot, per root of a second"),
  key<&BaseConfig::contact_force_N>("contact_force_N", {1e-9, 1e5}, "vertical force at which a foot stands as likely as not").by_default("a tenth of the weight"),
  key<&BaseConfig::rest_s>("rest_s", {0.01, 60.0}, "the estimate starts after so long at rest on its feet"),
};
constexpr Key<ObserverConfig> kObserver[] = {
  key<&ObserverConfig::bandwidth_Hz>("bandwidth_Hz", {0.1, 1000.0}, "of the external torques: a low pass of second order, −3 dB there"),
};
// clang-format on

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
  const auto whole = [&](const char* key, const auto& keys, auto& part) {
    if (table.has(key)) read_whole(table.table(key), keys, part.emplace());
  };
  whole("base", kBase, config.base);
  whole("observer", kObserver, config.observer);
  if (table.has("collision")) config.collision = read_collision(table.table("collision"), robot);
  if (table.has("wrench")) config.wrenches = read_wrenches(table, robot);
  table.finish();
  return config;
}

void describe_estimation(KeyPage& page) {
  page.add("`[estimation.base]`", kBase);
  page.add("`[estimation.observer]`", kObserver);
}

}  // namespace tandem::runtime
