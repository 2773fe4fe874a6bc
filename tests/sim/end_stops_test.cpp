#include "hal/sim/end_stops.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "hal/sim/plant.hpp"
#include "tests/sim/hand_kernels.hpp"

namespace tandem::sim {
namespace {

constexpr double kEnd_rad = 0.8;

/// The pendulum without a motor, let go at `start_rad`, between its ends or without any.
Plant swing(double start_rad, bool ends, Integrator integrator = Integrator::kLeapfrog) {
  PlantConfig config;
  config.kernels = test::pendulum_kernels();
  config.passive = {{.name = "swing", .position_rad = 0.0}};
  config.integrator = integrator;
  if (ends) config.ranges = {{"swing", -kEnd_rad, kEnd_rad, 20.0}};
  Result<Plant> plant = Plant::create(config);
  EXPECT_TRUE(plant) << plant.error().to_string();
  const double q[1] = {start_rad}, v[1] = {0.0};
  plant->set_state(q, v);
  return std::move(*plant);
}

double energy_J(const Plant& plant) {
  const double q = plant.q()[0], v = plant.v()[0], l = test::kPendulumLength;
  return test::kPendulumMass * l * (0.5 * l * v * v - test::kG * std::cos(q)) +
         plant.end_stops().elastic_energy_J(plant.q());
}

TEST(EndStops, OfAJointThatDoesNotReachThemChangeNoBit) {
  for (const Integrator integrator : {Integrator::kLeapfrog, Integrator::kRungeKutta4}) {
    Plant with = swing(0.79, true, integrator), without = swing(0.79, false, integrator);
    for (int i = 0; i < 3000; ++i) {
      ASSERT_EQ(with.advance(1'000'000), Code::kOk);
      ASSERT_EQ(without.advance(1'000'000), Code::kOk);
      ASSERT_EQ(std::memcmp(with.q(), without.q(), sizeof(double)), 0) << i;
      ASSERT_EQ(std::memcmp(with.v(), without.v(), sizeof(double)), 0) << i;
    }
  }
}

TEST(EndStops, StopTheJointWithinTheDeclaredAmountAndTakeEnergyOut) {
  Plant plant = swing(0.0, true, Integrator::kRungeKutta4);
  const double q[1] = {0.0}, v[1] = {12.0};  // it would turn over
  plant.set_state(q, v);
  double last_J = energy_J(plant), most_rad = 0.0;
  const double first_J = last_J;
  for (int i = 0; i < 20'000; ++i) {
    ASSERT_EQ(plant.advance(250'000), Code::kOk);
    const double now_J = energy_J(plant);
    ASSERT_LE(now_J, last_J + 1e-6 * first_J) << "after " << i << " sub-steps";
    last_J = std::min(last_J, now_J);
    most_rad = std::max(most_rad, std::abs(plant.q()[0]));
  }
  EXPECT_GT(most_rad, kEnd_rad) << "it was reached";
  EXPECT_LT(most_rad, kEnd_rad + 0.05);
  EXPECT_LT(last_J, 0.3 * first_J);
}

TEST(EndStops, HoldAJointThatRestsOnOneAndNeverPullItBack) {
  const tandem_kernels& k = *test::pendulum_kernels();
  const JointRange range{"swing", -kEnd_rad, kEnd_rad, 20.0};
  const JointInertia inertia{0.5, 0.5};
  const EndStops stops(k, {&range, 1}, {&inertia, 1}, 250'000);
  for (const double side : {-1.0, 1.0}) {
    for (const double past : {1e-6, 1e-3, 0.02}) {
      for (const double rate : {-10.0, -0.1, 0.0, 0.1, 10.0}) {
        const double q = side * (kEnd_rad + past);
        double torque = 0.0;
        ASSERT_TRUE(stops.touched(&q));
        stops.add_torques(&q, &rate, &torque);
        EXPECT_LE(side * torque, 0.0) << q << " " << rate;
      }
    }
  }
  const double q = kEnd_rad + 0.001, still = 0.0;
  double torque = 0.0;
  stops.add_torques(&q, &still, &torque);
  EXPECT_NEAR(torque, -20.0, 1e-9) << "its drive's whole effort, a milliradian in";
}

}  // namespace
}  // namespace tandem::sim
