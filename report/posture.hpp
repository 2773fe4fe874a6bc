// The robot as a stick figure in its sagittal plane, from the description's tree.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "model/tree.hpp"
#include "report/figure.hpp"

namespace tandem::report {

/// One moment of a run. Joints stand in the process image's order, the passive ones behind them,
/// unless nobody knows where those are.
struct PostureSample {
  std::string label;      ///< "lowest"
  double time_s = 0.0;    ///< as the figures over time have it
  model::Placement base;  ///< of the root link in W
  std::vector<double> position_rad;
  bool placed = true;  ///< false: nobody knows where the base is
  /// Under it, and how far that is moved then; null: only what the robot's file says is drawn.
  const hal::ContactConfig* ground = nullptr;
  std::array<double, 3> ground_m{};
};

/// The side view from the robot's right, ahead to the right (model::direction_ahead() of its feet)
/// and z up, of several moments beside each other, none of which touches
/// another or the texts below: legs (what
/// carries a contact's site) blue, the trunk dark, everything else light. A robot without feet is
/// dark as a whole, and seen from the front, y to the right, where that shows more of it and its
/// motion. Closed loops are drawn over their sites, with a rod between them if there is one;
/// where the passive joints are unknown, what they move is left out, and the title says so. Where
/// nobody knows the base it stands upright with its lowest foot on the ground, as the title says.
/// Ground that is not level is drawn below each, along the line through its base.
/// @pre every joint of the tree is one of the robot's, or passive.
[[nodiscard]] Figure posture_figure(const model::Tree& tree, const hal::RobotConfig& robot,
                                    std::span<const PostureSample> moments);

/// Placement in W of every body's frame, in the tree's order. A joint without a value stands at 0.
[[nodiscard]] std::vector<model::Placement> body_placements(const model::Tree& tree,
                                                            const hal::RobotConfig& robot,
                                                            const PostureSample& sample);

/// Height in W of the feet's lowest contact point; empty: the robot has none.
[[nodiscard]] std::optional<double> lowest_foot_m(const model::Tree& tree,
                                                  const hal::RobotConfig& robot,
                                                  const PostureSample& sample);

}  // namespace tandem::report
