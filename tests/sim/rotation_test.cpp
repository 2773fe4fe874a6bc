#include "hal/sim/rotation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace tandem::sim {
namespace {

// Eigen's is the witness. Half turns about each axis take each branch of quaternion_of().
TEST(Rotation, AndItsQuaternionAreThoseOfAnotherProgram) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::vector<Eigen::Quaterniond> all{{0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}, {1, 0, 0, 0}};
  for (int i = 0; i < 100; ++i)
    all.emplace_back(any(random), any(random), any(random), any(random));
  for (Eigen::Quaterniond& expected : all) {
    expected.normalize();
    if (expected.w() < 0.0) expected.coeffs() *= -1.0;
    const Mat3 R = rotation_of(expected.coeffs().data());
    const Eigen::Matrix3d matrix = expected.toRotationMatrix();
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(R[i], matrix(i / 3, i % 3), 1e-15);
    const std::array<double, 4> q = quaternion_of(R.data());
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(q[i], expected.coeffs()[i], 1e-14) << expected;
  }
}

}  // namespace
}  // namespace tandem::sim
