#include "hal/sim/setup.hpp"

#include <algorithm>
#include <set>

namespace tandem::sim {
namespace {

hal::RobotConfig robot() {
  auto config = hal::read_robot_config(TANDEM_SOURCE_DIR "/config/coman/robot.toml");
  EXPECT_TRUE(config.has_value());
  for (hal::JointConfig& joint : config->joints) joint.max_torque_Nm = 50.0;
  return *config;
}

TEST(Setup, EveryJointIsOneAxisOfItsOwnBoard) {
  const hal::RobotConfig coman = robot();
  std::multiset<std::size_t> seen;
  for (std::size_t b = 0; b < coman.boards.size(); ++b) {
    const std::vector<std::size_t> joints = joints_of(coman, coman.boards[b]);
    EXPECT_EQ(board_setup(coman, b, 1).axes.size(), joints.size());
    for (std::size_t axis = 0; axis < joints.size(); ++axis) {
      EXPECT_EQ(coman.joints[joints[axis]].board, coman.boards[b].name);
      EXPECT_EQ(coman.joints[joints[axis]].axis, static_cast<int>(axis));
      seen.insert(joints[axis]);
    }
  }
  EXPECT_EQ(seen.size(), coman.joints.size());
  EXPECT_EQ(std::set<std::size_t>(seen.begin(), seen.end()).size(), coman.joints.size());
}

TEST(Setup, FirmwareKnowsTheMotorBehindItsJoint) {
  const hal::RobotConfig coman = robot();
  const firmware::AxisSetup hip = board_setup(coman, 0, 1).axes[0];
  EXPECT_NEAR(hip.parameters.motor_constant_Nm_A, 4.1, 1e-12);
  EXPECT_NEAR(hip.parameters.torque_to_voltage_V_Nm, 0.664 / 4.1, 1e-12);
  EXPECT_EQ(hip.parameters.spring_Nm_rad, 395.46);
  EXPECT_EQ(hip.parameters.voltage_limit_V, 40.0);
  EXPECT_EQ(hip.parameters.link_counts_per_rev, 262144.0);
}

TEST(Setup, EveryNodeDrawsNumbersOfItsOwn) {
  const hal::RobotConfig coman = robot();
  std::set<std::uint64_t> seeds;
  for (std::size_t b = 0; b < coman.boards.size(); ++b) {
    seeds.insert(board_setup(coman, b, 7).seed);
    seeds.insert(board_setup(coman, b, 8).seed);
  }
  for (std::size_t s = 0; s < coman.sensors.size(); ++s) {
    seeds.insert(sensor_setup(coman, s, 7).seed);
  }
  EXPECT_EQ(seeds.size(), 2 * coman.boards.size() + coman.sensors.size());
}

TEST(Setup, ModelHasRotorsOfRigidActuatorsOnly) {
  hal::RobotConfig coman = robot();
  EXPECT_TRUE(model_spec(coman).armature.empty());
  for (hal::ActuatorConfig& actuator : coman.actuators) actuator.order = 1;
  const model::ModelSpec spec = model_spec(coman);
  ASSERT_EQ(spec.armature.size(), coman.joints.size());
  EXPECT_EQ(spec.armature[0], (std::pair<std::string, double>{"LHipSag", 0.1387}));
}

TEST(Setup, ModelHasDerivativesWhereTheRobotAsksForThem) {
  hal::RobotConfig coman = robot();
  EXPECT_FALSE(model_spec(coman).derivatives);
  coman.model.derivatives = true;
  EXPECT_TRUE(model_spec(coman).derivatives);
}

TEST(Setup, ModelHasASiteForEveryImuAndAForceSensorForEveryJoint) {
  hal::RobotConfig coman = robot();
  model::ModelSpec spec = model_spec(coman);
  EXPECT_EQ(spec.sites.size(), coman.model.sites.size());  // the imu's frame is one of them
  ASSERT_EQ(spec.sensors.size(), 4U);
  for (const model::SensorSpec& sensor : spec.sensors) {
    const auto index = static_cast<std::size_t>(coman.sensor_index(sensor.name));
    EXPECT_EQ(sensor.joint, coman.sensors[index].joint);
    EXPECT_EQ(sensor.frame_link, coman.sensors[index].link);
  }
  std::erase_if(coman.model.sites, [](const hal::SiteConfig& s) { return s.link == "imu_link"; });
  coman.sensors.back().name = "head";
  spec = model_spec(coman);
  EXPECT_EQ(spec.sites.back().name, "head");
  EXPECT_EQ(spec.sites.back().link, "imu_link");
}

}  // namespace
}  // namespace tandem::sim
