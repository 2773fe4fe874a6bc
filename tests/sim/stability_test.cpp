#include "hal/sim/stability.hpp"

#include <cmath>

#include "tests/sim/hand_kernels.hpp"

namespace tandem::sim {
namespace {

using test::block_kernels;
using test::pendulum_kernels;

PlantConfig elastic_pendulum(Integrator integrator) {
  PlantConfig config;
  config.kernels = pendulum_kernels<0, 0>();
  config.integrator = integrator;
  hal::ActuatorConfig motor;
  motor.name = "motor";
  motor.order = 2;
  motor.resistance_ohm = motor.torque_constant_Nm_A = 1.0;
  motor.inertia_kg_m2 = 0.5;
  motor.spring_Nm_rad = 1e4;
  motor.spring_damping_Nms_rad = 2.0;
  config.joints = {{"swing", motor, 0.0, 0.0}};
  return config;
}

// Whether the plant stays near rest after a short pulse of the motor.
bool stays(PlantConfig config, double step_s) {
  config.substep_ns = std::llround(step_s * 1e9);
  Plant plant = *Plant::create(config);
  plant.set_drive(0, 1e-3, true);
  if (plant.advance(config.substep_ns) != Code::kOk) return false;
  plant.set_drive(0, 0.0, true);
  return plant.advance(2000 * config.substep_ns) == Code::kOk && std::abs(plant.v()[0]) < 1e-2;
}

TEST(Stability, LeapfrogLimitIsExactOnOneElasticJoint) {
  PlantConfig config = elastic_pendulum(Integrator::kLeapfrog);
  config.substep_ns = 9'800'000;  // the dampers go by no predicted velocity in steps so long
  const StepLimit limit = longest_step(config, *Plant::create(config));
  // Link and rotor against each other: 0.25 kg m2 on spring and damper, h^2 k + 2 h d = 4 m.
  const double m = 0.25, k = 1e4, d = 2.0;
  EXPECT_NEAR(limit.seconds, (std::sqrt(d * d + 4.0 * m * k) - d) / k, 2e-3 * limit.seconds);
  EXPECT_TRUE(stays(config, 0.98 * limit.seconds));
  EXPECT_FALSE(stays(config, 1.02 * limit.seconds));
}

TEST(Stability, RungeKuttaLimitIsOnTheSafeSide) {
  const PlantConfig config = elastic_pendulum(Integrator::kRungeKutta4);
  const StepLimit limit = longest_step(config, *Plant::create(config));
  EXPECT_TRUE(stays(config, 0.98 * limit.seconds));
  EXPECT_FALSE(stays(config, 1.25 * limit.seconds));
}

// The current went to its limit and stayed there: 10 A at 1.3 V on 1 Ohm, and a run that looked
// well.
TEST(Stability, ACurrentIsNoFasterThanRungeKutta) {
  PlantConfig config = elastic_pendulum(Integrator::kRungeKutta4);
  config.joints[0].actuator.order = 3;
  config.joints[0].actuator.damping_Nms_rad = 2.0;
  config.joints[0].actuator.inductance_H = 80e-6;
  const StepLimit limit = longest_step(config, *Plant::create(config));
  EXPECT_NEAR(limit.seconds, 2.6 * 80e-6, 1e-9);
  EXPECT_EQ(limit.place, "the current of joint swing");
  const auto current_A = [&](double step_s) {  // at 1 V on 1 Ohm, the rotor held by the spring
    config.substep_ns = std::llround(step_s * 1e9);
    Plant plant = *Plant::create(config);
    plant.set_drive(0, 1.0, true);
    (void)plant.advance(400 * config.substep_ns);
    return std::abs(plant.joint(0).current_A);
  };
  EXPECT_LT(current_A(0.98 * limit.seconds), 3.0);
  EXPECT_GT(current_A(1.15 * limit.seconds), 100.0);
  config.integrator = Integrator::kLeapfrog;
  EXPECT_GT(longest_step(config, *Plant::create(config)).seconds, limit.seconds);
}

TEST(Stability, GroundUnderTheSolesCounts) {
  PlantConfig config;
  config.kernels = block_kernels<0>();
  const StepLimit free = longest_step(config, *Plant::create(config));
  EXPECT_TRUE(std::isinf(free.seconds));
  config.contact.stiffness_N_m = 20'000.0;
  config.contact.tangential_stiffness_N_m = 1.0;
  config.contact.static_friction = config.contact.sliding_friction = 0.5;
  config.contact.feet = {{"left", {{0.0, -0.1, 0.0}}}, {"right", {{0.0, 0.1, 0.0}}}};
  const StepLimit limit = longest_step(config, *Plant::create(config));
  // Both points below the centre of mass: 10 kg bounce on 40 kN/m.
  EXPECT_NEAR(limit.seconds, 2.0 * std::sqrt(10.0 / 40'000.0), 2e-3 * limit.seconds);
  EXPECT_EQ(limit.place, "the floating base");
}

}  // namespace
}  // namespace tandem::sim
