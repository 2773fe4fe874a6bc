// A robot in a posture: its coordinates, its bodies, and how high its base is when it stands.
// Layer: robot.  Thread: non-RT only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "model/kernels.h"
#include "model/placements.hpp"
#include "model/tree.hpp"

namespace tandem::robot {

/// The model's coordinates (nq) in a posture, the base upright and passive joints where they start
/// from; null: every joint at 0.
[[nodiscard]] std::vector<double> coordinates_at(const hal::RobotConfig& robot,
                                                 const tandem_kernels& kernels,
                                                 const hal::PostureConfig* posture);

/// Where a robot touches the ground.
struct StandingHeight {
  double base_height_m = 0.0;  ///< of the upright base's origin above W's
  std::string foot;            ///< the site of the foot that touches
};

/// Where the tree's bodies are in this posture, the base upright at W's origin.
[[nodiscard]] std::vector<model::Placement> bodies_in(const hal::RobotConfig& robot,
                                                      const hal::PostureConfig& posture,
                                                      const model::Tree& tree);

/// The height of an upright base at which the lowest point of the feet touches the ground in this
/// posture. Feet on links that the description lacks are passed over; nothing without any.
[[nodiscard]] std::optional<StandingHeight> standing(const hal::RobotConfig& robot,
                                                     const hal::PostureConfig& posture,
                                                     const model::Tree& tree);

}  // namespace tandem::robot
