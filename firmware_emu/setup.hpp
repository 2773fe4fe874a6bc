// What a board is built with, and what passes between its pins and the physics.
// Layer: firmware_emu.  Thread: setup non-RT; sense and drive RT only.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "canopen/data_sheet.hpp"
#include "canopen/drive_parameters.hpp"
#include "canopen/objects.hpp"

namespace tandem::firmware {

/// The truth at a sampling instant, at the pins of one axis. Link side; motor angle reflected
/// to the link.
struct AxisSense {
  double link_position_rad = 0.0;
  double motor_position_rad = 0.0;
  double spring_torque_Nm = 0.0;  ///< positive when it drives the link to +
  double current_A = 0.0;
  double temperature_C = 25.0;  ///< of the winding
  double bus_voltage_V = 0.0;
  bool emergency_stop = false;  ///< the board's interlock input is active
};

/// What one axis does to its motor until the next control period.
struct AxisDrive {
  double voltage_V = 0.0;
  bool enabled = false;     ///< false: bridge open, no current whatever the back-EMF
  bool brake_open = false;  ///< the brake's coil has current; without power it is set
};

/// One axis: its settings at power-on, and what its sensors and switches are.
struct AxisSetup {
  canopen::DriveParameters parameters{};
  std::uint32_t modes = canopen::kTandemModes;  ///< it takes these: bits of 6502
  bool reversed = false;         ///< 6064 counts down, and 6077 too, as the joint's angle grows
  std::int32_t zero_counts = 0;  ///< 6064 where the joint is at 0; its range may wrap around
  /// The encoder is a single-turn one: 6064 is from 0 to this at power-on, and counts on from
  /// there. 0: it counts the whole range.
  std::int32_t turn_counts = 0;
  /// The encoder counts from where it stands at power-on, which 6064 shows as `zero_counts` until
  /// homing finds the joint's place.
  bool counts_from_power_on = false;
  std::uint64_t homing_methods = ~std::uint64_t{0};  ///< bit n: it has method n, if emulated
  /// The home switch is active where the joint is from here to there; from above to: nowhere.
  double home_switch_from_rad = 1.0;
  double home_switch_to_rad = -1.0;
  /// The motor's encoder gives an index pulse here, and every so often of the link's way; 0: none.
  double index_rad = 0.0;
  double index_pitch_rad = 0.0;
  /// Velocity units (606C, 60FF, 60B1, 6081, 6099) at one revolution of the link per second; 0:
  /// counts per second.
  double velocity_units_per_rev = 0.0;
  /// Acceleration units (6083, 6084, 609A) at one revolution per second and second; 0: velocity
  /// units per second.
  double acceleration_units_per_rev = 0.0;
  double torque_noise_Nm = 0.0;    ///< standard deviation of the torque's measurement
  double torque_quantum_Nm = 0.0;  ///< step of the torque's measurement; 0: none
};

/// A board with one or more axes: 1 to canopen::kMaxAxes.
struct BoardSetup {
  int node_id = 1;
  std::string name = "tandem board";  ///< 1008
  std::uint32_t vendor = canopen::kTandemVendor;
  std::uint32_t product = canopen::kBoardProduct;
  std::uint32_t revision = canopen::kTandemRevision;
  std::uint32_t serial = 0;
  std::int64_t control_period_ns = 1'000'000;
  std::size_t max_pdo_bytes = 64;  ///< 8 on a bus without CAN FD
  std::uint64_t seed = 1;          ///< of the torque sensors' noise
  std::vector<AxisSetup> axes;
  /// The board stands in for the drive of this sheet, whose dictionary it has; null: one of ours.
  std::shared_ptr<const canopen::DataSheet> sheet;
};

/// A sensor node: force/torque, IMU.
struct SensorSetup {
  int node_id = 1;
  std::string name = "tandem sensor";
  std::uint32_t serial = 0;
  std::size_t channels = 6;
  std::size_t max_pdo_bytes = 64;  ///< 8 on a bus without CAN FD
  std::vector<double> noise;       ///< standard deviation per channel, SI; empty: none
  std::vector<double> bias;        ///< per channel, SI; empty: none
  bool orients = false;            ///< the first four channels are a quaternion
  std::uint64_t seed = 1;
};

}  // namespace tandem::firmware
