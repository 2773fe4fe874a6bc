// The squat on the generated kernels of the robots that it is for.
#include <algorithm>
#include <cmath>

#include "controllers/feet.hpp"
#include "controllers/stance.hpp"
#include "tests/controllers/harness.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem {
namespace {

struct Case {
  const char* robot;
  double depth_m;
};

class SquatRobots : public testing::TestWithParam<Case> {
 protected:
  test::TestRobot loaded = test::load_test_robot(GetParam().robot);
  const std::vector<double>& posture = loaded.robot.posture("stand")->position_rad;
};

TEST_P(SquatRobots, InverseKinematicsHoldToRoundingAllTheWayDown) {
  Stance stance = Stance::make(hal::robot_of(loaded.robot), loaded.kernels.get(),
                               foot_names(hal::robot_of(loaded.robot)))
                      .value();
  const double height = stance.place(posture);
  ASSERT_TRUE(stance.solve(height, 50).converged);
  for (int i = 0; i <= 100; ++i) {
    const double down = GetParam().depth_m * i / 100.0;
    ASSERT_TRUE(stance.solve(height - down, 20).converged) << down;
    ASSERT_LT(stance.residual(), 1e-9) << down;
  }
}

TEST_P(SquatRobots, OneNewtonStepACycleIsEnough) {
  Stance stance = Stance::make(hal::robot_of(loaded.robot), loaded.kernels.get(),
                               foot_names(hal::robot_of(loaded.robot)))
                      .value();
  const double height = stance.place(posture);
  ASSERT_TRUE(stance.solve(height, 50).converged);
  const double rate = GetParam().depth_m / 2.0;
  for (int i = 1; i <= 2000; ++i) {
    stance.predict(1e-3);
    ASSERT_TRUE(stance.solve(height - rate * i * 1e-3, 2).converged) << i;
    stance.move(-rate);
    if (i > 1) {
      ASSERT_LT(stance.residual(), 1e-9) << i;
    }
  }
}

TEST_P(SquatRobots, TorquesLeaveNothingForTheBase) {
  // The same torques and the ground's wrenches, through inverse dynamics once more.
  Stance stance = Stance::make(hal::robot_of(loaded.robot), loaded.kernels.get(),
                               foot_names(hal::robot_of(loaded.robot)))
                      .value();
  const double height = stance.place(posture);
  const tandem_kernels& kernels = *loaded.kernels;
  ASSERT_TRUE(stance.solve(height - GetParam().depth_m, 50).converged);
  ASSERT_TRUE(stance.solve(height - GetParam().depth_m, 50).converged);
  const std::vector<double> rest(kernels.nv);
  stance.carry(rest);
  std::vector<double> M(kernels.nv * kernels.nv), wrench(6 * kernels.wrenches);
  const double share = kernels.mass_kg * 9.81 / kernels.wrenches;
  double middle = 0.0;  // of the contact points, ahead of the sole's origin
  for (const auto& point : loaded.robot.contact.feet[0].points_m) {
    middle += point[0] / static_cast<double>(loaded.robot.contact.feet[0].points_m.size());
  }
  std::vector<double> pose(12 * kernels.sites), twist(6 * kernels.sites), acceleration(twist);
  kernels.site_motion(stance.q().data(), rest.data(), rest.data(), pose.data(), twist.data(),
                      acceleration.data());
  const auto feet =
      find_feet(hal::robot_of(loaded.robot), kernels, foot_names(hal::robot_of(loaded.robot)))
          .value();
  for (std::size_t w = 0; w < feet.size(); ++w) {
    for (std::size_t i = 0; i < 3; ++i) wrench[6 * w + i] = share * pose[12 * feet[w].site + 6 + i];
    wrench[6 * w + 4] = -middle * share;  // of a sole, whose site is upright
  }
  std::vector<double> tau(kernels.nv);
  kernels.inverse_dynamics(stance.q().data(), rest.data(), rest.data(), wrench.data(), tau.data());
  for (std::size_t i = 0; i < kernels.nv; ++i) EXPECT_NEAR(stance.tau()[i], tau[i], 1e-6) << i;
}

TEST_P(SquatRobots, TheWholeSquatRunsWithinEveryLimit) {
  const std::string parameters = "depth_m = " + std::to_string(GetParam().depth_m) +
                                 "\nperiod_s = 7.0\nposture = 'stand'\nsettle_s = 0.5\n";
  test::Harness run(loaded.robot, "squat", parameters, loaded.kernels.get());
  ASSERT_EQ(run.problem(), "");
  std::ranges::copy(posture, run.state.position_rad().begin());
  run.start();
  Code code = Code::kOk;
  while (code == Code::kOk) {
    code = run.step();
    for (std::size_t j = 0; j < run.robot.joints.size(); ++j) {
      const hal::DrivenJoint& joint = run.robot.joints[j];
      ASSERT_GE(run.command.position_rad()[j], joint.min_position_rad) << joint.name;
      ASSERT_LE(run.command.position_rad()[j], joint.max_position_rad) << joint.name;
      ASSERT_LE(std::abs(run.command.velocity_rad_s()[j]), joint.max_velocity_rad_s);
      ASSERT_LE(std::abs(run.command.torque_Nm()[j]), joint.max_torque_Nm) << joint.name;
    }
  }
  EXPECT_EQ(code, Code::kStopped);
  EXPECT_EQ(run.time.time_ns, 8'501'000'000);
}

INSTANTIATE_TEST_SUITE_P(Config, SquatRobots,
                         testing::Values(Case{"coman", 0.10}, Case{"walkman", 0.30},
                                         Case{"anymal_c", 0.15}),
                         [](const auto& made) { return std::string(made.param.robot); });

}  // namespace
}  // namespace tandem
