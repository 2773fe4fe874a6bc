// Rotors and impedances that are guessed, against what is published of real robots.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/scaffold/robots.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kFactor = 3.0;

struct Published {
  const char* robot;
  const char* joint;
  double rotor_kg_m2;       ///< on the joint's side
  double stiffness_Nm_rad;  ///< of its users' impedance; 0: none is published
};

// Rotors of G1, Go2 and H1: N^2 J of the gears' stages by HybridRobotics/whole_body_tracking
// (armatures of 7520-22, 7520-14, 5020 twice and once, 4010), of Go2 1.11842e-4 kg m^2 of the
// rotors in Unitree's own descriptions times 6.33^2 and (6.33 * 1.92)^2, of H1 the drives M107-15
// and M107-24 that H1-2 has with the same limits. Stiffnesses: the same source for G1,
// unitree_rl_lab for Go2, unitree_rl_gym for H1, libfranka's joint impedance example for the Panda.
// Panda's rotors: google-deepmind/mujoco_menagerie franka_fr3 (armature); UR5e's: config/ur5e,
// plausible values, as nobody publishes any.
constexpr Published kPublished[] = {
    {"unitree_g1", "left_hip_roll_joint", 0.0251, 99.1},
    {"unitree_g1", "left_knee_joint", 0.0251, 99.1},
    {"unitree_g1", "left_hip_pitch_joint", 0.01018, 40.2},
    {"unitree_g1", "left_hip_yaw_joint", 0.01018, 40.2},
    {"unitree_g1", "waist_yaw_joint", 0.01018, 40.2},
    {"unitree_g1", "left_ankle_pitch_joint", 0.00722, 28.5},
    {"unitree_g1", "left_ankle_roll_joint", 0.00722, 28.5},
    {"unitree_g1", "waist_roll_joint", 0.00722, 28.5},
    {"unitree_g1", "left_shoulder_pitch_joint", 0.00361, 14.3},
    {"unitree_g1", "left_elbow_joint", 0.00361, 14.3},
    {"unitree_g1", "left_wrist_pitch_joint", 0.00425, 16.8},
    {"unitree_go2", "FL_hip_joint", 0.00448, 25.0},
    {"unitree_go2", "FL_thigh_joint", 0.00448, 25.0},
    {"unitree_go2", "FL_calf_joint", 0.01652, 25.0},
    {"unitree_h1", "left_hip_yaw_joint", 0.0633, 150.0},
    {"unitree_h1", "left_hip_pitch_joint", 0.0633, 150.0},
    {"unitree_h1", "left_knee_joint", 0.1605, 200.0},
    {"unitree_h1", "torso_joint", 0.0633, 300.0},
    {"panda", "panda_joint1", 0.195, 600.0},
    {"panda", "panda_joint4", 0.195, 600.0},
    {"panda", "panda_joint5", 0.074, 250.0},
    {"panda", "panda_joint7", 0.074, 50.0},
    {"ur5e", "shoulder_pan_joint", 1.0, 0.0},
    {"ur5e", "elbow_joint", 1.0, 0.0},
    {"ur5e", "wrist_1_joint", 0.2, 0.0},
};

double apart(double a, double b) { return std::max(a / b, b / a); }

TEST(Published, RotorsAndImpedancesAreWithinAFactorOfThree) {
  const char* made_of = "";
  NewRobot robot;
  double worst = 1.0;
  for (const Published& one : kPublished) {
    if (std::string(made_of) != one.robot) {
      made_of = one.robot;
      robot = made(public_robot(made_of));
    }
    const hal::JointConfig& joint =
        robot.config.joints.at(static_cast<std::size_t>(robot.config.joint_index(one.joint)));
    const double rotor = robot.config.actuator_of(joint).inertia_kg_m2;
    const double stiffness = robot.config.gains_of(joint).stiffness_Nm_rad;
    EXPECT_LT(apart(rotor, one.rotor_kg_m2), kFactor)
        << one.robot << ' ' << one.joint << ' ' << rotor;
    worst = std::max(worst, apart(rotor, one.rotor_kg_m2));
    if (one.stiffness_Nm_rad > 0.0) {
      EXPECT_LT(apart(stiffness, one.stiffness_Nm_rad), kFactor)
          << one.robot << ' ' << one.joint << ' ' << stiffness;
    }
    std::printf("%-12s %-26s rotor %.4f of %.4f kg m^2, impedance %.1f of %.1f Nm/rad\n", one.robot,
                one.joint, rotor, one.rotor_kg_m2, stiffness, one.stiffness_Nm_rad);
  }
  EXPECT_LT(worst, kFactor);
}

/// G1's hips roll with 139 Nm at 20 rad/s and pitch with 88 Nm at 32 rad/s: two motors, of which
/// one was guessed, 18 times too heavy.
TEST(Published, DrivesThatAreFastAreNotTakenForSlowStrongOnes) {
  const NewRobot g1 = made(public_robot("unitree_g1"));
  const auto drive_of = [&](const char* joint) {
    return g1.config.joints[static_cast<std::size_t>(g1.config.joint_index(joint))].actuator;
  };
  EXPECT_NE(drive_of("left_hip_roll_joint"), drive_of("left_hip_pitch_joint"));
  EXPECT_EQ(drive_of("left_hip_roll_joint"), drive_of("right_knee_joint"));
}

TEST(Published, DrivesOfOneEffortAndTwoSpeedsHaveTwoNames) {
  model::Tree tree;
  tree.joints.resize(2);
  const std::vector<JointLimits> limits{{.effort = 100.0, .velocity = 4.0, .range = {}},
                                        {.effort = 100.0, .velocity = 20.0, .range = {}}};
  const std::vector<DriveSize> sizes = size_drives(tree, limits);
  ASSERT_EQ(sizes.size(), 2U);
  EXPECT_NE(sizes[0].actuator.name, sizes[1].actuator.name);
}

}  // namespace
}  // namespace tandem::scaffold
