// Raises the eigenvalues of the second moments J = tr(I)/2 - I; docs/urdf.md has the rules.
#include "model/urdf_repair.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "model/urdf_inertia.hpp"

namespace tandem::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kThinnest = 1e-4;           // second moment, of the largest
constexpr double kPoint_m = 1e-4;            // a radius of gyration below it is none
constexpr double kBallDensity_kg_m3 = 2700;  // aluminium

Matrix3d ball(double mass_kg) {
  const double radius_m = std::cbrt(3.0 * mass_kg / (4.0 * std::numbers::pi * kBallDensity_kg_m3));
  return 0.4 * mass_kg * radius_m * radius_m * Matrix3d::Identity();
}

Matrix3d nearest_possible(double mass_kg, const Matrix3d& I) {
  const Matrix3d J = 0.5 * I.trace() * Matrix3d::Identity() - I;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(J);
  const double largest = solver.eigenvalues()[2];
  if (!(largest > mass_kg * kPoint_m * kPoint_m) || is_beyond_size(mass_kg, I)) {
    return ball(mass_kg);
  }
  const Vector3d raised = solver.eigenvalues().cwiseMax(kThinnest * largest);
  const Matrix3d& axes = solver.eigenvectors();
  const Matrix3d possible = axes * raised.asDiagonal() * axes.transpose();
  const Matrix3d result = possible.trace() * Matrix3d::Identity() - possible;
  return 0.5 * (result + result.transpose());
}

}  // namespace

std::optional<InertiaRepair> repaired(const Inertia& inertia) {
  const std::string problem = inertia_problem(inertia);
  const bool finite = std::isfinite(inertia.mass_kg) && inertia.com_m.allFinite() &&
                      inertia.about_com_kg_m2.allFinite();
  if (problem.empty() || inertia.mass_kg < 0.0 || !finite) return {};
  if (inertia.mass_kg == 0.0) return InertiaRepair{{}, problem + "; taken: none"};
  InertiaRepair repair{inertia, {}};
  repair.inertia.about_com_kg_m2 = nearest_possible(inertia.mass_kg, inertia.about_com_kg_m2);
  if (!inertia_problem(repair.inertia).empty()) return {};
  repair.text = problem + "; taken: " + moments_text(repair.inertia);
  return repair;
}

}  // namespace tandem::model
