// The scales of joints on drives of other makes, as `tandem check` shows them.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <vector>

#include "apps/text/figures.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::apps {

/// A line for each scale, with its joints. @pre the robot is completed from its description
void add_scale_facts(const hal::RobotConfig& robot, Facts& facts);

/// `scales` of docs/json.md, and what each has. @pre as above
void add_scale_json(const hal::RobotConfig& robot, Json& json);
[[nodiscard]] std::vector<Figures::Row> scale_figures();

}  // namespace tandem::apps
