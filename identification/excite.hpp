// A trajectory that excites a robot's dynamics within its limits.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "identification/series.hpp"
#include "model/tree.hpp"

namespace tandem::identification {

struct ExciteRequest {
  std::string posture{};              ///< start; empty: every joint at 0
  std::vector<std::string> joints{};  ///< that move; empty: all that can
  double period_s = 10.0;
  int harmonics = 5;
  std::uint64_t seed = 1;
  double share = 0.7;  ///< of the limits of speed and torque
  int tries = 300;     ///< candidates
  bool hung = false;   ///< a floating base hangs from a hoist, feet in the air
};

struct Excitation {
  std::vector<std::string> joints;  ///< of the robot's image that move, in its order
  ExcitingSeries series;            ///< of them
  double condition_number = 0.0;    ///< of the base parameters' columns, each of unit length, rows
                                    ///< over the joints' largest torques
  std::size_t base_parameters = 0;
  double position_share = 0.0;     ///< the largest share of a joint's way from the start to a limit
  double speed_share = 0.0;        ///< of a joint's limit
  double torque_share = 0.0;       ///< the same, by inverse dynamics of the description
  double room_m = 0.0;             ///< self-distance beyond what is required
  double margin_m = 0.0;           ///< of balance, of a robot that stands; else 0
  double lowest_m = 0.0;           ///< of the soles: above where they are in the start posture
  double lift_m = 0.0;             ///< of a robot that hangs: above its posture's height
  std::vector<std::string> legs;   ///< of `joints`: those that carry a robot that stands
  std::vector<std::string> still;  ///< joints that do not move, and need not
};

/// Searches the series of the best condition: random candidates, then changes of the best. A robot
/// with a fixed base moves every joint. One that stands keeps its feet where they are: its base
/// moves in six directions and the legs follow by inverse kinematics, all other joints move freely,
/// and the point of zero moment stays inside the feet. One that hangs moves every joint about a
/// base at rest, and the condition is that of the joints' equations alone.
///
/// Errors: make_identified_robot()'s; a fixed base that is to hang; an unknown posture or joint; no
/// joint that may move; a start posture that breaks a limit by itself; legs that cannot keep the
/// feet in place.
[[nodiscard]] Result<Excitation> excite(const hal::RobotConfig& robot, const model::Tree& tree,
                                        const ExciteRequest& request);

}  // namespace tandem::identification
