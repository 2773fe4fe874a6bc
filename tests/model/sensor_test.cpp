#include <gtest/gtest.h>

#include "tests/model/reference.hpp"

namespace tandem::model {
namespace {

// A cart on a pole that carries a hand through `%s`, where the sensor sits.
std::string arm_with(const std::string& sensor_joint) {
  const std::string inertia =
      R"(<inertia ixx="0.02" ixy="0.001" ixz="-0.002" iyy="0.025" iyz="0.003" izz="0.015"/>)";
  const auto link = [&](const std::string& name, const std::string& origin, double mass) {
    return "<link name='" + name + "'><inertial><origin xyz='" + origin + "' rpy='0.1 0.2 0.3'/>" +
           "<mass value='" + std::to_string(mass) + "'/>" + inertia + "</inertial></link>";
  };
  const auto joint = [](const std::string& name, const std::string& type, const std::string& parent,
                        const std::string& child, const std::string& axis) {
    return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
           "'/><child link='" + child +
           "'/><origin xyz='0.1 -0.2 0.3' rpy='0.3 -0.4 0.5'/><axis xyz='" + axis +
           "'/><limit lower='-9' upper='9' velocity='9' effort='9'/></joint>";
  };
  return "<robot name='arm'>" + link("base", "0 0.1 0", 3) + link("cart", "0.1 0 0", 2) +
         link("pole", "0 0 0.4", 1.5) + link("hand", "0 0.05 0.1", 0.7) +
         link("finger", "0.02 0 0.03", 0.3) +
         joint("slide", "prismatic", "base", "cart", "1 2 0.5") +
         joint("swing", "continuous", "cart", "pole", "0 1 0.2") + sensor_joint +
         joint("grip", "prismatic", "hand", "finger", "0 0 1") + "</robot>";
}

std::string fixed_joint() {
  return "<joint name='ft' type='fixed'><parent link='pole'/><child link='hand'/>"
         "<origin xyz='0.05 0.02 0.5' rpy='0.2 0.1 -0.6'/></joint>";
}

// The same place, able to move along and about every axis, through massless links.
std::string six_joints() {
  const char* axes[] = {"1 0 0", "0 1 0", "0 0 1"};
  std::string text;
  std::string parent = "pole";
  for (int i = 0; i < 6; ++i) {
    const std::string child = i == 5 ? "hand" : "m" + std::to_string(i);
    if (i < 5) text += "<link name='" + child + "'/>";
    text += "<joint name='ft" + std::to_string(i) + "' type='" +
            (i < 3 ? "prismatic" : "revolute") + "'><parent link='" + parent + "'/><child link='" +
            child + "'/>" + (i == 0 ? "<origin xyz='0.05 0.02 0.5' rpy='0.2 0.1 -0.6'/>" : "") +
            "<axis xyz='" + axes[i % 3] +
            "'/><limit lower='-9' upper='9' velocity='9' effort='9'/></joint>";
    parent = child;
  }
  return text;
}

Mechanism arm(const std::string& sensor_joint, bool floating, bool sensor) {
  const auto model = parse_urdf(arm_with(sensor_joint), "arm.urdf", {.floating_base = floating});
  EXPECT_TRUE(model.has_value());
  ModelSpec spec;
  spec.sites = {{"tip", "finger", {0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}, true},
                {"side", "pole", {0.0, 0.1, 0.0}, {0.0, 0.5, 0.0}, true}};
  if (sensor) spec.sensors = {{"wrist", "ft", "hand"}};
  return *make_mechanism(model->tree, spec);
}

class SensorOfAnArm : public testing::TestWithParam<bool> {};

TEST_P(SensorOfAnArm, MeasuresMinusTheForcesOfSixJointsInItsPlace) {
  const bool floating = GetParam();
  const Mechanism rigid = arm(fixed_joint(), floating, true);
  const Mechanism free = arm(six_joints(), floating, false);
  ASSERT_EQ(rigid.joint_count() + 6, free.joint_count());
  Array q{0.3, -0.2, 0.9};  // slide, swing, grip
  Array v{1.1, -2.0, 0.7};
  Array vdot{-3.0, 4.0, 5.0};
  Array free_q{q[0], q[1], 0, 0, 0, 0, 0, 0, q[2]};
  Array free_v{v[0], v[1], 0, 0, 0, 0, 0, 0, v[2]};
  Array free_vdot{vdot[0], vdot[1], 0, 0, 0, 0, 0, 0, vdot[2]};
  if (floating) {
    const Array pose{0.1, 0.2, 0.3, 0.5, -0.5, 0.5, 0.5};
    const Array twist{1.0, -2.0, 0.5, 0.3, 0.6, -0.9};
    for (Array* a : {&q, &free_q}) a->insert(a->begin(), pose.begin(), pose.end());
    for (Array* a : {&v, &free_v, &vdot, &free_vdot})
      a->insert(a->begin(), twist.begin(), twist.end());
  }
  const Array wrench{1, 2, 3, 0.4, 0.5, 0.6, -3, 2, -1, 0.3, 0.2, 0.1};
  const Array measured = evaluate_kernel(Kernel::kSensorWrenches, rigid, {q, v, vdot, wrench})[0];
  const Array tau =
      evaluate_kernel(Kernel::kInverseDynamics, free, {free_q, free_v, free_vdot, wrench})[0];
  const std::size_t first = floating ? 8 : 2;
  const double scale = 30.0;  // weights and forces of this example
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(measured[i], -tau[first + i], 1e-13 * scale) << i;
}

INSTANTIATE_TEST_SUITE_P(Base, SensorOfAnArm, testing::Bool(),
                         [](const auto& test) { return test.param ? "Floating" : "Fixed"; });

TEST(Sensor, ThroughAMovingJointShowsItsTorqueAndTheWeightOnIt) {
  const ReferenceRobot& robot = reference_robot("ur5e");
  ModelSpec spec = reference_spec(robot);
  spec.sensors = {{"base", "shoulder_pan_joint", "shoulder_link"},
                  {"below", "shoulder_pan_joint", "base_link_inertia"},
                  {"elbow", "elbow_joint", "forearm_link"}};
  const Mechanism m = *make_mechanism(reference_tree(robot), spec);
  const Array q{0.1, -0.8, 1.2, 0.3, -0.4, 0.5};
  const Array v(6, 0.0);
  const Array none(static_cast<std::size_t>(6 * m.wrenches), 0.0);
  const Array out = evaluate_kernel(Kernel::kSensorWrenches, m, {q, v, v, none})[0];
  const Array tau = evaluate_kernel(Kernel::kBias, m, {q, v})[0];
  EXPECT_NEAR(out[2], -m.mass_kg * 9.81, 1e-10);  // pulls down on what carries it
  EXPECT_NEAR(out[8], -m.mass_kg * 9.81, 1e-10);
  EXPECT_NEAR(out[5], -tau[0], 1e-12);
  EXPECT_NEAR(out[17], -tau[2], 1e-12);
}

TEST(Sensor, AndSitesThatTheDescriptionLacksAreNamed) {
  const ReferenceRobot& robot = reference_robot("ur5e");
  const Tree tree = reference_tree(robot);
  ModelSpec spec;
  spec.sensors = {{"wrist", "wrist_3_jiont", "tool0"}};
  Result<Mechanism> m = make_mechanism(tree, spec);
  ASSERT_FALSE(m);
  EXPECT_NE(m.error().to_string().find("wrist_3_joint"), std::string::npos);
  spec.sensors = {{"wrist", "wrist_3_joint", "base_link"}};
  m = make_mechanism(tree, spec);
  ASSERT_FALSE(m);
  EXPECT_NE(m.error().message.find("turns against both sides"), std::string::npos);
  spec.sensors.clear();
  spec.sites = {{"tool", "tool00", {}, {}, false}};
  m = make_mechanism(tree, spec);
  ASSERT_FALSE(m);
  EXPECT_NE(m.error().to_string().find("did you mean 'tool0'"), std::string::npos);
  spec.sites = {{"tool", "tool0", {}, {}, false}, {"tool", "tool0", {}, {}, false}};
  m = make_mechanism(tree, spec);
  ASSERT_FALSE(m);
  EXPECT_NE(m.error().message.find("twice"), std::string::npos);
  spec.sites.clear();
  spec.armature = {{"elbow_joint", -1.0}};
  m = make_mechanism(tree, spec);
  ASSERT_FALSE(m);
  EXPECT_NE(m.error().message.find("negative"), std::string::npos);
}

}  // namespace
}  // namespace tandem::model
