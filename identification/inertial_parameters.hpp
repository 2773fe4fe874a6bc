// The ten inertial parameters of a link as numbers that the dynamics are linear in, and as the
// pseudo-inertia whose positive definiteness says whether such a body can exist.
// Layer: identification.  Thread: any.
#pragma once

#include <Eigen/Core>
#include <array>

#include "model/tree.hpp"

namespace tandem::identification {

/// m, h = m c (x y z) and the inertia about the origin (ixx ixy ixz iyy iyz izz) [kg, kg m, kg
/// m^2], from the origin and along the axes of the link's frame.
using LinkParameters = Eigen::Matrix<double, 10, 1>;
using Matrix10 = Eigen::Matrix<double, 10, 10>;

/// What the ten are called, with their unit.
inline constexpr std::array<const char*, 10> kParameterNames{
    "mass_kg",   "hx_kg_m",   "hy_kg_m",   "hz_kg_m",   "ixx_kg_m2",
    "ixy_kg_m2", "ixz_kg_m2", "iyy_kg_m2", "iyz_kg_m2", "izz_kg_m2"};

[[nodiscard]] LinkParameters parameters_of(const model::Inertia& inertia);
/// Mass, center of mass, inertia about it. @pre the mass is not 0
[[nodiscard]] model::Inertia inertia_of(const LinkParameters& parameters);

/// [[S, h], [h^T, m]] with the second moments S = tr(I)/2 1 - I: positive definite for every body
/// with volume, and only for such (Wensing, Kim, Slotine, 2018). It includes the triangle
/// inequalities.
[[nodiscard]] Eigen::Matrix4d pseudo_inertia(const LinkParameters& parameters);
[[nodiscard]] LinkParameters parameters_of(const Eigen::Matrix4d& pseudo_inertia);

/// The same body with a pseudo-inertia that is safely positive definite: of a body that is nowhere
/// thinner than a thirtieth of its length, nor than 1 mm. Possible bodies stay as they are.
[[nodiscard]] LinkParameters made_possible(const LinkParameters& parameters);

/// The natural metric at a possible body (Lee, Wensing, Park 2020: its constant pull-back): the
/// squared distance of p to p0 is (p - p0)^T G (p - p0) = |L^-1 P L^-T - 1|^2 with P0 = L L^T. It
/// depends neither on frames nor on units; a mass that grows by a tenth in place is at 0.2.
[[nodiscard]] Matrix10 natural_metric(const LinkParameters& at);

/// The log-Cholesky coordinates of a possible body (Rucker, Wensing 2022): any ten numbers are one.
/// P = L L^T, L lower triangular: the logarithms of its diagonal, then the six entries below.
[[nodiscard]] LinkParameters log_cholesky(const LinkParameters& possible);
/// The body of these coordinates, and its derivative by them.
[[nodiscard]] LinkParameters from_log_cholesky(const LinkParameters& coordinates,
                                               Matrix10& derivative);

}  // namespace tandem::identification
