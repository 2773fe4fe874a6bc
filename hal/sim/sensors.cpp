// Force/torque from the kernels' sensor wrenches, IMU from the site's pose, twist and acceleration
// less gravity.
#include "hal/sim/sensors.hpp"

#include <algorithm>
#include <array>

#include "base/nearest.hpp"
#include "hal/sim/rotation.hpp"

namespace tandem::sim {
namespace {

bool is_link_frame(const hal::SiteConfig& site, const std::string& link) {
  const std::array<double, 3> zero{};
  return site.link == link && site.xyz_m == zero && site.rpy_rad == zero;
}

}  // namespace

std::string imu_site(const hal::RobotConfig& robot, const hal::SensorConfig& sensor) {
  for (const hal::SiteConfig& site : robot.model.sites) {
    if (is_link_frame(site, sensor.link)) return site.name;
  }
  return sensor.name;
}

Result<Sensors> Sensors::create(const hal::RobotConfig& robot, const tandem_kernels& kernels) {
  const std::vector<std::string> sites(kernels.site_names, kernels.site_names + kernels.sites);
  const std::vector<std::string> wrenches(kernels.sensor_names,
                                          kernels.sensor_names + kernels.sensors);
  Sensors sensors;
  for (const hal::SensorConfig& config : robot.sensors) {
    const bool imu = config.type == hal::SensorType::kImu;
    const std::vector<std::string>& all = imu ? sites : wrenches;
    const std::string name = imu ? imu_site(robot, config) : config.name;
    const auto found = std::find(all.begin(), all.end(), name);
    if (found == all.end()) {
      return std::unexpected(
          Error{.message = "the robot's kernels do not know this sensor",
                .hint = "build them again from this robot.toml; " + suggest(name, all),
                .file = {},
                .key = "sensor." + config.name});
    }
    sensors.slots_.push_back(
        {config.type, static_cast<std::size_t>(found - all.begin()), sensors.channels_});
    sensors.channels_ += config.channels();
    (imu ? sensors.any_imu_ : sensors.any_force_) = true;
  }
  sensors.wrenches_.assign(6 * kernels.sensors, 0.0);
  sensors.pose_.assign(12 * kernels.sites, 0.0);
  sensors.twist_.assign(6 * kernels.sites, 0.0);
  sensors.acceleration_.assign(6 * kernels.sites, 0.0);
  return sensors;
}

void Sensors::sample(Plant& plant, std::span<double> channels) noexcept TANDEM_RT {
  const tandem_kernels& kernels = plant.kernels();
  if (any_force_) {
    kernels.sensor_wrenches_at(plant.sines(), plant.q(), plant.v(), plant.vdot(), plant.wrench(),
                               wrenches_.data());
  }
  if (any_imu_) {
    kernels.site_motion_at(plant.sines(), plant.q(), plant.v(), plant.vdot(), pose_.data(),
                           twist_.data(), acceleration_.data());
  }
  for (std::size_t s = 0; s < slots_.size(); ++s) {
    const Slot& slot = slots_[s];
    double* out = channels.data() + slot.offset;
    if (slot.type == hal::SensorType::kForceTorque) {
      std::copy_n(wrenches_.data() + 6 * slot.index, 6, out);
      plant.add_beyond(s, out);
    } else {
      sample_imu(kernels, slot.index, out);
    }
  }
}

void Sensors::sample_imu(const tandem_kernels& kernels, std::size_t site, double* out) noexcept {
  const double* R = pose_.data() + 12 * site;
  const double* linear = acceleration_.data() + 6 * site;
  double felt_W[3];
  for (int i = 0; i < 3; ++i) felt_W[i] = linear[i] - kernels.gravity_m_s2[i];
  const std::array<double, 4> quaternion = quaternion_of(R);
  const Vec3 rate = rotate_back(R, twist_.data() + 6 * site + 3);
  const Vec3 felt = rotate_back(R, felt_W);
  std::copy(quaternion.begin(), quaternion.end(), out);
  std::copy(rate.begin(), rate.end(), out + 4);
  std::copy(felt.begin(), felt.end(), out + 7);
}

}  // namespace tandem::sim
