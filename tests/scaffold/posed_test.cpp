// Kinematics and loads of a posture against the algorithms that the kernels are made from.
#include "scaffold/posed.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "model/dynamics.hpp"
#include "scaffold/posture.hpp"
#include "tests/scaffold/robots.hpp"

namespace tandem::scaffold {
namespace {

class PosedOnPublicRobots : public ::testing::TestWithParam<PublicRobot> {};

Eigen::VectorXd sample(const model::Tree& tree, int index) {
  const Bounds bounds = bounds_of(tree);
  Eigen::VectorXd q(bounds.lower.size());
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    q[j] =
        bounds.lower[j] + (bounds.upper[j] - bounds.lower[j]) * halton(index, static_cast<int>(j));
  }
  return q;
}

TEST_P(PosedOnPublicRobots, InertiaAndGravityAreThoseOfTheMassMatrixAndInverseDynamics) {
  const NewRobot robot = made(GetParam());
  const model::Tree& tree = robot.tree;
  model::ModelSpec spec;
  spec.floating_base = tree.floating_base;
  const auto mechanism = model::make_mechanism(tree, spec);
  ASSERT_TRUE(mechanism);
  for (int index = 0; index < 5; ++index) {
    const Eigen::VectorXd q = sample(tree, index);
    std::vector<double> all(mechanism->kernel_nq(), 0.0);
    if (tree.floating_base) all[6] = 1.0;
    for (int j = 0; j < mechanism->joint_count(); ++j) {
      if (!tree.joints[j].follows())
        all[mechanism->q_index(mechanism->coordinate_of[j].index)] = q[j];
    }
    const std::vector<double> still(mechanism->kernel_nv(), 0.0);
    const auto M = model::evaluate_kernel(model::Kernel::kMassMatrix, *mechanism, {all})[0];
    const auto bias = model::evaluate_kernel(model::Kernel::kBias, *mechanism, {all, still})[0];
    const Posed posed(tree, q);
    for (int j = 0; j < mechanism->joint_count(); ++j) {
      if (tree.joints[j].follows()) continue;
      const auto i =
          static_cast<std::size_t>(mechanism->v_index(mechanism->coordinate_of[j].index));
      const double diagonal = M[i * still.size() + i];
      EXPECT_NEAR(posed.inertia(j), diagonal, 1e-9 * (1.0 + diagonal)) << tree.joints[j].name;
      EXPECT_NEAR(posed.gravity_load(j), bias[i], 1e-9 * (1.0 + std::abs(bias[i])))
          << tree.joints[j].name;
    }
  }
}

TEST_P(PosedOnPublicRobots, WhatAcceleratesIsTheMassMatrixTimesTheAcceleration) {
  const NewRobot robot = made(GetParam());
  const model::Tree& tree = robot.tree;
  model::ModelSpec spec;
  spec.floating_base = tree.floating_base;
  const auto mechanism = model::make_mechanism(tree, spec);
  ASSERT_TRUE(mechanism);
  const auto nv = static_cast<std::size_t>(mechanism->kernel_nv());
  const Eigen::VectorXd q = sample(tree, 2);
  std::vector<double> all(mechanism->kernel_nq(), 0.0);
  if (tree.floating_base) all[6] = 1.0;
  Eigen::VectorXd qdd = Eigen::VectorXd::Zero(q.size());
  for (int j = 0; j < mechanism->joint_count(); ++j) {
    if (tree.joints[j].follows()) continue;
    all[mechanism->q_index(mechanism->coordinate_of[j].index)] = q[j];
    qdd[j] = 1.0 + 0.3 * j;
  }
  const auto M = model::evaluate_kernel(model::Kernel::kMassMatrix, *mechanism, {all})[0];
  const Eigen::VectorXd load = Posed(tree, q).inertial_load(qdd);
  for (int j = 0; j < mechanism->joint_count(); ++j) {
    if (tree.joints[j].follows()) continue;
    const std::size_t row = mechanism->v_index(mechanism->coordinate_of[j].index);
    double expected = 0.0;
    for (int k = 0; k < mechanism->joint_count(); ++k) {
      if (tree.joints[k].follows()) continue;
      expected += M[row * nv + mechanism->v_index(mechanism->coordinate_of[k].index)] * qdd[k];
    }
    EXPECT_NEAR(load[j], expected, 1e-9 * (1.0 + std::abs(expected))) << tree.joints[j].name;
  }
}

TEST_P(PosedOnPublicRobots, JacobiansAreTheDerivativesOfPositions) {
  const NewRobot robot = made(GetParam());
  const Eigen::VectorXd q = sample(robot.tree, 3);
  const int body = static_cast<int>(robot.tree.bodies.size()) - 1;
  const Posed here(robot.tree, q);
  const Eigen::Vector3d local(0.1, -0.2, 0.3);
  const auto at = [&](const Posed& posed) {
    return Eigen::Vector3d(posed.body(body).R * local + posed.body(body).p);
  };
  const Eigen::MatrixXd J = here.point_jacobian(body, at(here)), Jc = here.com_jacobian();
  constexpr double kStep = 1e-6;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    Eigen::VectorXd moved = q;
    moved[j] += kStep;
    const Posed there(robot.tree, moved);
    EXPECT_LT(((at(there) - at(here)) / kStep - J.col(j)).norm(), 1e-5);
    EXPECT_LT(((there.whole().com_m - here.whole().com_m) / kStep - Jc.col(j)).norm(), 1e-5);
  }
}

/// Values in a row, b^k of them: one lies in each of as many equal parts of 0 to 1, b the
/// dimension's prime.
TEST(Halton, FillsEveryDimensionEvenly) {
  for (const auto& [dimension, parts] : {std::pair{0, 32}, {1, 27}, {2, 25}, {23, 89}, {24, 32}}) {
    std::vector<int> values(static_cast<std::size_t>(parts));
    for (int index = 0; index < parts; ++index) {
      const double value = halton(index, dimension);
      ASSERT_GE(value, 0.0);
      ASSERT_LT(value, 1.0);
      ++values[static_cast<std::size_t>(value * parts + 1e-9)];
    }
    EXPECT_EQ(values, std::vector<int>(static_cast<std::size_t>(parts), 1)) << dimension;
  }
}

INSTANTIATE_TEST_SUITE_P(, PosedOnPublicRobots, ::testing::ValuesIn(kPublicRobots),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace tandem::scaffold
