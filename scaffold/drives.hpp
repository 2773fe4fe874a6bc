// Motors, gears and gains for joints of which only limits and loads are known. docs/robots.md
// has the equations.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "scaffold/loads.hpp"

namespace tandem::scaffold {

/// Counts of every encoder that is made up, per revolution of the link: 20 bits.
inline constexpr double kEncoderCounts = 1048576.0;

/// A table of robot.toml, what it serves, and the remark that stands over it.
struct DriveSize {
  hal::ActuatorConfig actuator;
  std::vector<int> joints;
  std::string remark;
};
struct GainSet {
  hal::GainsConfig gains;
  std::vector<int> joints;
  std::string remark;
};

/// Groups joints by effort, from the strongest on: a size serves those that need at least 0.6 of
/// it, and whose own rotor would have between half and twice the inertia of the strongest's. Rigid
/// drives that reach effort and speed at their limits of current and voltage.
[[nodiscard]] std::vector<DriveSize> size_drives(const model::Tree& tree,
                                                 const std::vector<JointLimits>& limits);

struct Tuning {
  double period_s = 1e-3;    ///< of the control loop
  double fall_margin = 3.0;  ///< least stiffness of a leg over what the pendulum on it needs
  double cascade = 4.0;      ///< velocity loop over position loop, the least
  double reserve = 1.0;      ///< of a robot's stiffness over what it needs to stand, less 1
};

/// Gains for each size, by the smallest and the largest inertia that its joints move; joints
/// whose stiffness would differ by more than a factor of 2.5 get sets of their own.
[[nodiscard]] std::vector<GainSet> tune(const std::vector<DriveSize>& drives,
                                        const std::vector<JointLoad>& loads, const Tuning& tuning);

/// Rounds to `digits` significant ones, so that files stay readable.
[[nodiscard]] double rounded(double value, int digits = 3);

}  // namespace tandem::scaffold
