// The one check of a robot before anything moves: `run`, `serve`, `emulate`, `check` and `new` ask
// it, and nothing else. Layer: robot.  Thread: main.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/sim/emulated_robot.hpp"
#include "robot/closure_study.hpp"
#include "robot/robot_files.hpp"

namespace tandem::robot {

/// What a robot is about to be used for.
struct RobotUse {
  bool alone = false;   ///< its files by themselves: what hinders a simulation is a warning
  bool plant = false;   ///< it is simulated in this process
  bool drives = false;  ///< this process has its drive master
  std::vector<std::string> postures;  ///< that it may start in; an empty name: every joint at 0
  std::int64_t period_ns = 0;         ///< of the loop; 0: not known
  sim::SimRobotConfig simulation{};   ///< with `plant`; `tree` may be null
};

struct Findings {
  Diagnostics errors;
  Diagnostics warnings;  ///< beside RobotFiles::warnings
  ClosureStudy loops;    ///< of `alone` and `plant`

  void add_error(Error error) { errors.push_back(std::move(error)); }
  void warn(Error warning) { warnings.push_back(std::move(warning)); }
};

/// Every check of the table in robot/check.cpp that this use asks for.
[[nodiscard]] Findings check(const RobotFiles& robot, const RobotUse& use);

/// The use of a robot's files by themselves: every posture of robot.toml, or every joint at 0.
/// @param period_ns  of a loop that they shall be fit for; 0: of none
[[nodiscard]] RobotUse use_alone(const hal::RobotConfig& robot, std::int64_t period_ns = 0);

}  // namespace tandem::robot
