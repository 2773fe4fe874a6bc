// Exciting trajectories keep what they promise.
#include "identification/excite.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "identification/self_distance.hpp"
#include "tests/identification/synthetic.hpp"

namespace tandem::identification {
namespace {

TEST(Excite, AnArmStaysWithinEveryLimitAndIsWellConditioned) {
  const Arm panda = arm("panda");
  const auto result = excite(panda.robot, panda.tree, {.posture = "ready", .tries = 30});
  ASSERT_TRUE(result) << result.error().to_string();
  EXPECT_EQ(result->joints.size(), 7U);
  EXPECT_TRUE(result->still.empty());
  EXPECT_LT(result->condition_number, 500.0);
  EXPECT_GT(result->condition_number, 1.0);
  EXPECT_GE(result->room_m, 0.0);
  EXPECT_GT(result->speed_share, 0.2);
  const ExcitingSeries& series = result->series;
  for (double t = 0.0; t <= series.period_s; t += 0.013) {
    const ExcitingSeries::State now = series.at(t);
    for (std::size_t j = 0; j < 7; ++j) {
      const hal::JointConfig& joint = panda.robot.joints[j];
      const auto k = static_cast<Eigen::Index>(j);
      EXPECT_GT(now.x[k], joint.min_position_rad) << joint.name;
      EXPECT_LT(now.x[k], joint.max_position_rad) << joint.name;
      EXPECT_LT(std::abs(now.v[k]), 0.72 * joint.max_velocity_rad_s) << joint.name;
    }
  }
  EXPECT_LT(series.at(0.0).v.norm(), 1e-9);
  EXPECT_LT(series.at(0.0).acceleration.norm(), 1e-9);
}

// The forearm went through the column that the arm stands on: two joints lie between them.
TEST(SelfDistance, SeesTheForearmInTheColumn) {
  std::string urdf =
      "<robot name='f'><link name='base'><inertial><origin xyz='0 0 0.2'/><mass value='5'/>"
      "<inertia ixx='0.083' ixy='0' ixz='0' iyy='0.083' iyz='0' izz='0.033'/></inertial></link>";
  const std::array<std::string, 4> links{"base", "a", "b", "c"};
  for (std::size_t i = 1; i < links.size(); ++i) {
    urdf += "<link name='" + links[i] +
            "'><inertial><origin xyz='0.15 0 0'/><mass value='1'/><inertia ixx='0.001' ixy='0' "
            "ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial></link><joint name='j" +
            links[i] + "' type='revolute'><parent link='" + links[i - 1] + "'/><child link='" +
            links[i] + "'/><origin xyz='" + (i == 1 ? "0 0 0.4" : "0.3 0 0") +
            "'/><axis xyz='0 1 0'/><limit lower='-3' upper='3' effort='80' velocity='3'/></joint>";
  }
  const auto model = model::parse_urdf(urdf + "</robot>", "f.urdf", {});
  ASSERT_TRUE(model) << model.error().front().to_string();
  const SelfDistance distance(model->tree, std::vector{-1.0, 0.5, 0.0});
  EXPECT_GT(distance.room(std::vector{-1.0, 0.5, 0.0}), 0.0);
  EXPECT_LT(distance.room(std::vector{1.35, 1.58, 0.0}), 0.0);
}

TEST(Excite, IsAFunctionOfItsSeed) {
  const Arm panda = arm("panda");
  const auto one = excite(panda.robot, panda.tree, {.posture = "ready", .tries = 4});
  const auto same = excite(panda.robot, panda.tree, {.posture = "ready", .tries = 4});
  const auto other = excite(panda.robot, panda.tree, {.posture = "ready", .seed = 2, .tries = 4});
  ASSERT_TRUE(one && same && other);
  EXPECT_EQ(one->series.a, same->series.a);
  EXPECT_NE(one->series.a, other->series.a);
}

TEST(Excite, MovesTheJointsThatAreNamed) {
  const Arm panda = arm("panda");
  const auto result =
      excite(panda.robot, panda.tree,
             {.posture = "ready", .joints = {"panda_joint2", "panda_joint5"}, .tries = 4});
  ASSERT_TRUE(result) << result.error().to_string();
  EXPECT_EQ(result->joints, (std::vector<std::string>{"panda_joint2", "panda_joint5"}));
  EXPECT_EQ(result->still.size(), 5U);
  const auto wrong = excite(panda.robot, panda.tree, {.posture = "ready", .joints = {"elbow"}});
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("no joint 'elbow'"), std::string::npos);
}

TEST(SelfDistance, SeesAnArmThatFoldsOntoItself) {
  const Arm panda = arm("panda");
  std::vector<double> ready(panda.tree.joints.size(), 0.0);
  const hal::PostureConfig* posture = panda.robot.posture("ready");
  for (std::size_t j = 0; j < panda.tree.joints.size(); ++j) {
    const int index = panda.robot.joint_index(panda.tree.joints[j].name);
    ready[j] = posture->position_rad[static_cast<std::size_t>(index)];
  }
  const SelfDistance distance(panda.tree, ready);
  EXPECT_GT(distance.room(ready), 0.0);
  std::vector<double> folded = ready;
  folded[1] = -1.7;
  folded[3] = -3.0;
  EXPECT_LT(distance.room(folded), distance.room(ready));
}

TEST(Excite, AHumanoidStandsOnBothFeetWhileItMoves) {
  const Arm coman = arm("coman");
  const auto result = excite(coman.robot, coman.tree, {.posture = "stand", .tries = 2});
  ASSERT_TRUE(result) << result.error().to_string();
  EXPECT_EQ(result->joints.size(), 29U);
  EXPECT_EQ(result->legs.size(), 12U);
  EXPECT_GT(result->margin_m, 0.02);
  EXPECT_LT(result->torque_share, 0.7);
}

TEST(Excite, AHumanoidThatHangsMovesItsLegsFreelyAboveTheGround) {
  const Arm coman = arm("coman");
  const auto result = excite(coman.robot, coman.tree,
                             {.posture = "stand", .period_s = 3.0, .tries = 2, .hung = true});
  ASSERT_TRUE(result) << result.error().to_string();
  EXPECT_EQ(result->joints.size(), 29U);
  EXPECT_TRUE(result->legs.empty());  // nothing stands on them
  EXPECT_EQ(result->margin_m, 0.0);
  EXPECT_GE(result->lift_m + result->lowest_m, 0.149);
  // The base's own parameters do not show while it is at rest.
  const auto standing = excite(coman.robot, coman.tree, {.posture = "stand", .tries = 1});
  ASSERT_TRUE(standing);
  EXPECT_LT(result->base_parameters, standing->base_parameters);
  const Arm panda = arm("panda");
  const auto arm_of = excite(panda.robot, panda.tree, {.posture = "ready", .hung = true});
  ASSERT_FALSE(arm_of);
  EXPECT_NE(arm_of.error().message.find("fixed base cannot hang"), std::string::npos);
}

}  // namespace
}  // namespace tandem::identification
