#include "apps/control/sensor_control.hpp"

#include <span>

namespace tandem::apps {
namespace {

/// `count` of a sensor's channels from `first` on; null of one that was never heard, whose age is
/// more than the run's.
Json channels(const runtime::SensorReport& sensor, std::size_t first, std::size_t count) {
  if (sensor.look.age_cycles > sensor.look.cycle) {
    return std::vector<Json>(count);  // a client prints them one by one
  }
  return std::span(sensor.look.values).subspan(first, count);
}

Json sensor_json(const runtime::SensorReport& sensor) {
  const bool imu = sensor.type == hal::SensorType::kImu;
  Json json{{"sensor", sensor.name},
            {"type", imu ? "imu" : "force_torque"},
            {"joint", sensor.joint},
            {"link", sensor.link},
            {"age_cycles", sensor.look.age_cycles},
            {"valid", sensor.look.valid != 0}};
  if (imu) {
    json["orientation_xyzw"] = channels(sensor, 0, 4);
    json["angular_velocity_rad_s"] = channels(sensor, 4, 3);
    json["specific_force_m_s2"] = channels(sensor, 7, 3);
  } else {
    json["force_N"] = channels(sensor, 0, 3);
    json["torque_Nm"] = channels(sensor, 3, 3);
  }
  return json;
}

Json list(const runtime::RunServices& services) {
  Json all = Json::array();
  std::uint64_t cycle = 0;
  for (const runtime::SensorReport& sensor : services.sensors()) {
    cycle = sensor.look.cycle;
    all.push_back(sensor_json(sensor));
  }
  return {{"cycle", cycle}, {"sensors", std::move(all)}};
}

}  // namespace

void add_sensor_commands(ControlRegistry& registry, const runtime::RunServices& services) {
  registry.add("sensor.list", [&services](const Json&) -> Result<Json> { return list(services); });
}

}  // namespace tandem::apps
