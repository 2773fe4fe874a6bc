// COMAN in free flight, tumbling, its joints loose: what is conserved stays.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "base/archive.hpp"
#include "hal/sim/plant.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::sim {
namespace {

/// Energy [J], and momentum in W: linear [Ns], angular about the center of mass [Nms].
struct Conserved {
  double kinetic_J = 0.0, energy_J = 0.0;
  std::array<double, 6> momentum{};
};

Conserved conserved(const Plant& plant) {
  double energy[2];
  Conserved now;
  plant.kernels().energy(plant.q(), plant.v(), energy);
  plant.kernels().centroidal_momentum(plant.q(), plant.v(), now.momentum.data());
  now.kinetic_J = energy[0];
  now.energy_J = energy[0] + energy[1];
  return now;
}

class Flight : public testing::Test {
 protected:
  Flight() {
    config.kernels = coman.kernels.get();
    config.base_height_m = 100.0;
    for (std::size_t j = 0; j < config.kernels->joints; ++j)
      config.passive.push_back({.name = config.kernels->joint_names[j]});
  }
  /// Every rate is within 2 rad/s and m/s at first; wrists get up to 35 rad/s.
  Plant tumbling(std::uint32_t seed) {
    Result<Plant> plant = Plant::create(config);
    EXPECT_TRUE(plant) << plant.error().to_string();
    std::mt19937 random(seed);
    std::vector<double> q(plant->q(), plant->q() + plant->kernels().nq);
    std::vector<double> v(plant->kernels().nv);
    for (double& rate : v) rate = 4.0 * random() / 4294967295.0 - 2.0;
    plant->set_state(q, v);
    return std::move(*plant);
  }
  test::TestRobot coman = test::load_test_robot("coman");
  PlantConfig config;
};

TEST_F(Flight, KeepsEnergyAndMomentumByDefault) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    Plant plant = tumbling(seed);
    const Conserved start = conserved(plant);
    const double* angular = start.momentum.data() + 3;
    for (int ms = 1; ms <= 2000; ++ms) {
      ASSERT_EQ(plant.advance(1'000'000), Code::kOk) << plant.diverged_text();
      const Conserved now = conserved(plant);
      EXPECT_NEAR(now.energy_J, start.energy_J, 5e-4 * start.kinetic_J) << ms;
      const double mass_kg = plant.kernels().mass_kg, fallen_Ns = 9.81e-3 * ms * mass_kg;
      EXPECT_NEAR(now.momentum[2], start.momentum[2] - fallen_Ns, 1e-8 * mass_kg) << ms;
      const double lost = std::hypot(now.momentum[3] - angular[0], now.momentum[4] - angular[1],
                                     now.momentum[5] - angular[2]);
      EXPECT_LT(lost, 1e-8 * std::hypot(angular[0], angular[1], angular[2])) << ms;
    }
  }
}

// The joints' motion, which nothing corrects, is of second order; wrists whirl.
TEST_F(Flight, MovesItsJointsAsRungeKuttaDoes) {
  const auto after_a_second = [&](Integrator integrator, std::int64_t substep_ns) {
    config.integrator = integrator;
    config.substep_ns = substep_ns;
    Plant plant = tumbling(1);
    EXPECT_EQ(plant.advance(1'000'000'000), Code::kOk);
    return std::vector(plant.q(), plant.q() + plant.kernels().nq);
  };
  const auto exact = after_a_second(Integrator::kRungeKutta4, 125'000);
  const auto error = [&](std::int64_t substep_ns) {
    const auto q = after_a_second(Integrator::kLeapfrog, substep_ns);
    double most = 0.0;
    for (std::size_t i = 0; i < q.size(); ++i) most = std::max(most, std::abs(q[i] - exact[i]));
    return most;
  };
  const double usual = error(250'000);
  EXPECT_LT(usual, 1e-3);
  EXPECT_NEAR(usual / error(125'000), 4.0, 0.2);
}

TEST_F(Flight, GoesOnFromASnapshotBitByBit) {
  Plant one = tumbling(1), other = tumbling(2);
  ASSERT_EQ(one.advance(100'000'000), Code::kOk);
  Archive saved;
  one.archive(saved);
  ASSERT_EQ(one.advance(100'000'000), Code::kOk);
  Archive restored(saved.bytes());
  other.archive(restored);
  ASSERT_TRUE(restored.ok() && restored.at_end());
  ASSERT_EQ(other.advance(100'000'000), Code::kOk);
  for (std::uint32_t i = 0; i < one.kernels().nq; ++i) EXPECT_EQ(one.q()[i], other.q()[i]) << i;
}

}  // namespace
}  // namespace tandem::sim
