// [estimation] of an experiment, read strictly.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include "base/keys.hpp"
#include "estimation/config.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::runtime {

/// Errors go to the table's document: unknown keys, numbers out of range, a joint that the robot
/// lacks, a collision without a threshold. What the robot has no sensor for, Estimator::make()
/// says.
[[nodiscard]] estimation::EstimationConfig read_estimation(TomlTable table,
                                                           const hal::RobotConfig& robot);

/// The keys of [estimation.base] and [estimation.observer], for docs/configuration.md.
void describe_estimation(KeyPage& page);

}  // namespace tandem::runtime
