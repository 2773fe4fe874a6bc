// What a robot.toml means for its model and for its boards' firmware.
// Layer: hal/sim.  Thread: non-RT.
#pragma once

#include <cstdint>
#include <vector>

#include "firmware_emu/setup.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/apparent_inertia.hpp"
#include "model/model_spec.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// Whether the boards can be emulated: ours, and stand-ins for drives by their sheets.
/// Error: a drive whose sheet lacks what an emulation needs (firmware::check_sheet()).
[[nodiscard]] Status check_firmware(const hal::RobotConfig& robot);

/// What the robot's kernels are generated from: its sites, its sensors (an IMU is a site, see
/// imu_site; a loop's sites take wrenches), and the rotors of rigid actuators as armature.
[[nodiscard]] model::ModelSpec model_spec(const hal::RobotConfig& robot);

/// Where the joints end: at the description's limits, or at robot.toml's where these lie further
/// out or the description has none; a leader earlier, where a joint that mimics it ends. A
/// continuous joint has no end. With the effort of the joint's drive.
[[nodiscard]] std::vector<JointRange> mechanical_ranges(const hal::RobotConfig& robot,
                                                        const model::Tree& tree);

/// Indices in `robot.joints` of a board's axes, by axis.
[[nodiscard]] std::vector<std::size_t> joints_of(const hal::RobotConfig& robot,
                                                 const hal::BoardConfig& board);

/// Board `index`. Its settings at power-on are those that the drive master writes, too.
/// @param seed  of the run; every board draws its own numbers from it
[[nodiscard]] firmware::BoardSetup board_setup(const hal::RobotConfig& robot, std::size_t index,
                                               std::uint64_t seed);

/// The same of sensor `index`.
[[nodiscard]] firmware::SensorSetup sensor_setup(const hal::RobotConfig& robot, std::size_t index,
                                                 std::uint64_t seed);

}  // namespace tandem::sim
