#include "hal/sim/sensors.hpp"

#include <array>
#include <cmath>

#include "tests/sim/hand_kernels.hpp"

namespace tandem::sim {
namespace {

using test::block_kernels;
using test::kBlockMass;
using test::kG;
using test::pendulum_kernels;

// The block with a force/torque sensor in each foot and an IMU; image order right before left, so
// that an index mixed up with the kernels' shows.
hal::RobotConfig block_robot() {
  hal::RobotConfig robot;
  robot.model.floating_base = true;
  robot.model.sites = {{{.name = "left", .link = "l", .wrench = true}},
                       {{.name = "right", .link = "r", .wrench = true}},
                       {{.name = "imu", .link = "imu_link"}}};
  hal::SensorConfig sensor;
  sensor.name = "right_ft";
  robot.sensors.push_back(sensor);
  sensor.name = "left_ft";
  robot.sensors.push_back(sensor);
  sensor.name = "torso_imu";
  sensor.type = hal::SensorType::kImu;
  sensor.link = "imu_link";
  robot.sensors.push_back(sensor);
  return robot;
}

PlantConfig block_config() {
  PlantConfig config;
  config.kernels = block_kernels<0>();
  config.contact.stiffness_N_m = config.contact.tangential_stiffness_N_m = 20'000.0;
  config.contact.damping_s_m = 3.0;
  config.contact.tangential_damping_Ns_m = 50.0;
  config.contact.static_friction = config.contact.sliding_friction = 0.9;
  return config;
}

std::array<double, 22> sample(Plant& plant) {
  Sensors sensors = *Sensors::create(block_robot(), plant.kernels());
  EXPECT_EQ(sensors.channels(), 22U);
  std::array<double, 22> channels{};
  plant.evaluate();
  sensors.sample(plant, channels);
  return channels;
}

TEST(Sensors, EachFootReadsItsOwnLeg) {
  PlantConfig config = block_config();
  // The left sole reaches 3 cm outwards, the right one 6 cm: they carry the weight 16 to 13.
  const double left = 0.03, right = -0.06;
  config.contact.feet = {{"left", {{0.1, left, 0.0}, {-0.1, left, 0.0}}},
                         {"right", {{0.1, right, 0.0}, {-0.1, right, 0.0}}}};
  config.base_height_m = 0.05;
  Plant plant = *Plant::create(config);
  ASSERT_EQ(plant.advance(20'000'000'000), Code::kOk);
  const std::array<double, 22> channels = sample(plant);
  const double* right_ft = channels.data();
  const double* left_ft = channels.data() + 6;
  const double weight = kBlockMass * kG;
  // Level within 0.2 mm over 29 cm: first order in the tilt is below the bounds.
  EXPECT_NEAR(left_ft[2], weight * 16.0 / 29.0, 2e-3 * weight);
  EXPECT_NEAR(right_ft[2], weight * 13.0 / 29.0, 2e-3 * weight);
  EXPECT_NEAR(left_ft[2] + right_ft[2], weight, 1e-3 * weight);
  EXPECT_NEAR(left_ft[3], left * left_ft[2], 2e-3 * weight);  // pressed outside: +x moment
  EXPECT_NEAR(right_ft[3], right * right_ft[2], 2e-3 * weight);
  EXPECT_GT(left_ft[3], 0.0);
  EXPECT_LT(right_ft[3], 0.0);
}

TEST(Sensors, ImuAtRestFeelsGravityUpwardsInItsOwnFrame) {
  PlantConfig config = block_config();
  config.base_height_m = 1.0;
  config.held = true;  // hangs, so that it feels its weight
  Plant plant = *Plant::create(config);
  const std::array<double, 22> channels = sample(plant);
  const double* imu = channels.data() + 12;
  const double root = std::sqrt(0.5);  // the site is turned by 90 degrees about x
  const double expected[10] = {root, 0, 0, root, 0, 0, 0, 0, kG, 0};
  for (std::size_t i = 0; i < 10; ++i) EXPECT_NEAR(imu[i], expected[i], 1e-12) << "channel " << i;
}

TEST(Sensors, ImuInFreeFallFeelsNothing) {
  Plant plant = *Plant::create(block_config());
  const std::array<double, 22> channels = sample(plant);
  for (std::size_t i = 16; i < 22; ++i) EXPECT_NEAR(channels[i], 0.0, 1e-12) << "channel " << i;
}

TEST(Sensors, ImuTellsAngularRateFromSpecificForce) {
  // Spins at 4 rad/s about its z axis in free fall: rate about the sensor's y, and the
  // centripetal acceleration of (0.05, 0.02, 0.1) towards the axis; no angular acceleration.
  Plant plant = *Plant::create(block_config());
  plant.set_state(std::array{0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0},
                  std::array{0.0, 0.0, 0.0, 0.0, 0.0, 4.0});
  const std::array<double, 22> channels = sample(plant);
  const double* imu = channels.data() + 12;
  const double expected[6] = {0, 4.0, 0, -16.0 * 0.05, 0, 16.0 * 0.02};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(imu[4 + i], expected[i], 1e-12) << "channel " << i;
}

TEST(Sensors, ImuAccelerationIsLinear) {
  // A pendulum let go at 90 degrees: its tip starts with g along gravity, so it feels nothing,
  // while its angular acceleration is -g / l.
  PlantConfig config;
  config.kernels = pendulum_kernels<0>();
  hal::ActuatorConfig rigid;
  rigid.name = "rigid";
  rigid.order = 0;
  rigid.resistance_ohm = rigid.torque_constant_Nm_A = rigid.inertia_kg_m2 = 1.0;
  config.joints = {{"swing", rigid, std::numbers::pi / 2.0, 0.0}};
  Plant plant = *Plant::create(config);
  hal::RobotConfig robot;
  hal::SensorConfig imu;
  imu.name = "tip";
  imu.type = hal::SensorType::kImu;
  imu.link = "mass";
  robot.sensors = {imu};
  Sensors sensors = *Sensors::create(robot, plant.kernels());
  std::array<double, 10> channels{};
  plant.evaluate();
  ASSERT_NEAR(plant.vdot()[0], -kG / test::kPendulumLength, 1e-12);
  sensors.sample(plant, channels);
  for (std::size_t i = 4; i < 10; ++i) EXPECT_NEAR(channels[i], 0.0, 1e-12) << "channel " << i;
}

TEST(Sensors, UnknownSensorsAreNamed) {
  hal::RobotConfig robot = block_robot();
  robot.sensors[0].name = "rigth_ft";
  const Result<Sensors> sensors = Sensors::create(robot, *block_kernels<0>());
  ASSERT_FALSE(sensors);
  EXPECT_EQ(sensors.error().key, "sensor.rigth_ft");
  EXPECT_NE(sensors.error().hint.find("right_ft"), std::string::npos);
}

}  // namespace
}  // namespace tandem::sim
