// Descriptions with the habits that public ones have, each reduced to what went wrong.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "runtime/experiment.hpp"
#include "scaffold/new_robot.hpp"
#include "scaffold/steps.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::scaffold {
namespace {

std::string link(const std::string& name, double mass_kg, const std::string& com_m,
                 double inertia_kg_m2, const std::string& more = {}) {
  return fmt::format(
      "<link name='{0}'><inertial><origin xyz='{2}'/><mass value='{1}'/><inertia ixx='{3}' "
      "iyy='{3}' izz='{3}' ixy='0' ixz='0' iyz='0'/></inertial>{4}</link>\n",
      name, mass_kg, com_m, inertia_kg_m2, more);
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& at, const std::string& axis,
                  const std::string& limit) {
  return fmt::format(
      "<joint name='{}' type='{}'><parent link='{}'/><child link='{}'/><origin {}/><axis "
      "xyz='{}'/><limit {}/></joint>\n",
      name, type, parent, child, at, axis, limit);
}

using Made = std::expected<NewRobot, Diagnostics>;

Made tried(const std::string& urdf, Base base = Base::kAuto) {
  const test::ScratchFolder folder;
  const std::string file = folder / "made.urdf";
  std::ofstream(file, std::ios::binary) << "<robot name='made'>\n" << urdf << "</robot>\n";
  return make_robot({.urdf = file, .name = "made", .base = base});
}

/// What a robot of these files needs to run; empty when it has all.
std::string trouble_with(const NewRobot& robot, const std::string& urdf) {
  const test::ScratchFolder folder;
  const std::string file = folder / "made.urdf";
  std::ofstream(file, std::ios::binary) << "<robot name='made'>\n" << urdf << "</robot>\n";
  auto read = hal::parse_robot_config(robot_text(robot, file, file), "robot.toml");
  if (!read) return read.error().front().to_string();
  const auto complete = robot::complete_robot(*read);
  if (!complete) return complete.error().front().to_string();
  for (const std::string& text : {hold_text(robot), move_text(robot)}) {
    const auto experiment = runtime::parse_experiment(text, "experiment.toml", *read);
    if (!experiment) return experiment.error().front().to_string();
  }
  return {};
}

constexpr const char* kBox =
    "<collision><origin xyz='0.03 0 -0.06'/><geometry><box size='0.2 0.08 "
    "0.02'/></geometry></collision>";

/// A biped whose legs have yaw, roll, pitch, knee and ankle; source: unitreerobotics/unitree_ros
/// h1.urdf.
std::string biped(double com_y_m) {
  std::string urdf = link("pelvis", 20.0, fmt::format("0 {} 0.2", com_y_m), 0.5);
  for (const auto& [side, y] : {std::pair{"l", 0.1}, {"r", -0.1}}) {
    const std::string s = side, none = "xyz='0 0 0'", down = "xyz='0 0 -0.4'";
    const std::string limit = "lower='-0.9' upper='2' effort='200' velocity='15'";
    urdf += link(s + "_yaw", 1.0, "0 0 0", 0.01) + link(s + "_roll", 1.0, "0 0 0", 0.01) +
            link(s + "_thigh", 3.0, "0 0 -0.2", 0.03) + link(s + "_shin", 2.0, "0 0 -0.2", 0.02) +
            link(s + "_foot", 0.7, "0.03 0 -0.04", 0.003, kBox);
    urdf += joint(s + "_hip_yaw", "revolute", "pelvis", s + "_yaw",
                  fmt::format("xyz='0 {} -0.1'", y), "0 0 1", limit) +
            joint(s + "_hip_roll", "revolute", s + "_yaw", s + "_roll", none, "1 0 0", limit) +
            joint(s + "_hip_pitch", "revolute", s + "_roll", s + "_thigh", none, "0 1 0", limit) +
            joint(s + "_knee", "revolute", s + "_thigh", s + "_shin", down, "0 1 0", limit) +
            joint(s + "_ankle", "revolute", s + "_shin", s + "_foot", down, "0 1 0", limit);
  }
  return urdf;
}

TEST(Found, LegsOfFiveJointsStandLevelThoughTheMassIsBesideTheMiddle) {
  for (const double aside_m : {0.0, 0.0005, 0.005}) {
    const Made robot = tried(biped(aside_m));
    ASSERT_TRUE(robot) << robot.error().front().to_string();
    Eigen::VectorXd q(static_cast<Eigen::Index>(robot->tree.joints.size()));
    for (std::size_t j = 0; j < robot->config.joints.size(); ++j) {
      q[robot->tree.joint_index(robot->config.joints[j].name)] =
          robot->config.postures[0].position_rad[j];
    }
    const Posed posed(robot->tree, q);
    for (const FoundFoot& foot : robot->feet) {
      const model::Placement sole = posed.link(foot.link) * foot.sole_in_link;
      EXPECT_GT(sole.R(2, 2), std::cos(1e-3)) << "level within 1 mrad";
      EXPECT_NEAR(sole.p.z(), -robot->stands_m, 2e-4);
    }
    const bool told = std::ranges::any_of(robot->remarks, [](const std::string& remark) {
      return remark.find("beside the middle of the feet") != std::string::npos;
    });
    EXPECT_EQ(told, aside_m > 0.0);
  }
  EXPECT_FALSE(tried(biped(0.05))) << "50 mm beside the middle is no standing";
}

/// A quadruped of 10 kg, its root turned by `rpy`, whose limbs end in what `foot` says.
std::string quadruped(const std::string& foot, bool y_up = false,
                      const char* shape_link = "_foot") {
  std::string urdf = link("base", 8.0, "0 0 0", 0.1);
  for (const auto& [name, x, y] :
       {std::tuple{"FL", 0.2, 0.1}, {"FR", 0.2, -0.1}, {"RL", -0.2, 0.1}, {"RR", -0.2, -0.1}}) {
    const std::string n = name, limit = "lower='-3' upper='3' effort='45' velocity='20'";
    const std::string hip = y_up ? fmt::format("xyz='{} 0 {}' rpy='-1.570796327 0 0'", x, -y)
                                 : fmt::format("xyz='{} {} 0'", x, y);
    urdf += link(n + "_hip", 0.7, "0 0 0", 0.01) + link(n + "_thigh", 1.0, "0 0 -0.1", 0.01) +
            link(n + "_calf", 0.2, "0 0 -0.1", 0.001);
    urdf += joint(n + "_hip_joint", "revolute", "base", n + "_hip", hip, "1 0 0", limit) +
            joint(n + "_thigh_joint", "revolute", n + "_hip", n + "_thigh",
                  fmt::format("xyz='0 {} 0'", y > 0 ? 0.05 : -0.05), "0 1 0", limit) +
            joint(n + "_calf_joint", "revolute", n + "_thigh", n + "_calf", "xyz='0 0 -0.2'",
                  "0 1 0", limit);
    if (foot.find("wheel") != std::string::npos) {
      urdf += link(n + "_foot", 1.0, "0 0.03 0", 0.005) +
              joint(n + "_wheel_joint", "continuous", n + "_calf", n + "_foot", "xyz='0 0 -0.2'",
                    "0 1 0", "effort='20' velocity='20'");
    } else {
      urdf += link(n + shape_link, 0.04, "0 0 0", 1e-5, foot) +
              fmt::format(
                  "<joint name='{0}_end' type='fixed'><parent link='{0}_calf'/><child "
                  "link='{0}{1}'/><origin xyz='0 0 -0.2'/></joint>\n",
                  n, shape_link);
    }
  }
  return urdf;
}

const std::string kMesh =
    "<collision><geometry><mesh filename='package://q/foot.stl'/></geometry></collision>";
const std::string kBall = "<collision><geometry><sphere radius='0.02'/></geometry></collision>";
const std::string kPad = "<collision><geometry><box size='0.05 0.04 0.02'/></geometry></collision>";

/// source: Gepetto/example-robot-data go2.urdf (meshes), unitreerobotics/unitree_ros
/// b2w_description.urdf (wheels).
TEST(Found, FeetWithoutUsableShapesArePointsWhereTheLegHasNoAnkle) {
  for (const std::string& foot : {kMesh, std::string(), kBall, kPad, std::string("wheel")}) {
    const Made robot = tried(quadruped(foot));
    ASSERT_TRUE(robot) << foot << robot.error().front().to_string();
    ASSERT_EQ(robot->feet.size(), 4U) << foot;
    for (const FoundFoot& one : robot->feet) {
      EXPECT_EQ(one.points.size(), 1U) << foot;
      EXPECT_EQ(one.guess.empty(), foot == kBall) << foot;
    }
    EXPECT_EQ(trouble_with(*robot, quadruped(foot)), "") << foot;
  }
  const Made meshes = tried(quadruped(kMesh)), balls = tried(quadruped(kBall));
  EXPECT_NEAR(meshes->stands_m, balls->stands_m, 0.01) << "2.5 J / m of a ball says its radius";
  const Made wheels = tried(quadruped("wheel"));
  EXPECT_NEAR(wheels->stands_m, balls->stands_m - 0.02 + 0.1, 0.01)
      << "a disc of 1 kg, 0.005 kg m2";
  EXPECT_NE(wheels->feet[0].guess.find("does not roll"), std::string::npos);
}

/// source: erwincoumans/pybullet_robots data/laikago/laikago_toes.urdf.
TEST(Found, ARootWhoseYIsUpIsSaidWithARemedyThatWorks) {
  const std::string lying = quadruped(kBall, true);
  const Made robot = tried(lying);
  ASSERT_FALSE(robot);
  const Error& told = robot.error().front();
  EXPECT_NE(told.message.find("along -y of the root 'base'"), std::string::npos) << told.message;
  const std::size_t begin = told.hint.find("<link name="), end = told.hint.find("</joint>");
  ASSERT_NE(begin, std::string::npos) << told.hint;
  ASSERT_NE(end, std::string::npos) << told.hint;
  const Made upright = tried(lying + told.hint.substr(begin, end + 8 - begin));
  ASSERT_TRUE(upright) << upright.error().front().to_string();
  const Made straight = tried(quadruped(kBall));
  EXPECT_NEAR(upright->stands_m, straight->stands_m, 1e-3);
  std::vector<std::string> names, expected;
  for (const FoundFoot& foot : upright->feet) names.push_back(foot.name);
  for (const FoundFoot& foot : straight->feet) expected.push_back(foot.name);
  EXPECT_EQ(names, expected) << "front and hind, left and right";

  const Made asked = tried(lying, Base::kFloating);
  if (asked) {
    EXPECT_TRUE(std::ranges::any_of(asked->warnings, [](const Error& warning) {
      return warning.message.find("would lie on the ground") != std::string::npos;
    }));
  }
  EXPECT_TRUE(tried(lying, Base::kFixed));
}

/// source: Gepetto/example-robot-data tiago_dual.urdf.
TEST(Found, ASuspensionThatCannotCarryIsLockedAndSaid) {
  const std::string limit = "lower='-1' upper='1' effort='20' velocity='3'";
  const std::string cart = "<link name='base'/>" + link("body", 11.8, "0 0 0", 0.2) +
                           link("arm", 1.0, "0 0 0.2", 0.01) +
                           joint("suspension", "prismatic", "base", "body", "xyz='0 0 0'", "0 0 1",
                                 "lower='-0.02' upper='0.02' effort='100' velocity='0.35'") +
                           joint("j", "revolute", "body", "arm", "xyz='0 0 0.2'", "0 1 0", limit);
  const Made robot = tried(cart);
  ASSERT_TRUE(robot) << robot.error().front().to_string();
  ASSERT_EQ(robot->config.joints.size(), 1U);
  EXPECT_EQ(robot->config.joints[0].name, "j");
  ASSERT_EQ(robot->warnings.size(), 1U) << "and nothing is weak any more";
  EXPECT_EQ(robot->warnings[0].key, "joint suspension");
  EXPECT_NE(robot->warnings[0].message.find("it bears 125.6 N"), std::string::npos);
  EXPECT_EQ(trouble_with(*robot, cart), "");
}

/// source: willowgaragePR2.urdf (10 kN at 0.013 m/s).
TEST(Found, WhateverTheLimitsWhatIsWrittenIsTaken) {
  std::mt19937 random(42);
  const auto between = [&random](double least, double most) {
    return least * std::pow(most / least, std::uniform_real_distribution<double>()(random));
  };
  for (int i = 0; i < 60; ++i) {
    const double mass_kg = between(0.01, 100.0);
    const std::string limit =
        fmt::format("lower='-0.3' upper='0.3' effort='{:.4g}' velocity='{:.4g}'",
                    between(0.05, 3e4), between(0.003, 60.0));
    const std::string urdf = "<link name='base'/>" +
                             link("a", mass_kg, "0 0 0.1", mass_kg * 0.003) +
                             joint("j1", i % 2 == 0 ? "prismatic" : "revolute", "base", "a",
                                   "xyz='0 0 0.2'", "0 1 0", limit);
    const Made robot = tried(urdf);
    ASSERT_TRUE(robot) << limit << robot.error().front().to_string();
    EXPECT_EQ(trouble_with(*robot, urdf), "") << limit;
  }
}

/// A body of 139 kg on legs with ankles of 210 Nm; source: valkyrie.urdf.
TEST(Found, LegsAreAsFirmAsTheWholeNeedsToStand) {
  std::string urdf = biped(0.0);
  const std::string from = "<mass value='20'/>";
  urdf.replace(urdf.find(from), from.size(), "<mass value='120'/>");
  const Made robot = tried(urdf);
  ASSERT_TRUE(robot) << robot.error().front().to_string();
  Eigen::VectorXd q(static_cast<Eigen::Index>(robot->tree.joints.size()));
  for (std::size_t j = 0; j < robot->config.joints.size(); ++j) {
    q[robot->tree.joint_index(robot->config.joints[j].name)] =
        robot->config.postures[0].position_rad[j];
  }
  const double times = needed_firmness(*robot, q).value_or(100.0);
  EXPECT_LT(times, 0.7) << "the softest stiffness that stands, over what it has";
  for (const Error& warning : robot->warnings) ADD_FAILURE() << warning.to_string();
}

bool says(const std::vector<std::string>& remarks, const std::string& words) {
  return std::ranges::any_of(remarks, [&words](const std::string& remark) {
    return remark.find(words) != std::string::npos;
  });
}

/// Two links of a cylinder's mass and inertia, in kg or `unit` times that.
std::string heavy_arm(double unit, double effort) {
  const std::string limit =
      fmt::format("lower='-1.5' upper='1.5' effort='{}' velocity='2'", effort);
  return "<link name='base'/>" + link("l1", 1.5 * unit, "0 0 0.15", 0.012 * unit) +
         link("l2", 0.9 * unit, "0 0 0.15", 0.003 * unit) +
         joint("j1", "revolute", "base", "l1", "xyz='0 0 0.3'", "0 1 0", limit) +
         joint("j2", "revolute", "l1", "l2", "xyz='0 0 0.3'", "0 1 0", limit);
}

/// It waits where gravity asks for nothing, so no posture of its own tells.
TEST(Found, ARobotThatItsDrivesCannotCarryIsSaid) {
  const Made right = tried(heavy_arm(1.0, 50.0));
  ASSERT_TRUE(right) << right.error().front().to_string();
  EXPECT_FALSE(says(right->remarks, "cannot carry"));
  const Made grams = tried(heavy_arm(1000.0, 50.0));
  ASSERT_TRUE(grams) << grams.error().front().to_string();
  EXPECT_TRUE(says(grams->remarks, "Its 2400 kg look like grams"));
  EXPECT_TRUE(says(grams->remarks, "move.toml keeps still"));
  const auto told = std::ranges::find_if(grams->warnings, [](const Error& warning) {
    return warning.hint.find("by 1000 in the URDF") != std::string::npos;
  });
  EXPECT_NE(told, grams->warnings.end());
  const Made weak = tried(heavy_arm(1.0, 2.0));
  ASSERT_TRUE(weak) << weak.error().front().to_string();
  EXPECT_TRUE(says(weak->remarks, "The drives cannot carry the robot everywhere"));
  EXPECT_FALSE(says(weak->remarks, "grams"));
}

TEST(Found, ABipedInGramsGetsOneRemedyAndNoOther) {
  std::string urdf = biped(0.0);
  for (std::size_t at = 0; (at = urdf.find("<mass value='", at)) != std::string::npos; at += 13)
    urdf.insert(urdf.find("'", at + 13), "e3");
  const Made robot = tried(urdf);
  ASSERT_TRUE(robot) << robot.error().front().to_string();
  EXPECT_TRUE(says(robot->remarks, "look like grams"));
  for (const Error& warning : robot->warnings)
    EXPECT_EQ(warning.message.find("falls over"), std::string::npos) << warning.to_string();
}

/// Rigid drives have no spring that could be stiffer.
TEST(Found, AdviceIsForKeysThatTheDriveHas) {
  Made robot = tried(biped(0.0));
  ASSERT_TRUE(robot) << robot.error().front().to_string();
  for (hal::GainsConfig& gains : robot->config.gains) gains.position.gains.kp *= 0.05;
  Eigen::VectorXd q(static_cast<Eigen::Index>(robot->tree.joints.size()));
  for (std::size_t j = 0; j < robot->config.joints.size(); ++j) {
    q[robot->tree.joint_index(robot->config.joints[j].name)] =
        robot->config.postures[0].position_rad[j];
  }
  const auto falls = falls_over(*robot, q);
  ASSERT_TRUE(falls);
  EXPECT_EQ(falls->hint.find("spring_Nm_rad"), std::string::npos) << falls->hint;
  EXPECT_NE(falls->hint.find("make [gains."), std::string::npos) << falls->hint;
}

TEST(Found, AFloatingArmIsRefusedWithARemedyThatWorks) {
  const std::string arm =
      "<link name='world'/>" + link("base", 5.0, "0 0 0.1", 0.05) +
      link("l1", 1.0, "0 0 0.1", 0.01) +
      "<joint name='root' type='floating'><parent link='world'/><child link='base'/></joint>" +
      joint("j1", "revolute", "base", "l1", "xyz='0 0 0.3'", "0 1 0",
            "lower='-1' upper='1' effort='20' velocity='3'");
  for (const Base base : {Base::kAuto, Base::kFixed}) {
    const Made robot = tried(arm, base);
    ASSERT_FALSE(robot);
    EXPECT_NE(robot.error().front().hint.find("--lock root"), std::string::npos)
        << robot.error().front().to_string();
  }
  const test::ScratchFolder folder;
  const std::string file = folder / "made.urdf";
  std::ofstream(file, std::ios::binary) << "<robot name='made'>\n" << arm << "</robot>\n";
  EXPECT_TRUE(
      make_robot({.urdf = file, .name = "made", .base = Base::kFixed, .lock = {{"root", 0.0}}}));
}

/// A biped of graphics programs: y up, z ahead. Its feet are cylinders that lie along z.
std::string graphics_biped() {
  std::string urdf = link("pelvis", 6.0, "0 0 0", 0.05);
  const std::string limit = "lower='-1.5' upper='1.5' effort='50' velocity='2'";
  const std::string sole =
      "<collision><origin xyz='0 0 0.15'/><geometry><cylinder radius='0.05' length='0.3'/>"
      "</geometry></collision>";
  for (const auto& [side, x] : {std::pair{"l", "0.1"}, {"r", "-0.1"}}) {
    const std::string s = side, down = "xyz='0 -0.3 0'";
    urdf += link(s + "_thigh", 2.0, "0 -0.15 0", 0.015) +
            link(s + "_shank", 1.5, "0 -0.15 0", 0.012) +
            link(s + "_foot", 0.5, "0 0 0.15", 0.004, sole);
    urdf += joint(s + "_hip", "revolute", "pelvis", s + "_thigh", fmt::format("xyz='{} 0 0'", x),
                  "1 0 0", limit) +
            joint(s + "_knee", "revolute", s + "_thigh", s + "_shank", down, "1 0 0", limit) +
            joint(s + "_ankle", "revolute", s + "_shank", s + "_foot", down, "1 0 0", limit);
  }
  return urdf;
}

TEST(Found, TheRemedyForYUpKeepsAheadAndLinesAreLevel) {
  const std::string lying = graphics_biped();
  const Made refused = tried(lying);
  ASSERT_FALSE(refused);
  const std::string& hint = refused.error().front().hint;
  EXPECT_NE(hint.find("Its front is then its +z"), std::string::npos) << hint;
  const std::size_t begin = hint.find("<link name="), end = hint.find("</joint>");
  ASSERT_NE(end, std::string::npos) << hint;
  const Made robot = tried(lying + hint.substr(begin, end + 8 - begin));
  ASSERT_TRUE(robot) << robot.error().front().to_string();
  ASSERT_EQ(robot->feet.size(), 2U);
  EXPECT_EQ(robot->feet[0].name, "left_foot");
  EXPECT_EQ(robot->feet[1].name, "right_foot");
  Eigen::VectorXd q(static_cast<Eigen::Index>(robot->tree.joints.size()));
  for (std::size_t j = 0; j < robot->config.joints.size(); ++j) {
    q[robot->tree.joint_index(robot->config.joints[j].name)] =
        robot->config.postures[0].position_rad[j];
  }
  const Posed posed(robot->tree, q);
  for (const FoundFoot& foot : robot->feet) {
    ASSERT_EQ(foot.points.size(), 2U);
    const model::Placement sole = posed.link(foot.link) * foot.sole_in_link;
    for (const Eigen::Vector3d& p : foot.points)
      EXPECT_NEAR((sole.R * p + sole.p).z(), -robot->stands_m, 2e-4);
  }
}

TEST(Found, LegsInOneLineAreNamedByTheirLinksAndTheirFeetByTheKind) {
  std::string urdf = biped(0.0);
  for (const std::string from : {"xyz='0 0.1 -0.1'", "xyz='0 -0.1 -0.1'"})
    urdf.replace(urdf.find(from), from.size(),
                 from == "xyz='0 0.1 -0.1'" ? "xyz='0.2 0 -0.1'" : "xyz='-0.2 0 -0.1'");
  const Made robot = tried(urdf);
  ASSERT_TRUE(robot) << robot.error().front().to_string();
  EXPECT_EQ(robot->feet[0].name, "l_sole");
  EXPECT_EQ(robot->feet[1].name, "r_sole");
  for (std::size_t at = 0; (at = urdf.find("'l_", at)) != std::string::npos;)
    urdf.replace(at, 3, "'a_");
  for (std::size_t at = 0; (at = urdf.find("'r_", at)) != std::string::npos;)
    urdf.replace(at, 3, "'b_");
  const Made unnamed = tried(urdf);
  ASSERT_TRUE(unnamed) << unnamed.error().front().to_string();
  EXPECT_EQ(unnamed->feet[0].name, "sole");
  EXPECT_EQ(unnamed->feet[1].name, "sole_2");
}

}  // namespace
}  // namespace tandem::scaffold
