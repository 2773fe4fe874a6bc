// The judgement of gains that `tandem joint gains` prints.
// Layer: apps/robot.  Thread: any, one at a time; not the loop's.
#pragma once

#include <span>

#include "apps/text/console.hpp"
#include "robot/gains_judge.hpp"

namespace tandem::apps {

/// `stability` of docs/json.md: with `remedy` when the gains are unstable.
/// @param position_rad  of every joint of the robot
[[nodiscard]] Json opinion(const robot::GainsJudge& judge, std::size_t joint, hal::PidLoop loop,
                           const robot::GainsJudge::Gains& gains,
                           std::span<const double> position_rad);

}  // namespace tandem::apps
