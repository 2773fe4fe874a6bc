// A closed loop of the mechanism as robot.toml names it. Plain data, shared by hal and model.
// Layer: model.  Thread: any.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace tandem::model {

enum class KinematicLoopType : std::uint8_t {
  kBall,      ///< the two sites' origins coincide
  kRevolute,  ///< they coincide, and so does the axis, given in both sites' frames
  kRod,       ///< they keep their distance: a massless rod with a ball joint at either end
};

/// [[loop]]: what closes a loop of the tree between two sites.
struct KinematicLoop {
  std::string name;
  KinematicLoopType type = KinematicLoopType::kBall;
  std::array<std::string, 2> sites;
  std::array<double, 3> axis{0.0, 0.0, 1.0};  ///< revolute: unit length, in both sites' frames
  double length_m = 0.0;                      ///< rod
};

}  // namespace tandem::model
