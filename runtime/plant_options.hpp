// [sim.link.NAME], [sim.joint.NAME] and [[sim.payload]] of an experiment, read strictly.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <memory>

#include "base/keys.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/plant_changes.hpp"
#include "model/urdf.hpp"
#include "robot/complete_robot.hpp"

namespace tandem::runtime {

/// The plant of `robot`, where it is another than its files say; null: it is as they say.
/// Errors go to the table's document: a link, joint or site that the robot lacks (with the
/// nearest), masses and inertias that no body has, numbers out of range, two payloads of a name,
/// one that ends before it begins.
/// @param description  null: none was read, and then nothing can be changed
/// @param files        that were read: the URDF is one of them
[[nodiscard]] std::shared_ptr<const sim::PlantChanges> read_plant_changes(
    TomlTable sim, const hal::RobotConfig& robot, const model::UrdfModel* description,
    const robot::FileTexts& files);

/// Marks the three as read, for who reads the rest of [sim].
void leave_plant_changes(TomlTable& sim);

/// Their keys, for docs/configuration.md.
void describe_plant_changes(KeyPage& page);

}  // namespace tandem::runtime
