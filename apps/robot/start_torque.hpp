// Whether the joints can carry the robot where it starts.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/robot/robot_files.hpp"
#include "model/kernels.h"

namespace tandem::apps {

/// The model's coordinates (nq) in a posture, the base upright; null: every joint at 0.
[[nodiscard]] std::vector<double> coordinates_at(const hal::RobotConfig& robot,
                                                 const tandem_kernels& kernels,
                                                 const hal::PostureConfig* posture);

/// The joints that cannot give the torque that gravity asks of them at rest in a posture: their
/// max_torque_Nm, or what current and voltage leave of it, is less. Not asked of the joints between
/// the base and a foot, for what the ground carries is not known, nor of closed loops.
///
/// @param posture  empty: every joint at 0
/// @return  one warning for all of them, at the line of the weakest; nothing when all are strong
///          enough or the posture is unknown
[[nodiscard]] std::optional<Error> too_weak_at(const RobotFiles& robot, const std::string& posture);

/// Gravity with z > 0: legal, and nearly always a slip of sign.
[[nodiscard]] std::optional<Error> upward_gravity(const hal::RobotConfig& robot);

/// Both, a motor without its back-EMF, and ringing_loops(), of the posture that a run starts in.
[[nodiscard]] Diagnostics start_warnings(const RobotFiles& robot, const std::string& posture);

}  // namespace tandem::apps
