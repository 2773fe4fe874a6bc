// A simulated robot in its loop without controllers: its drives hold a posture.
// Layer: hal/sim.  Thread: one; step() as RT as the robot's engine.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "hal/config/capabilities.hpp"
#include "hal/sim/sim_robot.hpp"

namespace tandem::sim {

/// Every joint is in position control, as the controller `hold` does it.
struct HeldRobot {
  /// @param posture  one of the robot's
  HeldRobot(const hal::RobotConfig& config, std::unique_ptr<SimRobot> made,
            const std::string& posture)
      : robot(std::move(made)),
        state(config.shape()),
        command(config.shape()),
        parameters(hal::initial_parameters(config)) {
    const std::vector<double>& position = config.posture(posture)->position_rad;
    for (std::size_t j = 0; j < position.size(); ++j) {
      command.position_rad()[j] = position[j];
      command.mode()[j] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
    }
  }

  /// One cycle. @return  the first that reading or writing did not do; kOk: both did
  Code step() noexcept {
    time.time_ns = static_cast<std::int64_t>(time.cycle) * time.period_ns;
    const Code read = robot->read(time, state);
    for (std::size_t j = 0; j < damped_joints; ++j)
      command.torque_Nm()[j] = -link_damping_Nms_rad * state.velocity_rad_s()[j];
    const Code written = robot->write(command, parameters);
    ++time.cycle;
    return read == Code::kOk ? written : read;
  }

  std::unique_ptr<SimRobot> robot;
  hal::StateImage state;
  hal::CommandImage command;
  hal::ParameterImage parameters;
  hal::CycleTime time;
  // Damping of COMAN's legs, as config/coman/hold.toml has it.
  std::size_t damped_joints = 12;  ///< the first
  double link_damping_Nms_rad = 12.0;
};

}  // namespace tandem::sim
