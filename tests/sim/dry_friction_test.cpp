// Dry friction of drives and of passive joints: exact while it slides, at rest it sticks.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "hal/sim/plant.hpp"
#include "tests/sim/hand_kernels.hpp"

namespace tandem::sim {
namespace {

constexpr double kFriction_Nm = 3.0;
constexpr double kRotor_kg_m2 = 0.1;
constexpr double kSubstep_s = 250e-6;
constexpr double kWidth_rad =
    kFriction_Nm * kSubstep_s * kSubstep_s / (0.16 * kRotor_kg_m2);  // docs/simulation.md

hal::ActuatorConfig drive(int order, double friction_Nm) {
  hal::ActuatorConfig a;
  a.name = "drive";
  a.order = order;
  a.resistance_ohm = 1.0;
  a.inductance_H = 1e-3;
  a.torque_constant_Nm_A = 0.1;
  a.gear_ratio = 10.0;
  a.inertia_kg_m2 = kRotor_kg_m2;
  a.damping_Nms_rad = 1.0;  // all of it back-EMF: none with the bridge off
  a.friction_Nm = friction_Nm;
  a.spring_Nm_rad = 400.0;
  a.spring_damping_Nms_rad = 0.5;
  a.current_limit_A = 50.0;
  a.voltage_limit_V = 48.0;
  return a;
}

/// The pendulum, its rotor the model's armature, with or without gravity.
Plant plant(const tandem_kernels* kernels, int order, double friction_Nm,
            Integrator integrator = Integrator::kLeapfrog) {
  PlantConfig config;
  config.kernels = kernels;
  config.integrator = integrator;
  config.joints = {{.name = "swing", .actuator = drive(order, friction_Nm)}};
  Result<Plant> made = Plant::create(config);
  EXPECT_TRUE(made) << made.error().to_string();
  return std::move(*made);
}

constexpr double kInertia_kg_m2 = test::pendulum::kInertia + kRotor_kg_m2;

/// Friction's spring is stiff, and holds up to F^2 / (2 k).
constexpr double kStored_J = 0.5 * kFriction_Nm * kWidth_rad;

class DryFriction : public ::testing::TestWithParam<Integrator> {};

TEST_P(DryFriction, SlowsWhatSlidesByExactlyItselfAndThenHoldsIt) {
  Plant sliding = plant(test::pendulum_kernels<100, 0>(), 0, kFriction_Nm, GetParam());
  const double start_rad_s = 2.0, slowing = kFriction_Nm / kInertia_kg_m2;
  sliding.set_state(std::array{0.0}, std::array{start_rad_s});
  ASSERT_EQ(sliding.advance(1'000'000), Code::kOk);  // its spring is taut by now
  double last = sliding.v()[0];
  while (last > 0.01) {
    ASSERT_EQ(sliding.advance(1'000'000), Code::kOk);
    ASSERT_NEAR((last - sliding.v()[0]) / 1e-3, slowing, 1e-9 * slowing);
    last = sliding.v()[0];
  }
  const double time_s = start_rad_s / slowing;
  EXPECT_NEAR(static_cast<double>(sliding.time_ns()) * 1e-9, time_s, 3e-3);
  EXPECT_NEAR(sliding.q()[0], 0.5 * start_rad_s * time_s, 2e-3 * time_s);
  ASSERT_EQ(sliding.advance(1'000'000'000), Code::kOk);
  const double rests_rad = sliding.q()[0];
  EXPECT_NEAR(sliding.v()[0], 0.0, 1e-9);
  ASSERT_EQ(sliding.advance(10'000'000'000), Code::kOk);
  EXPECT_NEAR(sliding.q()[0], rests_rad, 1e-12) << "it does not creep";
}

TEST_P(DryFriction, HoldsALoadBelowItWithoutCreepAndNoneAboveIt) {
  const double most_Nm = test::kPendulumMass * test::kG * test::kPendulumLength;
  for (const double share : {-0.99, -0.5, 0.3, 0.99}) {
    // Let go at once, more than half of it overshoots and slips a little before it sticks.
    const bool slips = std::abs(share) > 0.5;
    Plant resting = plant(test::pendulum_kernels<100>(), 0, kFriction_Nm, GetParam());
    const double q = std::asin(share * kFriction_Nm / most_Nm);
    resting.set_state(std::array{q}, std::array{0.0});
    ASSERT_EQ(resting.advance(1'000'000'000), Code::kOk);
    const double gave_rad = q - resting.q()[0];
    EXPECT_NEAR(gave_rad, share * kWidth_rad, slips ? 5e-4 : 0.05 * kWidth_rad) << share;
    ASSERT_EQ(resting.advance(60'000'000'000), Code::kOk);
    EXPECT_NEAR(q - resting.q()[0], gave_rad, 1e-9) << share << ", a minute later";
  }
  Plant loose = plant(test::pendulum_kernels<100>(), 0, kFriction_Nm, GetParam());
  loose.set_state(std::array{std::asin(1.1 * kFriction_Nm / most_Nm)}, std::array{0.0});
  const double from = loose.q()[0];
  ASSERT_EQ(loose.advance(1'000'000'000), Code::kOk);
  EXPECT_LT(loose.q()[0], from - 0.01);
}

TEST_P(DryFriction, OnlyTakesEnergy) {
  // The integrator's own change of energy comes and goes with the swing.
  const double integrator_J = GetParam() == Integrator::kRungeKutta4 ? 1e-4 : 2e-2;
  for (const int order : {0, 2}) {
    SCOPED_TRACE(order);
    const auto* kernels = order == 0 ? test::pendulum_kernels<100>() : test::pendulum_kernels<0>();
    Plant swinging = plant(kernels, order, kFriction_Nm, GetParam());
    swinging.set_state(std::array{2.5}, std::array{1.0});
    const auto energy_J = [&] {
      const double v = swinging.v()[0], rotor = swinging.joint(0).motor_velocity_rad_s;
      const double twist = swinging.joint(0).motor_position_rad - swinging.q()[0];
      const double spring = order == 0 ? 0.0 : 0.5 * 400.0 * twist * twist;
      return 0.5 * test::pendulum::kInertia * v * v + 0.5 * kRotor_kg_m2 * rotor * rotor + spring -
             test::kPendulumMass * test::kG * test::kPendulumLength * std::cos(swinging.q()[0]);
    };
    const double first_J = energy_J();
    double least_J = first_J;
    for (int i = 0; i < 20'000; ++i) {
      ASSERT_EQ(swinging.advance(250'000), Code::kOk);
      ASSERT_LE(energy_J(), least_J + kStored_J + integrator_J) << i;
      least_J = std::min(least_J, energy_J());
    }
    EXPECT_LT(least_J, first_J - 10.0);
    // A link on a spring rings on by the spring's own damping, with a time constant of 2 s.
    ASSERT_EQ(swinging.advance(60'000'000'000), Code::kOk);
    EXPECT_NEAR(swinging.v()[0], 0.0, 1e-6) << "it has come to rest";
  }
}

TEST_P(DryFriction, OfAPassiveJointIsAsExact) {
  PlantConfig config;
  config.kernels = test::pendulum_kernels<0, 0>();
  config.integrator = GetParam();
  config.passive = {{.name = "swing", .friction_Nm = kFriction_Nm}};
  Result<Plant> made = Plant::create(config);
  ASSERT_TRUE(made) << made.error().to_string();
  made->set_state(std::array{0.0}, std::array{2.0});
  ASSERT_EQ(made->advance(10'000'000), Code::kOk);
  const double before = made->v()[0];
  ASSERT_EQ(made->advance(50'000'000), Code::kOk);
  const double slowing = kFriction_Nm / test::pendulum::kInertia;
  EXPECT_NEAR((before - made->v()[0]) / 0.05, slowing, 1e-9 * slowing);
  ASSERT_EQ(made->advance(2'000'000'000), Code::kOk);
  EXPECT_NEAR(made->v()[0], 0.0, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Both, DryFriction,
                         ::testing::Values(Integrator::kLeapfrog, Integrator::kRungeKutta4));

/// Anchors are state: a run goes on from a snapshot to the same bits.
TEST(DryFrictionState, IsInSnapshots) {
  Plant one = plant(test::pendulum_kernels<100>(), 0, kFriction_Nm);
  one.set_state(std::array{1.0}, std::array{0.0});
  ASSERT_EQ(one.advance(100'000'000), Code::kOk);
  Archive out;
  one.archive(out);
  Plant other = plant(test::pendulum_kernels<100>(), 0, kFriction_Nm);
  Archive in(out.bytes());
  other.archive(in);
  ASSERT_EQ(one.advance(500'000'000), Code::kOk);
  ASSERT_EQ(other.advance(500'000'000), Code::kOk);
  EXPECT_EQ(std::memcmp(one.q(), other.q(), sizeof(double)), 0);
}

}  // namespace
}  // namespace tandem::sim
