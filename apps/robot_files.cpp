#include "apps/robot_files.hpp"

#include "runtime/experiment.hpp"

namespace tandem::apps {
model::ModelSpec spec_of(const hal::RobotConfig& config) {
  model::ModelSpec spec;
  spec.robot = config.name;
  spec.urdf = config.model.urdf;
  spec.floating_base = config.model.floating_base;
  spec.mimic_independent = config.model.mimic_independent;
  spec.lock = config.model.lock;
  spec.gravity_m_s2 = config.model.gravity_m_s2;
  for (const hal::SiteConfig& site : config.model.sites) {
    spec.sites.push_back({site.name, site.link, site.xyz_m, site.rpy_rad, site.wrench});
  }
  for (const hal::SensorConfig& sensor : config.sensors) {
    if (sensor.type != hal::SensorType::kForceTorque) continue;
    spec.sensors.push_back({sensor.name, sensor.joint, sensor.link});
  }
  for (const hal::JointConfig& joint : config.joints) {
    const hal::ActuatorConfig& actuator = config.actuator_of(joint);
    if (actuator.order < 2) spec.armature.emplace_back(joint.name, actuator.inertia_kg_m2);
  }
  return spec;
}

std::expected<RobotFiles, Diagnostics> with_description(hal::RobotConfig config) {
  auto description = runtime::complete_robot(config);
  if (!description) return std::unexpected(description.error());
  model::ModelSpec spec = spec_of(config);
  return RobotFiles{std::move(config), std::move(description->tree), std::move(spec),
                    std::move(description->warnings)};
}

std::expected<RobotFiles, Diagnostics> read_robot(const std::string& file) {
  auto robot = runtime::read_robot(file);
  if (!robot) return std::unexpected(robot.error());
  return with_description(std::move(robot->config));
}

}  // namespace tandem::apps
