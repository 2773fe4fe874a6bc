#include <cmath>

#include "controllers/stance.hpp"
#include "tests/controllers/biped.hpp"
#include "tests/controllers/harness.hpp"

namespace tandem {
namespace {

/// Two point masses of 2 kg and 1 kg on rods of 0.5 m and 0.4 m, hanging down at q = 0.
void pendulum_bias(const double* q, const double*, double* h) {
  const double outer = 1.0 * 9.81 * 0.4 * std::sin(q[0] + q[1]);
  h[0] = 3.0 * 9.81 * 0.5 * std::sin(q[0]) + outer;
  h[1] = outer;
}

const tandem_kernels* pendulum() {
  static const char* const joints[] = {"upper", "lower"};
  static const tandem_kernels kernels = [] {
    tandem_kernels k{};
    k.sines = test::no_sines;
    k.robot = "pendulum";
    k.nq = k.nv = k.joints = 2;
    k.joint_names = joints;
    k.bias = pendulum_bias;
    k.bias_at = test::at_sines<pendulum_bias>;
    return k;
  }();
  return &kernels;
}

hal::RobotConfig pendulum_robot() {
  hal::RobotConfig robot = test::biped_robot();
  robot.joints.resize(2);
  robot.joints[0].name = "lower";  // the image's order is not the model's
  robot.joints[1].name = "upper";
  return robot;
}

TEST(GravityCompensation, GivesTheWeightsTorqueOfAFixedBase) {
  test::Harness run(pendulum_robot(), "gravity_compensation", "mode = 'torque'\n", pendulum());
  ASSERT_EQ(run.problem(), "");
  EXPECT_EQ(run.setup.claims()[0].mode, hal::ControlMode::kTorque);
  run.state.position_rad()[0] = 0.3;
  run.state.position_rad()[1] = 0.7;
  run.state.torque_Nm()[1] = 5.0;
  run.start();
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.torque_Nm()[1], 5.0) << "from the measured torque, without a jump";
  ASSERT_EQ(run.run(1.5), Code::kOk);
  const double outer = 9.81 * 0.4 * std::sin(1.0);
  EXPECT_NEAR(run.command.torque_Nm()[0], outer, 1e-12);
  EXPECT_NEAR(run.command.torque_Nm()[1], 3.0 * 9.81 * 0.5 * std::sin(0.7) + outer, 1e-12);
}

TEST(GravityCompensation, AddsTheTorquesThatItIsToldWhereAskedFor) {
  test::Harness run(pendulum_robot(), "gravity_compensation", "mode = 'torque'\neffort = true\n",
                    pendulum());
  ASSERT_EQ(run.problem(), "");
  ASSERT_EQ(run.setup.io->inputs.all.size(), 1U);
  InputBlock& input = run.setup.io->inputs.all.front();
  EXPECT_EQ(input.components, (std::vector<std::string>{"lower", "upper"}));
  EXPECT_EQ(input.options.max, (std::vector<double>{200.0, 200.0}));
  run.state.position_rad()[0] = 0.3;
  run.start();
  ASSERT_EQ(run.run(1.5), Code::kOk);
  const double weight = run.command.torque_Nm()[0];
  input.value = {7.0, 0.0};
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_NEAR(run.command.torque_Nm()[0], weight + 7.0, 1e-12);
  test::Harness without(pendulum_robot(), "gravity_compensation", "mode = 'torque'\n", pendulum());
  EXPECT_TRUE(without.setup.io->inputs.all.empty());
}

TEST(GravityCompensation, YieldsAboutTheStartPostureWhenCompliant) {
  test::Harness run(pendulum_robot(), "gravity_compensation", "stiffness_Nm_rad = 12.5\n",
                    pendulum());
  ASSERT_EQ(run.problem(), "");
  EXPECT_EQ(run.setup.claims()[0].interaction, hal::InteractionMode::kCompliant);
  run.state.position_rad()[0] = 0.3;
  run.state.torque_Nm()[0] = 3.0;
  run.start();
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.torque_Nm()[0], 3.0) << "what carries it now";
  run.state.position_rad()[0] = 0.4;  // pushed by hand
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.position_rad()[0], 0.3);
  EXPECT_EQ(run.command.stiffness_Nm_rad()[0], 12.5);
  EXPECT_EQ(run.command.damping_Nms_rad()[0], 20.0) << "the robot's own";
}

TEST(GravityCompensation, HasTheRobotsImpedanceUntilOneIsSet) {
  test::Harness run(pendulum_robot(), "gravity_compensation", "", pendulum());
  ASSERT_EQ(run.problem(), "");
  run.start();
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.damping_Nms_rad()[0], 20.0);
  run.set("damping_Nms_rad", 5.0);
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.damping_Nms_rad()[0], 5.0);
  EXPECT_EQ(run.command.damping_Nms_rad()[1], 5.0);
}

TEST(GravityCompensation, HasAnImpedanceOfItsOwnForEachJoint) {
  test::Harness run(pendulum_robot(), "gravity_compensation", "damping_Nms_rad = [4.0, 2.0]\n",
                    pendulum());
  ASSERT_EQ(run.problem(), "");
  run.start();
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.damping_Nms_rad()[0], 4.0);
  EXPECT_EQ(run.command.damping_Nms_rad()[1], 2.0);
  run.set("damping_Nms_rad." + run.robot.joints[1].name, 3.0);
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.damping_Nms_rad()[0], 4.0);
  EXPECT_EQ(run.command.damping_Nms_rad()[1], 3.0);
}

TEST(GravityCompensation, RefusesAStiffnessThatIsTooMuch) {
  EXPECT_EQ(test::Harness(pendulum_robot(), "gravity_compensation", "stiffness_Nm_rad = 1e6\n",
                          pendulum())
                .problem(),
            "experiment.toml:1: stiffness_Nm_rad: " + pendulum_robot().joints[0].name +
                ": 1e+06 is out of range (must be at least 0 and at "
                "most 1000)");
}

TEST(GravityCompensation, CarriesARobotThatStandsOnBothFeet) {
  test::Harness run(test::biped_robot(), "gravity_compensation", "", test::biped_kernels());
  ASSERT_EQ(run.problem(), "");
  Stance stance = Stance::make(run.robot, test::biped_kernels(), foot_names(run.robot)).value();
  const double height = stance.place(run.robot.postures[0].position_rad);
  ASSERT_TRUE(stance.solve(height, 50).converged);
  ASSERT_TRUE(stance.solve(height, 50).converged);
  stance.carry(std::vector<double>(test::kBipedNv));
  const ModelMap& map = stance.map();
  for (std::size_t j = 0; j < map.joints(); ++j) {
    run.state.position_rad()[j] = stance.q()[map.q_index(j)];
  }
  run.start();
  ASSERT_EQ(run.run(1.5), Code::kOk);
  for (std::size_t j = 0; j < map.joints(); ++j) {
    EXPECT_NEAR(run.command.torque_Nm()[j], stance.tau()[map.v_index(j)], 1e-6) << j;
  }
}

TEST(GravityCompensation, TurnsWithTheImu) {
  // The IMU sits on the left sole, which is level; the base then leans as its leg does.
  hal::RobotConfig robot = test::biped_robot();
  hal::SensorConfig& imu = robot.sensors.emplace_back();
  imu.name = "l_sole";
  imu.type = hal::SensorType::kImu;
  test::Harness run(robot, "gravity_compensation", "", test::biped_kernels());
  ASSERT_EQ(run.problem(), "");
  for (const char* ankle : {"LAnkSag", "RAnkSag"}) {
    run.state.position_rad()[static_cast<std::size_t>(robot.joint_index(ankle))] = 0.1;
  }
  run.state.sensor_values(0)[3] = 1.0;
  run.start();
  ASSERT_EQ(run.run(1.5), Code::kOk);
  std::vector<double> q(test::kBipedNv + 1), tau(test::kBipedNv), rest(test::kBipedNv);
  q[4] = std::sin(-0.05);
  q[6] = std::cos(-0.05);
  q[7 + 5] = q[7 + 12] = 0.1;
  test::biped_bias(q.data(), rest.data(), tau.data());
  std::vector<double> pose(24), twist(12), J(12 * test::kBipedNv);
  test::biped_site_motion(q.data(), nullptr, nullptr, pose.data(), twist.data(), rest.data());
  test::biped_site_jacobians(q.data(), J.data());
  Support support(
      find_feet(hal::robot_of(robot), *test::biped_kernels(), foot_names(hal::robot_of(robot)))
          .value());
  support.carry(*test::biped_kernels(), q, pose, J, tau);
  const int ankle = robot.joint_index("LAnkSag");
  EXPECT_NEAR(run.command.torque_Nm()[static_cast<std::size_t>(ankle)], tau[6 + 5], 1e-9);
}

}  // namespace
}  // namespace tandem
