// Drives and gains by the rules of docs/robots.md, computed here from the other side.
#include "scaffold/drives.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "scaffold/contact_points.hpp"
#include "tests/scaffold/robots.hpp"

namespace tandem::scaffold {
namespace {

class DrivesOfPublicRobots : public ::testing::TestWithParam<PublicRobot> {};

TEST_P(DrivesOfPublicRobots, ReachEffortAndSpeedAtOnceWithinTheirLimits) {
  const NewRobot robot = made(GetParam());
  for (const hal::JointConfig& joint : robot.config.joints) {
    const hal::ActuatorConfig& a = robot.config.actuator_of(joint);
    const double motor_constant = a.gear_ratio * a.torque_constant_Nm_A;
    const double current = joint.max_torque_Nm / motor_constant;
    EXPECT_LT(current, a.current_limit_A) << joint.name;
    EXPECT_LT(a.resistance_ohm * current + motor_constant * joint.max_velocity_rad_s,
              a.voltage_limit_V)
        << joint.name;
    EXPECT_GE(a.damping_Nms_rad, motor_constant * motor_constant / a.resistance_ohm) << joint.name;
  }
  EXPECT_LE(robot.drives.size(), 6U) << "a file of a few sizes";
}

/// What passes through the velocity estimate, 1.64 ms late, is unstable from a crossover of
/// pi / 2 / 1.64 ms on; half of that is kept with any load that a joint may have.
TEST_P(DrivesOfPublicRobots, KeepTheirDistanceFromWhatLagMakesUnstable) {
  constexpr double kUnstable_rad_s = 958.0;
  const NewRobot robot = made(GetParam());
  const Bounds bounds = bounds_of(robot.tree);
  for (const Eigen::VectorXd& q :
       {bounds.lower, bounds.upper, neutral_posture(robot.tree), waiting_posture(robot.tree)}) {
    const Posed posed(robot.tree, q);
    for (const hal::JointConfig& joint : robot.config.joints) {
      const hal::ActuatorConfig& a = robot.config.actuator_of(joint);
      const hal::GainsConfig& g = robot.config.gains_of(joint);
      const double emf = std::pow(a.gear_ratio * a.torque_constant_Nm_A, 2.0) / a.resistance_ohm;
      const double delayed = g.position.gains.kd - g.emf_compensation * emf;
      const double inertia = a.inertia_kg_m2 + posed.inertia(robot.tree.joint_index(joint.name));
      EXPECT_LT(delayed / inertia, kUnstable_rad_s / 2.0) << joint.name;
    }
  }
}

/// M s^3 + D s^2 + (kp - G) s + ki is stable for the heaviest load M that stands on a leg: Routh.
TEST_P(DrivesOfPublicRobots, KeepWhatStandsOnALegFromFalling) {
  const NewRobot robot = made(GetParam());
  for (const FoundFoot& foot : robot.feet) {
    const double share_kg = robot.mass_kg / static_cast<double>(robot.feet.size());
    for (const int j : robot.tree.path_to(foot.body)) {
      const hal::JointConfig& joint =
          robot.config.joints[robot.config.joint_index(robot.tree.joints[j].name)];
      const hal::ActuatorConfig& a = robot.config.actuator_of(joint);
      const hal::GainsConfig& g = robot.config.gains_of(joint);
      const double emf = std::pow(a.gear_ratio * a.torque_constant_Nm_A, 2.0) / a.resistance_ohm;
      const double damping = g.position.gains.kd + a.damping_Nms_rad - g.emf_compensation * emf;
      const double lever = robot.stands_m;  // no joint of a leg is farther from the mass
      const double fall = share_kg * kGravity_m_s2 * lever;
      EXPECT_GT(g.position.gains.kp, fall) << joint.name;
      EXPECT_GT(damping * (g.position.gains.kp - fall),
                share_kg * lever * lever * g.position.gains.ki)
          << joint.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, DrivesOfPublicRobots, ::testing::ValuesIn(kPublicRobots),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(Drives, AreFewForJointsThatNeedNearlyTheSame) {
  model::Tree tree;
  tree.joints.resize(4);
  std::vector<JointLimits> limits(4);
  const double effort[] = {100.0, 70.0, 50.0, 5.0};
  for (std::size_t j = 0; j < 4; ++j)
    limits[j] = {.effort = effort[j], .velocity = 4.0, .range = {}};
  const std::vector<DriveSize> sizes = size_drives(tree, limits);
  ASSERT_EQ(sizes.size(), 3U);
  EXPECT_EQ(sizes[0].joints, (std::vector<int>{0, 1}));
  EXPECT_EQ(sizes[0].actuator.name, "drive_100Nm");
}

/// 1e+03 is no name in TOML: a URDF with effort="1000" could not become a robot.
TEST(Drives, OfAThousandHaveANameThatTomlTakes) {
  for (const auto& [effort, name] :
       {std::pair(995.0, "drive_1000Nm"), {1200.0, "drive_1200Nm"}, {3e6, "drive_3e_06Nm"}}) {
    model::Tree tree;
    tree.joints.resize(1);
    const std::vector<JointLimits> limits{{.effort = effort, .velocity = 4.0, .range = {}}};
    EXPECT_EQ(size_drives(tree, limits)[0].actuator.name, name);
  }
}

/// A waist of 30 Nm that carries a trunk: gains for its inertia alone made one count of the encoder
/// ask for half its effort, and it chattered between both limits.
TEST(Drives, DoNotChatterUnderALoadThatIsHeavyForThem) {
  const double period_s = 1e-3;
  model::Tree tree;
  tree.joints.resize(1);
  const std::vector<JointLimits> limits{{.effort = 30.0, .velocity = 4.6, .range = {}}};
  const JointLoad trunk{.least_inertia = 15.0, .most_inertia = 20.0};
  const std::vector<DriveSize> sizes = size_drives(tree, limits);
  const hal::GainsConfig g = tune(sizes, {trunk}, {.period_s = period_s}).at(0).gains;
  const hal::ActuatorConfig& a = sizes[0].actuator;
  const double emf = std::pow(a.gear_ratio * a.torque_constant_Nm_A, 2.0) / a.resistance_ohm;
  const double raw_step_rad_s = 2.0 * std::numbers::pi / kEncoderCounts / period_s;
  EXPECT_LT((g.position.gains.kd - g.emf_compensation * emf) * raw_step_rad_s, 0.05 * 30.0);
  EXPECT_GT(g.position.gains.kp, 15.0 * kGravity_m_s2) << "it would not carry a trunk of 15 kg";
}

/// An ankle whose weight alone asks for less: docs/robots.md gives kp = 3 G.
TEST(Drives, AreThreeTimesAsStiffAsThePendulumOnALegNeeds) {
  model::Tree tree;
  tree.joints.resize(1);
  const std::vector<JointLimits> limits{{.effort = 100.0, .velocity = 4.0, .range = {}}};
  const JointLoad body{.least_inertia = 1.0, .most_inertia = 100.0, .fall_Nm_rad = 600.0};
  const hal::GainsConfig g = tune(size_drives(tree, limits), {body}, {}).at(0).gains;
  EXPECT_NEAR(g.position.gains.kp, 3.0 * 600.0, 1e-6);
}

/// A cube's inertia says nothing of ahead: soles of both feet lie along x, whatever the last digit.
TEST(Feet, OfACubesInertiaLieAlikeLeftAndRight) {
  for (const double last_digit : {-1e-12, 1e-12}) {
    model::Inertia foot{.mass_kg = 2.0};
    foot.about_com_kg_m2 = Eigen::Vector3d(0.01, 0.01 + last_digit, 0.01).asDiagonal();
    const ContactPatch sole = equivalent_sole(foot, Eigen::Vector3d(0.0, 0.1, 0.1), 0.8);
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : sole.points) box.extend(p);
    EXPECT_GT(box.sizes().x(), box.sizes().y());
  }
}

TEST(Drives, RoundToSignificantDigits) {
  EXPECT_EQ(rounded(1234.5), 1230.0);
  EXPECT_EQ(rounded(0.00123456), 0.00123);
  EXPECT_EQ(rounded(0.0), 0.0);
}

}  // namespace
}  // namespace tandem::scaffold
