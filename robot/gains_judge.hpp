// Judges the gains of a robot's drives against its model.
// Layer: robot.  Thread: any, one at a time; not the loop's.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "model/kernels.h"
#include "robot/loop_margin.hpp"

namespace tandem::robot {

/// A margin below is worth a warning [deg].
inline constexpr double kLowMargin_deg = 30.0;

/// The loops are judged with every inertia that a joint may see: in the posture that is given, and
/// the smallest and largest of some postures within the limits, each with the other joints locked
/// and with all of them, and the base, free. Robot and kernels outlive it.
class GainsJudge {
 public:
  using Gains = std::array<hal::PidGains, hal::kPidLoops>;  ///< by hal::PidLoop

  GainsJudge(const hal::RobotConfig& robot, const tandem_kernels* kernels);

  /// Why the loops of a joint cannot be judged; empty: they can.
  [[nodiscard]] std::string unknown(std::size_t joint) const;

  /// The worst of the loops that gains of `loop` act in: itself, and around the torque loop those
  /// of position and velocity. Empty: none of them has gains.
  /// @param position_rad  of every joint of the robot; what is not finite counts as 0
  /// @param with_margin  false: stable or not, which takes a hundredth of the time
  /// @pre unknown(joint) is empty; `loop` is not the current's
  [[nodiscard]] std::optional<LoopVerdict> judge(std::size_t joint, hal::PidLoop loop,
                                                 const Gains& gains,
                                                 std::span<const double> position_rad,
                                                 bool with_margin = true) const;

  /// Gains near these that have a phase margin of kLowMargin_deg, in words; empty: none are found.
  /// @pre as judge()'s
  [[nodiscard]] std::string remedy(std::size_t joint, hal::PidLoop loop, const Gains& gains,
                                   std::span<const double> position_rad) const;

 private:
  /// What a joint feels of the mass matrix: all else free, and all else locked.
  struct Inertias {
    double free_kg_m2 = 0.0, locked_kg_m2 = 0.0;
  };
  [[nodiscard]] std::vector<Inertias> inertias_at(std::span<const double> position_rad) const;

  const hal::RobotConfig& robot_;
  const tandem_kernels* kernels_;
  std::vector<std::optional<std::size_t>> rows_;  ///< by joint of the robot: its row in the model
  std::vector<Inertias> range_;                   ///< the same: the least free, the most locked
};

}  // namespace tandem::robot
