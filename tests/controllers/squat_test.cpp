#include <cmath>

#include "controllers/min_jerk.hpp"
#include "controllers/stance.hpp"
#include "tests/controllers/biped.hpp"
#include "tests/controllers/harness.hpp"

namespace tandem {
namespace {

const char* const kSquat =
    "depth_m = 0.25\nperiod_s = 4.0\ncycles = 2\napproach_s = 0.5\nstart_s = 1.0\n";

TEST(MinJerk, IsTheClosedFormAndItsDerivatives) {
  EXPECT_EQ(min_jerk(-1.0).s, 0.0);
  EXPECT_EQ(min_jerk(2.0).s, 1.0);
  EXPECT_DOUBLE_EQ(min_jerk(0.5).s, 0.5);
  EXPECT_DOUBLE_EQ(min_jerk(0.5).ds, kMinJerkPeak);
  const double h = 1e-6;
  for (const double x : {0.1, 0.3, 0.7, 0.95}) {
    EXPECT_NEAR(min_jerk(x).ds, (min_jerk(x + h).s - min_jerk(x - h).s) / (2 * h), 1e-8);
    EXPECT_NEAR(min_jerk(x).dds, (min_jerk(x + h).ds - min_jerk(x - h).ds) / (2 * h), 1e-7);
  }
}

class StanceTest : public testing::Test {
 protected:
  hal::RobotConfig robot = test::biped_robot();
  Stance stance =
      Stance::make(hal::robot_of(robot), test::biped_kernels(), foot_names(hal::robot_of(robot)))
          .value();
  double height = stance.place(robot.postures[0].position_rad);
};

TEST_F(StanceTest, SolvesFourteenEquationsToRounding) {
  for (const double down : {0.0, 0.1, 0.2, 0.3}) {
    ASSERT_TRUE(stance.solve(height - down, 50).converged) << down;
    EXPECT_LT(stance.residual(), 1e-9) << down;
    const test::BipedPose at(stance.q().data());
    double c[3], cdot[3];
    std::vector<double> J(3 * 20);
    test::biped_center_of_mass(stance.q().data(), std::vector<double>(20).data(), c, cdot,
                               J.data());
    const Eigen::Vector3d middle = 0.5 * (at.sole(0) + at.sole(1));
    EXPECT_NEAR(c[0], middle.x() + 0.03, 1e-9);
    EXPECT_NEAR(c[1], middle.y(), 1e-9);
    EXPECT_NEAR(at.p[0].z() - middle.z(), height - down, 1e-9);
    EXPECT_TRUE(at.R[0].isIdentity(1e-12));
  }
}

TEST_F(StanceTest, IsPlacedBesideItsFeetWhenItsLegsLeanAside) {
  std::vector<double> aside = robot.postures[0].position_rad;
  for (const std::string side : {"L", "R"}) {
    aside[static_cast<std::size_t>(robot.joint_index(side + "HipLat"))] = 0.2;
    aside[static_cast<std::size_t>(robot.joint_index(side + "AnkLat"))] = -0.2;  // flat soles
  }
  stance.place(aside);
  EXPECT_LT(stance.slip_m(), 1e-9);
  const test::BipedPose at(stance.q().data());
  EXPECT_NEAR(std::abs(at.p[0].y()), (at.p[4].z() - at.p[6].z()) * std::tan(0.2), 1e-9);
}

TEST_F(StanceTest, KneeBendsByTheTriangleOfItsLeg) {
  ASSERT_TRUE(stance.solve(height - 0.25, 50).converged);
  const test::BipedPose at(stance.q().data());
  const double leg = (at.p[4] - at.p[6]).norm();  // hip to ankle
  const double knee = M_PI - std::acos(1.0 - leg * leg / (2.0 * 0.4 * 0.4));
  EXPECT_NEAR(stance.q()[7 + 4], knee, 1e-9);
}

TEST_F(StanceTest, VelocitiesAreTheDerivativeOfThePositions) {
  const double h = 1e-5;
  ASSERT_TRUE(stance.solve(height - 0.1 - h, 50).converged);
  const std::vector<double> before(stance.q().begin(), stance.q().end());
  ASSERT_TRUE(stance.solve(height - 0.1 + h, 50).converged);
  const std::vector<double> after(stance.q().begin(), stance.q().end());
  ASSERT_TRUE(stance.solve(height - 0.1, 50).converged);
  ASSERT_TRUE(stance.solve(height - 0.1, 50).converged);
  stance.move(1.0);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(stance.v()[i], (after[i] - before[i]) / (2 * h), 1e-6) << i;
  }
  for (std::size_t i = 6; i < 20; ++i) {
    EXPECT_NEAR(stance.v()[i], (after[i + 1] - before[i + 1]) / (2 * h), 1e-6) << i;
  }
}

TEST_F(StanceTest, TorquesAreInverseDynamicsWithHalfTheWeightOnEachFoot) {
  ASSERT_TRUE(stance.solve(height - 0.2, 50).converged);
  ASSERT_TRUE(stance.solve(height - 0.2, 50).converged);
  const std::vector<double> rest(20);
  stance.carry(rest);
  // Standing still, the ground's wrench at each sole is half the weight, about the sole's middle.
  const double half = 0.5 * test::kBipedMass * 9.81;
  const double moment = -0.03 * half;
  const double wrench[12] = {0, 0, half, 0, moment, 0, 0, 0, half, 0, moment, 0};
  std::vector<double> tau(20);
  test::biped_inverse_dynamics(stance.q().data(), rest.data(), rest.data(), wrench, tau.data());
  for (std::size_t i = 0; i < 20; ++i) EXPECT_NEAR(stance.tau()[i], tau[i], 1e-6) << i;
  EXPECT_GT(std::abs(stance.tau()[6 + 4]), 10.0) << "the knees carry";
}

TEST(Squat, GoesDownAndUpAndStandsAtTheEnd) {
  test::Harness run(test::biped_robot(), "squat", kSquat, test::biped_kernels());
  ASSERT_EQ(run.problem(), "");
  const std::vector<double> stand = run.robot.postures[0].position_rad;
  std::ranges::copy(stand, run.state.position_rad().begin());
  run.start();
  const std::size_t knee = static_cast<std::size_t>(run.robot.joint_index("LKneeSag"));
  ASSERT_EQ(run.run(1.0), Code::kOk);
  const double up = run.command.position_rad()[knee];
  double last = up, last_torque = run.command.torque_Nm()[knee];
  for (int i = 0; i < 2000; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    const double rate = (run.command.position_rad()[knee] - last) / 1e-3;
    ASSERT_NEAR(run.command.velocity_rad_s()[knee], rate, 2e-3) << i;
    ASSERT_NEAR(run.command.torque_Nm()[knee], last_torque, 0.2) << i;
    last = run.command.position_rad()[knee];
    last_torque = run.command.torque_Nm()[knee];
  }
  EXPECT_GT(last, up + 0.7) << "at the bottom";
  ASSERT_EQ(run.run(6.5), Code::kOk);
  EXPECT_NEAR(run.command.position_rad()[knee], up, 1e-7);
  EXPECT_EQ(run.command.velocity_rad_s()[knee], 0.0);
  const std::size_t arm = static_cast<std::size_t>(run.robot.joint_index("RArm"));
  EXPECT_EQ(run.command.position_rad()[arm], stand[arm]);
}

TEST(Squat, StartsFromTheMeasuredPosture) {
  test::Harness run(test::biped_robot(), "squat", kSquat, test::biped_kernels());
  ASSERT_EQ(run.problem(), "");
  std::ranges::copy(run.robot.postures[0].position_rad, run.state.position_rad().begin());
  const std::size_t ankle = static_cast<std::size_t>(run.robot.joint_index("LAnkSag"));
  run.state.position_rad()[ankle] += 0.02;
  const double measured = run.state.position_rad()[ankle];
  run.start();
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.position_rad()[ankle], measured);
  EXPECT_EQ(run.command.torque_Nm()[ankle], 0.0);
}

TEST(Squat, DampsTheSwingOfTheLegsLinksOnRequest) {
  test::Harness run(test::biped_robot(), "squat",
                    std::string(kSquat) + "link_damping_Nms_rad = 7.0\n", test::biped_kernels());
  ASSERT_EQ(run.problem(), "");
  std::ranges::copy(run.robot.postures[0].position_rad, run.state.position_rad().begin());
  run.start();
  for (double& velocity : run.state.velocity_rad_s()) velocity = 0.1;
  ASSERT_EQ(run.step(), Code::kOk);
  const auto torque = [&](const char* joint) {
    return run.command.torque_Nm()[static_cast<std::size_t>(run.robot.joint_index(joint))];
  };
  EXPECT_DOUBLE_EQ(torque("LKneeSag"), -0.7);
  EXPECT_DOUBLE_EQ(torque("RAnkLat"), -0.7);
  EXPECT_EQ(torque("LArm"), 0.0);
}

TEST(Squat, StopsAfterItsSettleTime) {
  test::Harness run(test::biped_robot(), "squat",
                    "depth_m = 0.1\nperiod_s = 1\napproach_s = 0.2\nsettle_s = 0.3\n",
                    test::biped_kernels());
  ASSERT_EQ(run.problem(), "");
  std::ranges::copy(run.robot.postures[0].position_rad, run.state.position_rad().begin());
  run.start();
  EXPECT_EQ(run.run(10.0), Code::kStopped);
  EXPECT_EQ(run.time.time_ns, 1'501'000'000);
}

TEST(Squat, FaultsWhenTheMeasuredPostureCannotStand) {
  test::Harness run(test::biped_robot(), "squat", kSquat, test::biped_kernels());
  run.state.position_rad()[static_cast<std::size_t>(run.robot.joint_index("LHipSag"))] = 1.5;
  run.state.position_rad()[static_cast<std::size_t>(run.robot.joint_index("RHipSag"))] = -1.5;
  run.start();
  EXPECT_EQ(run.step(), Code::kFault);
}

TEST(Squat, SaysHowDeepItReaches) {
  hal::RobotConfig robot = test::biped_robot();
  robot.joints[static_cast<std::size_t>(robot.joint_index("LKneeSag"))].max_position_rad = 1.0;
  const std::string problem =
      test::Harness(robot, "squat", kSquat, test::biped_kernels()).problem();
  EXPECT_TRUE(problem.starts_with("experiment.toml:1: depth_m: only 0.0")) << problem;
  EXPECT_NE(problem.find("joint 'LKneeSag' leaves its limits"), std::string::npos) << problem;

  robot = test::biped_robot();
  robot.joints[static_cast<std::size_t>(robot.joint_index("RKneeSag"))].max_torque_Nm = 30.0;
  EXPECT_NE(test::Harness(robot, "squat", kSquat, test::biped_kernels())
                .problem()
                .find("joint 'RKneeSag' is too weak"),
            std::string::npos);
  EXPECT_NE(test::Harness(test::biped_robot(), "squat", "depth_m = 0.25\nperiod_s = 0.2\n",
                          test::biped_kernels())
                .problem()
                .find("is too slow for this period"),
            std::string::npos);
  // At its start the posture was blamed, and one with more bent knees asked for.
  const std::string fast = test::Harness(test::biped_robot(), "squat",
                                         "depth_m = 0.05\nperiod_s = 0.02\n", test::biped_kernels())
                               .problem();
  EXPECT_TRUE(fast.starts_with("experiment.toml:2: period_s: joint '")) << fast;
  EXPECT_NE(fast.find("0.000 m down (give at least "), std::string::npos) << fast;
}

TEST(Squat, RefusesARobotThatCannotSquat) {
  EXPECT_NE(test::Harness(test::biped_robot(), "squat", kSquat)
                .problem()
                .find("needs the robot's generated model"),
            std::string::npos);
  EXPECT_NE(test::Harness(test::biped_robot(), "squat", std::string(kSquat) + "feet = ['l_sloe']\n",
                          test::biped_kernels())
                .problem()
                .find("has no foot 'l_sloe' (did you mean 'l_sole'?)"),
            std::string::npos);
  hal::RobotConfig robot = test::biped_robot();
  robot.joints.pop_back();
  robot.postures.clear();
  EXPECT_NE(test::Harness(robot, "squat", kSquat, test::biped_kernels())
                .problem()
                .find("joint 'LArm' of the model is not driven"),
            std::string::npos);
}

TEST(Squat, GoesOnFromASnapshotAsTheSameBits) {
  test::Harness run(test::biped_robot(), "squat", kSquat, test::biped_kernels());
  std::ranges::copy(run.robot.postures[0].position_rad, run.state.position_rad().begin());
  run.start();
  ASSERT_EQ(run.run(2.0), Code::kOk);
  Archive saved;
  run.controller().archive(saved);
  test::Harness other(test::biped_robot(), "squat", kSquat, test::biped_kernels());
  Archive restored(saved.bytes());
  other.controller().archive(restored);
  ASSERT_TRUE(restored.ok() && restored.at_end());
  other.time = run.time;
  ASSERT_EQ(run.run(0.5), Code::kOk);
  ASSERT_EQ(other.run(0.5), Code::kOk);
  EXPECT_TRUE(std::ranges::equal(other.command.position_rad(), run.command.position_rad()));
  EXPECT_TRUE(std::ranges::equal(other.command.torque_Nm(), run.command.torque_Nm()));
}

}  // namespace
}  // namespace tandem
