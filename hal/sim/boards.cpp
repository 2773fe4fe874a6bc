// True values of the motors from the plant, states from the firmware's objects.
#include "hal/sim/boards.hpp"

#include "hal/ethercat-can/axis_codec.hpp"
#include "hal/sim/setup.hpp"

namespace tandem::sim {

BoardsFiller::BoardsFiller(EmulatedRobot& robot, const hal::RobotConfig& config)
    : robot_(&robot), drives_(config.joints.size()) {
  for (std::size_t bus = 0; bus < robot.buses(); ++bus) {
    for (const EmulatedRobot::Node& node : robot.nodes(bus)) {
      if (node.board < 0) continue;
      const auto b = static_cast<std::size_t>(node.board);
      const std::vector<std::size_t> joints = joints_of(config, config.boards[b]);
      for (std::size_t axis = 0; axis < joints.size(); ++axis) {
        drives_[joints[axis]] = {&robot.board(b).axis(axis), node.powered};
      }
    }
  }
}

void BoardsFiller::fill(const hal::CycleTime& time,
                        hal::BoardsImage& boards) const noexcept TANDEM_RT {
  boards.cycle()[0] = time.cycle;
  boards.time_ns()[0] = time.time_ns;
  boards.all_enabled()[0] = robot_->all_enabled() ? 1 : 0;
  for (std::size_t j = 0; j < drives_.size(); ++j) {
    const JointReading joint = robot_->plant().joint(j);
    boards.motor_position_rad()[j] = joint.motor_position_rad;
    boards.motor_velocity_rad_s()[j] = joint.motor_velocity_rad_s;
    boards.current_A()[j] = joint.current_A;
    boards.voltage_V()[j] = joint.voltage_V;
    boards.temperature_C()[j] = joint.temperature_C;
    const Drive& drive = drives_[j];
    if (drive.axis == nullptr || *drive.powered == 0) {  // it says nothing
      boards.fault()[j] = 0;
      boards.statusword()[j] = 0;
      boards.mode()[j] = static_cast<std::int8_t>(hal::ControlMode::kIdle);
      boards.interaction()[j] = static_cast<std::uint8_t>(hal::InteractionMode::kStiff);
      boards.drive_state()[j] = static_cast<std::uint8_t>(hal::DriveState::kUnknown);
      continue;
    }
    const firmware::AxisObjects& says = drive.axis->objects();
    const canopen::DriveMachineState state = drive.axis->machine().state();
    const auto [mode, interaction] = hal::can::image_mode(says.mode_display);
    const bool enabled = state == canopen::DriveMachineState::kOperationEnabled;
    boards.fault()[j] = says.error_code;
    boards.statusword()[j] = says.statusword;
    boards.mode()[j] = static_cast<std::int8_t>(enabled ? mode : hal::ControlMode::kIdle);
    boards.interaction()[j] = static_cast<std::uint8_t>(interaction);
    boards.drive_state()[j] = static_cast<std::uint8_t>(state);  // numbered as hal::DriveState
  }
}

}  // namespace tandem::sim
