// Postures to begin with: neutral, spared from gravity, waiting on a fixed base.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <vector>

#include "scaffold/posed.hpp"

namespace tandem::scaffold {

/// The description's range of a joint; where it gives none, half a turn or 0.1 m to either side.
struct PositionRange {
  double lower = 0.0, upper = 0.0;
  bool guessed = false;
};
[[nodiscard]] PositionRange position_range(const model::Joint& joint);

/// Positions that keep some room to the limits.
struct Bounds {
  Eigen::VectorXd lower, upper;
};
[[nodiscard]] Bounds bounds_of(const model::Tree& tree);

/// Every joint at 0, or as near to it as its limits allow with some room to them.
[[nodiscard]] Eigen::VectorXd neutral_posture(const model::Tree& tree);

/// The same, but a joint that gravity would load with more than half its effort moves as far as
/// it takes to make that a third.
[[nodiscard]] Eigen::VectorXd spared_posture(const model::Tree& tree);

/// Whether what moves is above the base's plane (z = 0 of the root) in the middle of its limits:
/// then the plane may be a floor or a table. Else the robot hangs.
[[nodiscard]] bool stands_on_its_base(const model::Tree& tree);

/// A posture of a robot on a fixed base: near the middle of its limits, but where its ends can
/// move in every direction and gravity asks for no more than half of an effort. Of a robot that
/// stands on its base nothing is below that, if its limits allow. The best of a fixed series of
/// samples.
[[nodiscard]] Eigen::VectorXd waiting_posture(const model::Tree& tree);

/// The i-th point of a series that fills (0, 1)^n evenly: Halton's, by dimension.
[[nodiscard]] double halton(int index, int dimension);

/// Bodies that carry no joint.
[[nodiscard]] std::vector<int> end_bodies(const model::Tree& tree);

}  // namespace tandem::scaffold
