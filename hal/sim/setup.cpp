// robot.toml to the set-ups of firmware_emu and to the model's specification.
#include "hal/sim/setup.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "canopen/drive_abilities.hpp"
#include "canopen/frame.hpp"
#include "firmware_emu/sheet_dictionary.hpp"
#include "hal/config/drive_parameters.hpp"
#include "hal/sim/actuator.hpp"
#include "hal/sim/sensors.hpp"

namespace tandem::sim {
namespace {

// Boards and sensors draw from generators of their own, so that adding one changes no other.
std::uint64_t seed_of(std::uint64_t seed, std::uint64_t kind, std::size_t index) {
  return (seed * 0x9E3779B97F4A7C15U) ^ (kind << 32) ^ (index + 1);
}

// The encoders and the spring of a healthy joint agree to some 1e-3 rad: encoders' counts, the
// torque's noise, and the spring's damping, which the comparison leaves out.
constexpr double kMismatchWindow_rad = 0.02;
constexpr double kUndervoltageShare = 0.6;  // of the supply
constexpr double kQuickestStop_s = 0.25;    // from the largest velocity to rest

/// What a frame of the bus carries.
std::size_t pdo_bytes(const hal::RobotConfig& robot, const std::string& name) {
  const hal::BusConfig* bus = robot.bus(name);
  return bus == nullptr || bus->fd ? canopen::kMaxFrameBytes : canopen::kClassicFrameBytes;
}

/// Where a joint's home switch is active: as robot.toml says, else from the middle of its range to
/// the end that the method means, or 0.05 rad about the middle. Upper and lower are the drive's.
std::array<double, 2> home_switch_rad(const hal::JointConfig& joint) {
  constexpr double kHalf_rad = 0.05;
  if (joint.homing && joint.homing->home_switch_rad) return *joint.homing->home_switch_rad;
  const double min = joint.min_position_rad;
  const double max = joint.max_position_rad;
  const double middle = std::isfinite(min) && std::isfinite(max) ? 0.5 * (min + max) : 0.0;
  const int method = joint.homing ? joint.homing->method : 0;
  const int number = method > 16 ? method - 16 : method;  // 17 to 30: as 1 to 14
  const bool upper = number == 3 || number == 4;
  const bool lower = number == 5 || number == 6;
  if (!upper && !lower) return {middle - kHalf_rad, middle + kHalf_rad};
  constexpr double kEnd = std::numeric_limits<double>::infinity();
  if (upper == joint.reversed) return {-kEnd, middle};
  return {middle, kEnd};
}

firmware::AxisSetup axis_setup(const hal::RobotConfig& robot, const hal::JointConfig& joint) {
  const hal::ActuatorConfig& actuator = robot.actuator_of(joint);
  firmware::AxisSetup axis;
  axis.parameters.mismatch_window_rad = kMismatchWindow_rad;
  axis.parameters.stop_deceleration_rad_s2 = joint.max_velocity_rad_s / kQuickestStop_s;
  axis.parameters.undervoltage_V = kUndervoltageShare * actuator.voltage_limit_V;
  axis.parameters.take(hal::drive_parameters(robot, joint));
  axis.torque_noise_Nm = joint.torque_noise_Nm;
  axis.reversed = joint.reversed;
  axis.zero_counts = joint.zero_counts;
  axis.turn_counts = joint.encoder_turn_counts;
  axis.velocity_units_per_rev = joint.velocity_units_per_rev;
  axis.acceleration_units_per_rev = joint.acceleration_units_per_rev;
  const auto [from_rad, to_rad] = home_switch_rad(joint);
  axis.home_switch_from_rad = from_rad;
  axis.home_switch_to_rad = to_rad;
  axis.index_rad = joint.homing ? joint.homing->index_rad : 0.0;
  axis.index_pitch_rad = 2.0 * std::numbers::pi / actuator.gear_ratio;
  axis.counts_from_power_on = joint.homing && joint.homing->required;
  return axis;
}

/// The board has the drive's dictionary.
void stand_in_for(const hal::BoardConfig& config, firmware::BoardSetup& board) {
  board.sheet = config.sheet;
  board.vendor = config.vendor_id.value_or(config.sheet->vendor.value_or(0));
  board.product = config.product_code.value_or(config.sheet->product.value_or(0));
  board.revision = config.revision.value_or(config.sheet->revision.value_or(0));
  board.max_pdo_bytes =
      std::min(board.max_pdo_bytes, static_cast<std::size_t>(config.sheet->most_pdo_bytes));
  for (std::size_t a = 0; a < board.axes.size(); ++a) {
    const int axis = static_cast<int>(a);
    board.axes[a].modes = firmware::emulated_modes(*config.sheet, axis);
    const std::vector<int> methods = canopen::homing_methods(*config.sheet, axis);
    if (!methods.empty()) board.axes[a].homing_methods = 0;
    for (const int method : methods) {
      if (method > 0 && method < 64) board.axes[a].homing_methods |= std::uint64_t{1} << method;
    }
  }
}

}  // namespace

Status check_firmware(const hal::RobotConfig& robot) {
  for (const hal::BoardConfig& board : robot.boards) {
    if (board.eds.empty()) continue;
    const Status good = firmware::check_sheet(*board.sheet, joints_of(robot, board).size());
    if (good) continue;
    return std::unexpected(Error{
        .message = "its drive (" + board.eds + ") cannot be emulated: " + good.error().message,
        .hint = good.error().hint,
        .file = robot.file,
        .line = board.line,
        .key = "board '" + board.name + "'"});
  }
  return {};
}

model::ModelSpec model_spec(const hal::RobotConfig& robot) {
  model::ModelSpec spec;
  spec.robot = robot.name;
  spec.urdf = robot.model.urdf;
  spec.floating_base = robot.model.floating_base;
  spec.mimic_independent = robot.model.mimic_independent;
  spec.derivatives = robot.model.derivatives;
  spec.lock = robot.model.lock;
  spec.gravity_m_s2 = robot.model.gravity_m_s2;
  for (const hal::SiteConfig& site : robot.model.sites) {
    const bool closes = std::ranges::any_of(robot.loops, [&](const hal::KinematicLoopConfig& loop) {
      return std::ranges::count(loop.sites, site.name) != 0;
    });
    spec.sites.push_back({site.name, site.link, site.xyz_m, site.rpy_rad, site.wrench || closes});
  }
  for (const hal::SensorConfig& sensor : robot.sensors) {
    if (sensor.type == hal::SensorType::kForceTorque) {
      spec.sensors.push_back({sensor.name, sensor.joint, sensor.link});
      continue;
    }
    const std::string site = imu_site(robot, sensor);
    const bool known = std::ranges::any_of(
        spec.sites, [&](const model::SiteSpec& other) { return other.name == site; });
    if (!known) spec.sites.push_back({.name = site, .link = sensor.link});
  }
  for (const hal::JointConfig& joint : robot.joints) {
    const double inertia = armature(robot.actuator_of(joint));
    if (inertia > 0.0) spec.armature.emplace_back(joint.name, inertia);
  }
  return spec;
}

std::vector<JointRange> mechanical_ranges(const hal::RobotConfig& robot, const model::Tree& tree) {
  std::vector<JointRange> ranges;
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    const model::Joint& joint = tree.joints[j];
    if (joint.follows()) continue;
    JointRange range{.joint = joint.name};
    if (!std::isnan(joint.lower)) range.lower_rad = joint.lower;
    if (!std::isnan(joint.upper)) range.upper_rad = joint.upper;
    if (const int at = robot.joint_index(joint.name); at >= 0) {
      const hal::JointConfig& config = robot.joints[static_cast<std::size_t>(at)];
      range.effort_Nm = config.max_torque_Nm;
      const bool unknown = std::isnan(joint.lower);
      range.lower_rad =
          unknown ? config.min_position_rad : std::min(joint.lower, config.min_position_rad);
      range.upper_rad =
          unknown ? config.max_position_rad : std::max(joint.upper, config.max_position_rad);
    }
    for (const model::Joint& follower : tree.joints) {
      if (follower.leader != static_cast<int>(j)) continue;
      range.lower_rad = std::max(range.lower_rad, follower.leaders_range().lower);
      range.upper_rad = std::min(range.upper_rad, follower.leaders_range().upper);
    }
    ranges.push_back(range);
  }
  return ranges;
}

std::vector<std::size_t> joints_of(const hal::RobotConfig& robot, const hal::BoardConfig& board) {
  std::vector<std::size_t> joints;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    if (robot.joints[j].board == board.name) joints.push_back(j);
  }
  std::ranges::sort(joints, {}, [&](std::size_t j) { return robot.joints[j].axis; });
  return joints;
}

firmware::BoardSetup board_setup(const hal::RobotConfig& robot, std::size_t index,
                                 std::uint64_t seed) {
  const hal::BoardConfig& config = robot.boards[index];
  firmware::BoardSetup board;
  board.node_id = config.node_id;
  board.name = config.name;
  board.vendor = config.vendor_id.value_or(board.vendor);
  board.product = config.product_code.value_or(board.product);
  board.revision = config.revision.value_or(board.revision);
  board.serial = config.serial.value_or(static_cast<std::uint32_t>(index + 1));
  board.control_period_ns = config.control_period_ns;
  board.max_pdo_bytes = pdo_bytes(robot, config.bus);
  board.seed = seed_of(seed, 1, index);
  for (const std::size_t joint : joints_of(robot, config)) {
    board.axes.push_back(axis_setup(robot, robot.joints[joint]));
  }
  if (!config.eds.empty()) stand_in_for(config, board);
  return board;
}

firmware::SensorSetup sensor_setup(const hal::RobotConfig& robot, std::size_t index,
                                   std::uint64_t seed) {
  const hal::SensorConfig& config = robot.sensors[index];
  firmware::SensorSetup sensor;
  sensor.node_id = config.node_id;
  sensor.name = config.name;
  sensor.serial = static_cast<std::uint32_t>(index + 1);
  sensor.channels = config.channels();
  sensor.max_pdo_bytes = pdo_bytes(robot, config.bus);
  sensor.noise = config.noise;
  sensor.bias = config.bias;
  sensor.orients = config.type == hal::SensorType::kImu;
  sensor.seed = seed_of(seed, 2, index);
  return sensor;
}

}  // namespace tandem::sim
