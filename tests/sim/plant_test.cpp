#include "hal/sim/plant.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tests/sim/hand_kernels.hpp"

namespace tandem::sim {
namespace {

using test::block_kernels;
using test::kG;
using test::pendulum_kernels;

hal::ActuatorConfig coman(int order) {
  hal::ActuatorConfig c;
  c.name = "coman";
  c.order = order;
  c.resistance_ohm = 0.664;
  c.inductance_H = 0.32e-3;
  c.torque_constant_Nm_A = 0.041;
  c.gear_ratio = 100.0;
  c.inertia_kg_m2 = 0.139;
  c.damping_Nms_rad = 25.5;
  c.spring_Nm_rad = 395.46;
  c.spring_damping_Nms_rad = 0.198;
  c.voltage_limit_V = 40.0;
  c.current_limit_A = 50.0;
  return c;
}

PlantConfig pendulum(const tandem_kernels* kernels, int order, double start_rad) {
  PlantConfig config;
  config.kernels = kernels;
  config.joints = {{"swing", coman(order), start_rad, 0.0}};
  return config;
}

Plant make(const PlantConfig& config) {
  Result<Plant> plant = Plant::create(config);
  EXPECT_TRUE(plant) << plant.error().to_string();
  return std::move(*plant);
}

std::vector<double> state(const Plant& plant) {
  std::vector<double> x(plant.q(), plant.q() + plant.kernels().nq);
  x.insert(x.end(), plant.v(), plant.v() + plant.kernels().nv);
  return x;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

// Error exponent from a step and its half against a step of a sixteenth with order 4.
template <class Prepare>
double order_of(PlantConfig config, Integrator integrator, std::int64_t step_ns, Prepare prepare) {
  const auto run = [&](Integrator which, std::int64_t step) {
    config.integrator = which;
    config.substep_ns = step;
    Plant plant = make(config);
    prepare(plant);
    EXPECT_EQ(plant.advance(512'000'000), Code::kOk);
    return state(plant);
  };
  const std::vector<double> exact = run(Integrator::kRungeKutta4, step_ns / 16);
  return std::log2(distance(run(integrator, step_ns), exact) /
                   distance(run(integrator, step_ns / 2), exact));
}

TEST(Plant, IntegratorsConvergeWithTheirOrderOnAnElasticPendulum) {
  const auto prepare = [](Plant& plant) {
    plant.set_state(std::array{1.0}, std::array{0.5});
    plant.set_drive(0, 12.0, true);
  };
  for (const int order : {0, 2}) {
    const PlantConfig config =
        pendulum(order == 0 ? pendulum_kernels<139>() : pendulum_kernels<0>(), order, 0.0);
    EXPECT_NEAR(order_of(config, Integrator::kRungeKutta4, 1'600'000, prepare), 4.0, 0.25);
    EXPECT_NEAR(order_of(config, Integrator::kLeapfrog, 200'000, prepare), 2.0, 0.01);
  }
}

TEST(Plant, IntegratorsConvergeWithTheirOrderOnATumblingBlock) {
  PlantConfig config;
  config.kernels = block_kernels<0>();
  const auto prepare = [](Plant& plant) {
    plant.set_state(std::array{0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0},
                    std::array{0.5, 0.0, 1.0, 3.0, -2.0, 4.0});
  };
  EXPECT_NEAR(order_of(config, Integrator::kRungeKutta4, 8'000'000, prepare), 4.0, 0.25);
  EXPECT_NEAR(order_of(config, Integrator::kLeapfrog, 500'000, prepare), 2.0, 0.01);
}

TEST(Plant, FreeFlightKeepsMomentumAndFallsOnAParabola) {
  PlantConfig config;
  config.kernels = block_kernels<0>();
  config.integrator = Integrator::kRungeKutta4;
  Plant plant = make(config);
  plant.set_state(std::array{0.0, 0.0, 10.0, 0.0, 0.0, 0.0, 1.0},
                  std::array{1.0, 0.0, 2.0, 3.0, -2.0, 4.0});
  ASSERT_EQ(plant.advance(1'000'000'000), Code::kOk);
  EXPECT_NEAR(plant.q()[0], 1.0, 1e-9);
  EXPECT_NEAR(plant.q()[1], 0.0, 1e-9);
  EXPECT_NEAR(plant.q()[2], 10.0 + 2.0 - 0.5 * kG, 1e-9);
  const double* q = plant.q();
  EXPECT_NEAR(q[3] * q[3] + q[4] * q[4] + q[5] * q[5] + q[6] * q[6], 1.0, 1e-15);
  double R[9];
  test::block::rotation(q, R);
  const double* w = plant.v() + 3;
  const double body[3] = {0.1 * w[0], 0.2 * w[1], 0.25 * w[2]};
  double L[3];
  test::block::turn(R, body, L);
  const double start[3] = {0.3, -0.4, 1.0};
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(L[i], start[i], 1e-8);
}

// A body that nothing acts on, spinning fast: both integrators keep its velocity in W.
TEST(Plant, AFreeSpinningBodyFliesStraight) {
  for (const Integrator integrator : {Integrator::kLeapfrog, Integrator::kRungeKutta4}) {
    PlantConfig config;
    config.kernels = block_kernels<0>();
    config.integrator = integrator;
    Plant plant = make(config);
    plant.set_state(std::array{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0},
                    std::array{1.0, 0.0, 2.0, 13.0, -12.0, 14.0});
    ASSERT_EQ(plant.advance(2'000'000'000), Code::kOk);
    double R[9], velocity_W[3];
    test::block::rotation(plant.q(), R);
    test::block::turn(R, plant.v(), velocity_W);
    const double expected[3] = {1.0, 0.0, 2.0 - 2.0 * kG};
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(velocity_W[i], expected[i], 1e-6);
    EXPECT_NEAR(plant.q()[0], 2.0, 1e-6);
    EXPECT_NEAR(plant.q()[1], 0.0, 1e-6);
    // Error of order 1: h g t / 2 beside the parabola.
    EXPECT_NEAR(plant.q()[2], 4.0 - 2.0 * kG, 3e-3);
  }
}

TEST(Plant, PassivePendulumKeepsItsEnergy) {
  PlantConfig config = pendulum(pendulum_kernels<0>(), 0, 1.2);
  config.joints[0].actuator.damping_Nms_rad = 0.0;  // bridge off and no friction: a free joint
  for (const auto& [integrator, bound] :
       {std::pair{Integrator::kRungeKutta4, 1e-9}, std::pair{Integrator::kLeapfrog, 2e-6}}) {
    config.integrator = integrator;
    Plant plant = make(config);
    const auto energy = [&] {
      return 0.5 * test::pendulum::kInertia * plant.v()[0] * plant.v()[0] +
             test::kPendulumMass * kG * test::kPendulumLength * (1.0 - std::cos(plant.q()[0]));
    };
    const double start = energy();
    ASSERT_EQ(plant.advance(20'000'000'000), Code::kOk);
    EXPECT_NEAR(energy(), start, bound * start);
  }
}

// The spring's torque over a second after a step of voltage, against Runge-Kutta's in fine steps.
TEST(Plant, AVoltageStepOfAnElasticDriveIsExactTo1e4ByDefault) {
  for (const int order : {2, 3}) {
    const auto torque_Nm = [&](Integrator integrator, std::int64_t substep_ns) {
      PlantConfig config = pendulum(pendulum_kernels<0>(), order, 0.0);
      config.integrator = integrator;
      config.substep_ns = substep_ns;
      Plant plant = make(config);
      plant.set_drive(0, 10.0, true);
      std::vector<double> history;
      for (int ms = 0; ms < 1000; ++ms) {
        EXPECT_EQ(plant.advance(1'000'000), Code::kOk);
        plant.evaluate();
        history.push_back(plant.joint(0).torque_Nm);
      }
      return history;
    };
    const std::vector<double> exact = torque_Nm(Integrator::kRungeKutta4, 25'000);
    const PlantConfig usual;
    const double error = distance(torque_Nm(usual.integrator, usual.substep_ns), exact);
    EXPECT_LT(error, 1e-4 * distance(exact, std::vector(exact.size(), 0.0))) << order;
  }
}

TEST(Plant, RigidActuatorsFeelTheirRotorAsArmature) {
  // Weightless pendulum of 0.5 kg m2 with 0.139 of armature, 10 V: an exponential.
  Plant plant = make(pendulum(pendulum_kernels<139, 0>(), 0, 0.0));
  plant.set_drive(0, 10.0, true);
  ASSERT_EQ(plant.advance(40'000'000), Code::kOk);
  plant.evaluate();
  const double J = 0.639, kt_R = 4.1 / 0.664, D = 25.5;
  const double exact = kt_R * 10.0 / D * (1.0 - std::exp(-D / J * 0.04));
  EXPECT_NEAR(plant.joint(0).velocity_rad_s, exact, 1e-4 * exact);
  EXPECT_EQ(plant.joint(0).motor_position_rad, plant.joint(0).position_rad);
  EXPECT_EQ(plant.joint(0).motor_velocity_rad_s, plant.joint(0).velocity_rad_s);
}

TEST(Plant, JointDampingSlowsTheLinkAndIsNoSpringTorque) {
  PlantConfig config = pendulum(pendulum_kernels<0, 0>(), 2, 0.0);
  config.joints[0].damping_Nms_rad = 3.0;
  Plant plant = make(config);
  plant.set_state(std::array{0.0}, std::array{2.0});
  plant.evaluate();
  EXPECT_NEAR(plant.vdot()[0], -3.0 * 2.0 / test::pendulum::kInertia, 1e-12);
  EXPECT_NEAR(plant.joint(0).torque_Nm, 0.0, 1e-12);
}

TEST(Plant, StepsAreTheSameHoweverTheTimeIsCut) {
  for (const Integrator integrator : {Integrator::kLeapfrog, Integrator::kRungeKutta4}) {
    for (const int order : {0, 3}) {
      PlantConfig config = pendulum(pendulum_kernels<0>(), order, 0.7);
      config.integrator = integrator;
      Plant whole = make(config), cut = make(config);
      for (Plant* plant : {&whole, &cut}) plant->set_drive(0, 5.0, true);
      ASSERT_EQ(whole.advance(10'000'000), Code::kOk);
      for (int k = 0; k < 20; ++k) {
        cut.evaluate();  // sensors look at it in between
        ASSERT_EQ(cut.advance(500'000), Code::kOk);
      }
      EXPECT_EQ(state(whole), state(cut));
    }
  }
}

TEST(Plant, SnapshotGivesTheSameBytesAgain) {
  PlantConfig config;
  config.kernels = block_kernels<10>();
  config.contact.stiffness_N_m = config.contact.tangential_stiffness_N_m = 20'000.0;
  config.contact.damping_s_m = 3.0;
  config.contact.tangential_damping_Ns_m = 50.0;
  config.contact.static_friction = config.contact.sliding_friction = 0.1;
  config.contact.feet = {{"left", {{0.2, 0.0, 0.0}, {-0.2, 0.0, 0.0}}},
                         {"right", {{0.2, 0.0, 0.0}, {-0.2, 0.0, 0.0}}}};
  config.base_height_m = 0.07;
  Plant plant = make(config);
  ASSERT_EQ(plant.advance(150'000'000), Code::kOk);
  plant.evaluate();
  Archive saved;
  plant.archive(saved);
  const auto run_on = [&] {
    EXPECT_EQ(plant.advance(333'000'000), Code::kOk);
    Archive end;
    plant.archive(end);
    return std::vector<std::byte>(end.bytes().begin(), end.bytes().end());
  };
  const std::vector<std::byte> first = run_on();
  Archive restore(saved.bytes());
  plant.archive(restore);
  ASSERT_TRUE(restore.ok());
  EXPECT_TRUE(restore.at_end());
  EXPECT_EQ(run_on(), first);
}

TEST(Plant, DivergenceStopsItAndNamesJointAndTime) {
  PlantConfig config = pendulum(pendulum_kernels<0>(), 2, 0.5);
  config.joints[0].actuator.spring_Nm_rad = 4e8;  // far too stiff for the sub-step
  Plant plant = make(config);
  EXPECT_EQ(plant.diverged_text(), "");
  plant.set_state(std::array{0.5}, std::array{0.1});
  ASSERT_EQ(plant.advance(1'000'000'000), Code::kDiverged);
  const std::int64_t stopped = plant.time_ns();
  EXPECT_LT(stopped, 1'000'000'000);
  EXPECT_EQ(plant.advance(1'000'000), Code::kDiverged);
  EXPECT_EQ(plant.time_ns(), stopped);
  char time[32];
  std::snprintf(time, sizeof time, "at %.6f s", static_cast<double>(stopped) * 1e-9);
  EXPECT_NE(plant.diverged_text().find("joint swing"), std::string::npos);
  EXPECT_NE(plant.diverged_text().find(time), std::string::npos) << plant.diverged_text();
}

TEST(Plant, NotANumberCountsAsDiverged) {
  Plant plant = make(pendulum(pendulum_kernels<0>(), 2, 0.5));
  plant.set_state(std::array{std::numeric_limits<double>::quiet_NaN()}, std::array{0.0});
  EXPECT_EQ(plant.advance(1'000'000), Code::kDiverged);
}

TEST(Plant, HeldJointStartsAtRestUnderGravityAndStaysThere) {
  for (const int order : {0, 1, 2, 3}) {
    PlantConfig config =
        pendulum(order < 2 ? pendulum_kernels<139>() : pendulum_kernels<0>(), order, 1.0);
    config.held = true;
    Plant plant = make(config);
    ASSERT_EQ(plant.advance(2'000'000'000), Code::kOk);
    EXPECT_NEAR(plant.q()[0], 1.0, 1e-9) << "order " << order;
    plant.evaluate();
    const double load = test::kPendulumMass * kG * test::kPendulumLength * std::sin(1.0);
    EXPECT_NEAR(plant.joint(0).torque_Nm, load, 1e-6 * load) << "order " << order;
    plant.set_drive(0, 0.0, true);  // the bridge opens the brake: nothing holds it any more
    ASSERT_EQ(plant.advance(200'000'000), Code::kOk);
    EXPECT_LT(plant.q()[0], 1.0 - 1e-3) << "order " << order;
  }
}

TEST(Plant, HoistHoldsThenLetsDownSmoothly) {
  PlantConfig config;
  config.kernels = block_kernels<0>();
  config.contact.stiffness_N_m = config.contact.tangential_stiffness_N_m = 20'000.0;
  config.contact.damping_s_m = 3.0;
  config.contact.tangential_damping_Ns_m = 50.0;
  config.contact.static_friction = config.contact.sliding_friction = 0.9;
  config.contact.feet = {{"left", {{0.2, 0.0, 0.0}, {-0.2, 0.0, 0.0}}},
                         {"right", {{0.2, 0.0, 0.0}, {-0.2, 0.0, 0.0}}}};
  config.base_height_m = 0.051;  // 1 mm above the ground
  config.held = true;
  Plant plant = make(config);
  ASSERT_EQ(plant.advance(500'000'000), Code::kOk);
  EXPECT_NEAR(plant.q()[2], 0.051, 1e-12);
  EXPECT_FALSE(plant.released());
  plant.release();
  double fastest = 0.0;
  for (int k = 0; k < 1000; ++k) {
    EXPECT_EQ(plant.released(), false);
    ASSERT_EQ(plant.advance(1'000'000), Code::kOk);
    fastest = std::max(fastest, std::abs(plant.v()[2]));
  }
  EXPECT_TRUE(plant.released());
  EXPECT_LT(fastest, 0.05);
  ASSERT_EQ(plant.advance(1'000'000'000), Code::kOk);
  EXPECT_NEAR(plant.q()[2], 0.05 - test::kBlockMass * kG / 80'000.0, 1e-9);
}

TEST(Plant, ConfigurationErrorsNameTheJointOrSite) {
  PlantConfig config = pendulum(pendulum_kernels<0>(), 2, 0.0);
  config.joints[0].name = "swng";
  Result<Plant> plant = Plant::create(config);
  ASSERT_FALSE(plant);
  EXPECT_NE(plant.error().to_string().find("swing"), std::string::npos);
  config.joints.clear();
  plant = Plant::create(config);
  ASSERT_FALSE(plant);
  EXPECT_EQ(plant.error().key, "swing");
  config = pendulum(pendulum_kernels<0>(), 2, 0.0);
  config.contact.feet = {{"tip", {{0.0, 0.0, 0.0}}}};
  plant = Plant::create(config);
  ASSERT_FALSE(plant);
  EXPECT_EQ(plant.error().key, "contact.foot.tip");
  config = pendulum(pendulum_kernels<0>(), 2, 0.0);
  config.substep_ns = 0;
  EXPECT_FALSE(Plant::create(config));
}

// --- motor brakes ---

/// A pendulum at 1 rad, where gravity asks for 8.25 Nm, with a brake and neither friction nor
/// current.
PlantConfig braked(int order, double torque_Nm) {
  PlantConfig config =
      pendulum(order == 0 ? pendulum_kernels<139>() : pendulum_kernels<0>(), order, 1.0);
  config.joints[0].actuator.damping_Nms_rad = 0.0;
  config.joints[0].brake =
      hal::BrakeConfig{.torque_Nm = torque_Nm, .release_ms = 7, .engage_ms = 5};
  return config;
}

double gravity_Nm(double q) {
  return test::kPendulumMass * test::kG * test::kPendulumLength * std::sin(q);
}

TEST(PlantBrake, HoldsWithoutCreeping) {
  for (const int order : {0, 2}) {
    for (const Integrator integrator : {Integrator::kLeapfrog, Integrator::kRungeKutta4}) {
      PlantConfig config = braked(order, 20.0);  // the spring swings to twice the load at first
      config.integrator = integrator;
      config.joints[0].actuator.spring_damping_Nms_rad = 5.0;
      Plant plant = make(config);
      ASSERT_EQ(plant.advance(10'000'000'000), Code::kOk);
      const double motor_rad = plant.joint(0).motor_position_rad;
      EXPECT_NEAR(motor_rad, 1.0, 1.0e-3) << order;
      ASSERT_EQ(plant.advance(60'000'000'000), Code::kOk);
      EXPECT_NEAR(plant.joint(0).motor_position_rad, motor_rad, 1.0e-9) << order;
    }
  }
}

// Dry friction takes torque_Nm for every rad: nothing else does here.
TEST(PlantBrake, SlipsAboveItsTorqueAndTakesJustThatMuchEnergy) {
  for (const Integrator integrator : {Integrator::kLeapfrog, Integrator::kRungeKutta4}) {
    PlantConfig config = braked(0, 5.0);
    config.integrator = integrator;
    config.substep_ns = 50'000;
    Plant plant = make(config);
    ASSERT_EQ(plant.advance(200'000'000), Code::kOk);
    const double q = plant.q()[0], v = plant.v()[0];
    ASSERT_LT(q, 0.95) << "it slips";
    const double gained = gravity_Nm(std::numbers::pi / 2) * (std::cos(q) - std::cos(1.0));
    const double moving = 0.5 * (test::pendulum::kInertia + 0.139) * v * v;
    EXPECT_NEAR(moving, gained - 5.0 * (1.0 - q), 0.01 * gained);
  }
}

TEST(PlantBrake, NeverGivesEnergyHoweverItsCoilIsSwitched) {
  for (const int order : {0, 2}) {
    PlantConfig config = braked(order, 3.0);
    config.joints[0].brake->release_ms = config.joints[0].brake->engage_ms = 0;
    config.integrator = Integrator::kRungeKutta4;
    config.substep_ns = 50'000;
    Plant plant = make(config);
    const auto energy = [&] {
      const JointReading at = plant.joint(0);
      const double twist = order == 0 ? 0.0 : at.motor_position_rad - at.position_rad;
      const double link = test::pendulum::kInertia * at.velocity_rad_s * at.velocity_rad_s;
      const double rotor = 0.139 * at.motor_velocity_rad_s * at.motor_velocity_rad_s;
      return 0.5 * (link + rotor + 395.46 * twist * twist) -
             gravity_Nm(std::numbers::pi / 2) * std::cos(at.position_rad);
    };
    const double reach_J = 0.5 * 3.0 * 3.0 / (0.139 * std::pow(0.4 / 50.0e-6, 2));
    double last = energy();
    for (int k = 0; k < 3000; ++k) {
      plant.set_brake_coil(0, k * 7 % 13 < 6);
      ASSERT_EQ(plant.advance(1'000'000), Code::kOk);
      const double now = energy();
      EXPECT_LE(now, last + 2.0 * reach_J + 1.0e-6) << order << " at " << k;
      last = now;
    }
  }
}

TEST(PlantBrake, ObeysItsCoilAfterItsTimes) {
  Plant plant = make(braked(0, 20.0));
  ASSERT_TRUE(plant.brake_closed(0));
  plant.set_brake_coil(0, true);
  ASSERT_EQ(plant.advance(6'750'000), Code::kOk);
  EXPECT_TRUE(plant.brake_closed(0));
  ASSERT_EQ(plant.advance(250'000), Code::kOk);
  EXPECT_FALSE(plant.brake_closed(0));
  plant.set_brake_coil(0, false);
  ASSERT_EQ(plant.advance(4'750'000), Code::kOk);
  EXPECT_FALSE(plant.brake_closed(0));
  ASSERT_EQ(plant.advance(250'000), Code::kOk);
  EXPECT_TRUE(plant.brake_closed(0));
  plant.set_brake_coil(0, true);
  ASSERT_EQ(plant.advance(3'000'000), Code::kOk);
  plant.set_brake_coil(0, false);  // before it has opened
  ASSERT_EQ(plant.advance(20'000'000), Code::kOk);
  EXPECT_TRUE(plant.brake_closed(0));
}

}  // namespace
}  // namespace tandem::sim
