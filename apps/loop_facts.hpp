// What `tandem check` tells of closed loops: how they close, and what can still move.
// Layer: apps.  Thread: main.
#pragma once

#include <span>
#include <string>

#include "apps/console.hpp"
#include "hal/robot_config.hpp"
#include "model/kernels.h"

namespace tandem::apps {

/// Nothing for a robot without loops. Of each posture: the widest gap where the passive joints
/// start from, and where they stand when the loops are closed; of the robot: the degrees of
/// freedom that remain.
///
/// @param kernels   of the robot; null: the loops' names alone
/// @param postures  names of robot.toml; an empty name: every joint at 0
void add_loop_facts(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                    std::span<const std::string> postures, Facts& facts);

}  // namespace tandem::apps
