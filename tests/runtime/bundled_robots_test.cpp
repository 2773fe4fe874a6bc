// The robots and experiments that come with Tandem are complete and can be read.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "hal/config/capabilities.hpp"
#include "runtime/experiment.hpp"

namespace tandem::runtime {
namespace {

class BundledRobot : public testing::TestWithParam<const char*> {};

TEST_P(BundledRobot, IsCompleteWithItsDescription) {
  const std::string file = std::string(TANDEM_SOURCE_DIR "/config/") + GetParam() + "/robot.toml";
  auto bundled = hal::read_robot_config(file);
  ASSERT_TRUE(bundled.has_value()) << bundled.error()[0].to_string();
  const auto description = robot::complete_robot(*bundled);
  ASSERT_TRUE(description.has_value()) << description.error()[0].to_string();
  for (const Error& warning : description->warnings) EXPECT_EQ(warning.key, "dynamics");
  EXPECT_EQ(description->tree.joints.size(), bundled->joints.size() + bundled->passive.size());
  for (const hal::JointConfig& joint : bundled->joints) {
    EXPECT_LT(joint.min_position_rad, joint.max_position_rad) << joint.name;
    EXPECT_GT(joint.max_torque_Nm, 0.0) << joint.name;
    EXPECT_TRUE(std::isfinite(joint.max_acceleration_rad_s2)) << joint.name;
  }
}

TEST(BundledRobots, HaveThePandasPublishedAccelerationsAndElseTheVelocityIn50Milliseconds) {
  const auto robot = [](const char* name) {
    auto read = robot::read_complete_robot(std::string(TANDEM_SOURCE_DIR "/config/") + name +
                                           "/robot.toml");
    EXPECT_TRUE(read) << name;
    return read->config;
  };
  const double published[] = {15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0};
  for (const char* panda : {"panda", "panda_classic"}) {
    const auto read = robot(panda);
    for (std::size_t j = 0; j < 7; ++j) {
      EXPECT_EQ(read.joints[j].max_acceleration_rad_s2, published[j]) << panda << j;
    }
  }
  for (const hal::JointConfig& joint : robot("ur5e").joints) {
    EXPECT_EQ(joint.max_acceleration_rad_s2, joint.max_velocity_rad_s / 0.05) << joint.name;
  }
}

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// But for its name, two sites and a posture.
TEST(ComanHands, IsTheSameRobot) {
  const std::string plain = text_of(TANDEM_SOURCE_DIR "/config/coman/robot.toml");
  std::string hands = text_of(TANDEM_SOURCE_DIR "/config/coman/robot_hands.toml");
  hands.erase(hands.find("\n# Standing, forearms forward"));
  for (const char* site : {"l_hand", "r_hand"}) {
    const std::size_t from = hands.find(std::string("[[site]]\nname = \"") + site);
    ASSERT_NE(from, std::string::npos) << site;
    hands.erase(from, hands.find("\n\n", from) + 2 - from);
  }
  const auto after_name = [](const std::string& text) { return text.substr(text.find("[model]")); };
  EXPECT_EQ(after_name(hands), after_name(plain));
  EXPECT_TRUE(robot::read_complete_robot(TANDEM_SOURCE_DIR "/config/coman/robot_hands.toml"));
}

/// A bundled humanoid whose posture leaves the base's height to the description: that height, less
/// how far flat soles sink into the ground under its weight.
double sunk_height_m(const std::string& name, const std::string& given) {
  const std::string file = TANDEM_SOURCE_DIR "/config/" + name + "/robot.toml";
  std::string text = text_of(file);
  const std::string before = "base_height_m = " + given;
  auto robot = hal::parse_robot_config(
      text.replace(text.find(before), before.size(), "base_height_m = \"auto\""), file);
  EXPECT_TRUE(robot.has_value()) << robot.error()[0].to_string();
  EXPECT_TRUE(std::isnan(robot->posture("stand")->base_height_m));
  const auto description = robot::complete_robot(*robot);
  EXPECT_TRUE(description.has_value()) << description.error()[0].to_string();
  double weight_N = 0.0;
  for (const model::Body& body : description->tree.bodies) weight_N += 9.81 * body.inertia.mass_kg;
  std::size_t points = 0;
  for (const hal::Foot& foot : robot->contact.feet) points += foot.points_m.size();
  const double stiffness_N_m = robot->contact.stiffness_N_m * static_cast<double>(points);
  return robot->posture("stand")->base_height_m - weight_N / stiffness_N_m;
}

TEST(StandingHeight, IsWhereTheLowestPointOfTheSolesTouchesTheGround) {
  // The given figures are those of a robot that the ground carries, rounded to a millimetre.
  EXPECT_NEAR(sunk_height_m("coman", "0.502"), 0.502, 0.5e-3);
  EXPECT_NEAR(sunk_height_m("walkman", "1.079"), 1.079, 0.5e-3);
}

TEST(Followers, OfTheDescriptionAreTheRobots) {
  auto config = hal::read_robot_config(TANDEM_SOURCE_DIR "/config/double_pendulum/robot.toml");
  ASSERT_TRUE(config);
  std::ifstream in(config->model.urdf);
  std::string urdf{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  urdf.insert(urdf.rfind("</robot>"), R"(
    <link name="tip"><inertial><mass value="0.01"/>
      <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="finger" type="revolute"><parent link="link2"/><child link="tip"/>
      <axis xyz="0 1 0"/><mimic joint="joint2" multiplier="-2"/></joint>)");
  const auto description = robot::complete_robot(*config, {{config->model.urdf, urdf}});
  ASSERT_TRUE(description) << description.error()[0].to_string();
  const hal::Robot known = hal::robot_of(*config);
  ASSERT_EQ(known.followers.size(), 1U);
  EXPECT_EQ(known.followers[0].multiplier, -2.0);
  EXPECT_EQ(known.no_joint("finger").to_string(),
            "finger: the joint 'finger' follows 'joint2' (mimic) (command 'joint2')");
  EXPECT_EQ(config->no_joint("joint3").message, "the robot has no joint 'joint3'");
}

TEST_P(BundledRobot, HasExperimentsThatCanBeRead) {
  const std::filesystem::path folder = std::string(TANDEM_SOURCE_DIR "/config/") + GetParam();
  int read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::filesystem::path& file = entry.path();
    if (file.extension() != ".toml" || file.filename().string().starts_with("robot")) continue;
    const auto experiment = read_experiment(file.string());
    EXPECT_TRUE(experiment.has_value()) << experiment.error()[0].to_string();
    ++read;
  }
  EXPECT_GT(read, 0);
}

INSTANTIATE_TEST_SUITE_P(All, BundledRobot,
                         testing::Values("coman", "walkman", "panda", "ur5e", "double_pendulum",
                                         "four_bar", "parallel_ankle"),
                         [](const auto& robot) { return std::string(robot.param); });

}  // namespace
}  // namespace tandem::runtime
