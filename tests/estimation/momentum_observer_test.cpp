// The observer on arms without a compiler: what it finds of a push, and what of nothing.
#include "estimation/momentum_observer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/interpreted_kernels.hpp"
#include "model/urdf.hpp"

namespace tandem::estimation {
namespace {

using model::evaluate_kernel;
using model::Kernel;

constexpr double kCycle_s = 0.001, kBandwidth_Hz = 10.0;

/// The UR5e, in free motion by its own forward dynamics under a torque of choice.
struct Arm {
  Arm()
      : tree(model::read_urdf(TANDEM_SOURCE_DIR "/config/ur5e/ur5e.urdf", {})->tree),
        mechanism(*model::make_mechanism(tree, spec())),
        kernels(mechanism, "ur5e"),
        observer(*kernels.get(), kBandwidth_Hz, kCycle_s),
        q(6, 0.3),
        v(6, 0.0),
        tau(6, 0.0) {}
  static model::ModelSpec spec() {
    model::ModelSpec spec;
    spec.robot = "ur5e";
    spec.sites = {{"tool0", "tool0", {}, {}, false}};
    return spec;
  }
  /// The drives ask for accelerations of their own; `push` [rad/s2] is what somebody adds to them.
  void step(const std::vector<double>& push) {
    std::vector<double> wanted(6);
    for (std::size_t i = 0; i < 6; ++i)
      wanted[i] = 3.0 * std::sin(8.0 * t + static_cast<double>(i));
    tau = evaluate_kernel(Kernel::kInverseDynamics, mechanism, {q, v, wanted, {}})[0];
    const auto M = evaluate_kernel(Kernel::kMassMatrix, mechanism, {q})[0];
    std::vector<double> all = tau;
    external.assign(6, 0.0);
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) external[i] += M[6 * i + j] * push[j];
      all[i] += external[i];
    }
    observer.update(nullptr, q.data(), v.data(), tau.data(), nullptr);
    for (int fine = 0; fine < 4; ++fine) {
      const auto vdot = evaluate_kernel(Kernel::kForwardDynamics, mechanism, {q, v, all, {}})[0];
      for (std::size_t i = 0; i < 6; ++i) {
        v[i] += kCycle_s / 4.0 * vdot[i];
        q[i] += kCycle_s / 4.0 * v[i];
      }
    }
    t += kCycle_s;
  }

  model::Tree tree;
  model::Mechanism mechanism;
  model::InterpretedKernels kernels;
  MomentumObserver observer;
  std::vector<double> q, v, tau, external;
  double t = 0.0;
};

TEST(MomentumObserver, FindsNothingInFreeMotion) {
  Arm arm;
  double moved = 0.0;
  for (int i = 0; i < 1000; ++i) {
    arm.step(std::vector<double>(6, 0.0));
    for (std::size_t j = 0; j < 6; ++j) {
      // The torques, up to 30 Nm, are held over a cycle; the observer takes the mean of its ends.
      EXPECT_NEAR(arm.observer.residual()[j], 0.0, 0.08);
      moved = std::max(moved, std::abs(arm.v[j]));
    }
  }
  EXPECT_GT(moved, 0.3) << "it did move";
}

// Two poles at K: 26 % after 1 / K, whatever the motion.
TEST(MomentumObserver, SeesAPushThroughALowPassOfSecondOrder) {
  Arm arm;
  for (int i = 0; i < 100; ++i) arm.step(std::vector<double>(6, 0.0));
  const std::vector<double> push{2.0, -3.0, 4.0, 1.0, -5.0, 2.0};
  const double gain = 2.0 * std::numbers::pi * 1.5538 * kBandwidth_Hz;
  for (int i = 1; i <= 100; ++i) {
    arm.step(push);
    const double way = gain * kCycle_s * (i - 1);
    const double share = 1.0 - (1.0 + way) * std::exp(-way);
    for (std::size_t j = 0; j < 6; ++j)
      EXPECT_NEAR(arm.observer.residual()[j], share * arm.external[j],
                  0.05 * std::abs(arm.external[j]) + 0.05)
          << i;
  }
}

// Encoders' counts: velocities off by 0.01 rad/s to and fro, in every cycle. A low pass of first
// order lets K times the momentum of that through, a few Nm here.
TEST(MomentumObserver, TakesAwayTheNoiseOfVelocities) {
  Arm arm;
  constexpr double kOff_rad_s = 0.01;
  std::vector<double> worst(6, 0.0);
  for (int i = 0; i < 500; ++i) {
    const std::vector<double> noisy(6, i % 2 == 0 ? kOff_rad_s : -kOff_rad_s);
    arm.tau = evaluate_kernel(Kernel::kBias, arm.mechanism, {arm.q, arm.v})[0];
    arm.observer.update(nullptr, arm.q.data(), noisy.data(), arm.tau.data(), nullptr);
    for (std::size_t j = 0; i >= 300 && j < 6; ++j)
      worst[j] = std::max(worst[j], std::abs(arm.observer.residual()[j]));
  }
  const double gain = 2.0 * std::numbers::pi * 1.5538 * kBandwidth_Hz;
  const auto M = evaluate_kernel(Kernel::kMassMatrix, arm.mechanism, {arm.q})[0];
  for (std::size_t j = 0; j < 6; ++j) {
    double momentum = 0.0;
    for (std::size_t k = 0; k < 6; ++k) momentum += M[6 * j + k] * kOff_rad_s;
    EXPECT_LT(worst[j], 0.1 * gain * std::abs(momentum)) << j;
  }
}

TEST(MomentumObserver, StartsAgainAfterNumbersThatAreNotFinite) {
  Arm arm;
  for (int i = 0; i < 20; ++i) arm.step({2.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  EXPECT_GT(arm.observer.residual()[0], 1.0);
  std::vector<double> bad = arm.v;
  bad[3] = std::nan("");
  arm.observer.update(nullptr, arm.q.data(), bad.data(), arm.tau.data(), nullptr);
  for (const double r : arm.observer.residual()) EXPECT_EQ(r, 0.0);
  for (int i = 0; i < 20; ++i) arm.step({2.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  EXPECT_GT(arm.observer.residual()[0], 1.0);
}

}  // namespace
}  // namespace tandem::estimation
