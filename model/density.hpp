// How dense a body is, by its mass and inertia alone.
// Layer: model.  Thread: any.
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/tree.hpp"

namespace tandem::model {

/// About the centre of mass [m]; 0 without mass.
[[nodiscard]] inline double largest_gyration_m(const Inertia& inertia) {
  if (!(inertia.mass_kg > 0.0)) return 0.0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia.about_com_kg_m2,
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()[2]) / inertia.mass_kg);
}

/// Density of the solid ball with this mass and largest radius of gyration [kg/m^3]: no more than
/// the body's own. 0 without mass or without inertia.
[[nodiscard]] inline double density_of_ball(const Inertia& inertia) {
  const double gyration_m = largest_gyration_m(inertia);
  if (!(gyration_m > 0.0)) return 0.0;
  return inertia.mass_kg /
         (4.0 / 3.0 * std::numbers::pi * std::pow(gyration_m / std::sqrt(0.4), 3.0));
}

}  // namespace tandem::model
