#include "tests/model/urdf_fixture.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

namespace tandem::model {
namespace {

struct Known {
  std::string file;
  bool floating;
  double mass_kg;
  std::vector<std::string> joints;
};

std::vector<Known> known_robots() {
  std::ifstream in(TANDEM_SOURCE_DIR "/tests/data/robots/joint_order.txt");
  std::vector<Known> robots;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    Known robot;
    std::string base;
    words >> robot.file >> base >> robot.mass_kg;
    robot.floating = base == "floating";
    for (std::string joint; words >> joint;) robot.joints.push_back(joint);
    robots.push_back(robot);
  }
  return robots;
}

void PrintTo(const Known& robot, std::ostream* out) { *out << robot.file; }

class PublicRobot : public testing::TestWithParam<Known> {};

TEST_P(PublicRobot, HasTheJointOrderAndMassOfPinocchio) {
  const Known& known = GetParam();
  const auto model = read_urdf(TANDEM_SOURCE_DIR "/" + known.file,
                               {.floating_base = known.floating, .mimic_independent = true});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  std::vector<std::string> joints;
  for (const Joint& joint : model->tree.joints) joints.push_back(joint.name);
  EXPECT_EQ(joints, known.joints);
  double mass = 0.0;  // what is fixed to the world does not count
  for (std::size_t i = known.floating ? 0 : 1; i < model->tree.bodies.size(); ++i) {
    mass += model->tree.bodies[i].inertia.mass_kg;
  }
  EXPECT_NEAR(mass, known.mass_kg, 1e-12 * known.mass_kg);
}

TEST_P(PublicRobot, HasUnitAxesAndOrthonormalFrames) {
  const auto model = read_urdf(TANDEM_SOURCE_DIR "/" + GetParam().file,
                               {.floating_base = GetParam().floating, .mimic_independent = true});
  ASSERT_TRUE(model.has_value());
  for (const Joint& joint : model->tree.joints) {
    EXPECT_NEAR(joint.axis.norm(), 1.0, 4e-16) << joint.name;
    const Eigen::Matrix3d& R = joint.in_parent.R;
    EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-14) << joint.name;
    EXPECT_GT(R.determinant(), 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(All, PublicRobot, testing::ValuesIn(known_robots()),
                         [](const auto& robot) {
                           return std::filesystem::path(robot.param.file).stem().string();
                         });

TEST(PublicRobots, AreEight) { EXPECT_EQ(known_robots().size(), 8u); }

TEST(PublicRobots, WarnOfAnymalsCamerasAndHatch) {
  const auto model =
      read_urdf(TANDEM_SOURCE_DIR "/config/anymal_c/anymal_c.urdf", {.floating_base = true});
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(model->warnings.size(), 5u) << to_text(model->warnings);
}

TEST(PublicRobots, HaveOneCoordinateForThePandasTwoFingers) {
  const auto model = read_urdf(TANDEM_SOURCE_DIR "/config/panda/panda.urdf", {});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  const Tree& tree = model->tree;
  EXPECT_EQ(tree.nq(), 8);
  EXPECT_EQ(tree.joints.size(), 9u);
  const int follower = tree.joint_index("panda_finger_joint2");
  EXPECT_EQ(tree.joints.at(static_cast<std::size_t>(follower)).leader,
            tree.joint_index("panda_finger_joint1"));
}

}  // namespace
}  // namespace tandem::model
