// Closed loops and passive joints.
#include <gtest/gtest.h>

#include "tests/hal/robot_config_text.hpp"

namespace tandem::hal {
namespace {

// The leg with a site on the shank, and what stands behind it.
std::string with_loop(const std::string& text) {
  return std::string(kRobot) + "[[site]]\nname = \"pin\"\nlink = \"shank\"\n" +
         "[[site]]\nname = \"eye\"\nlink = \"pelvis\"\n" + text;
}

TEST(RobotConfig, ReadsLoopsAndPassiveJoints) {
  const auto robot = parse_robot_config(with_loop(R"([[passive]]
name = "slider"
position_rad = 0.3
damping_Nms_rad = 0.02
[[loop]]
name = "hinge"
type = "revolute"
sites = ["pin", "eye"]
axis = [0, 2, 0]
[[loop]]
name = "link"
type = "rod"
sites = ["eye", "pin"]
length_m = 0.2
)"),
                                        "robots/leg.toml");
  ASSERT_TRUE(robot.has_value()) << robot.error().front().to_string();
  ASSERT_EQ(robot->loops.size(), 2u);
  EXPECT_EQ(robot->loops[0].type, model::KinematicLoopType::kRevolute);
  EXPECT_EQ(robot->loops[0].axis, (std::array<double, 3>{0, 1, 0}));
  EXPECT_EQ(robot->loops[1].sites, (std::array<std::string, 2>{"eye", "pin"}));
  EXPECT_EQ(robot->loops[1].length_m, 0.2);
  EXPECT_TRUE(robot->is_passive("slider"));
  EXPECT_FALSE(robot->is_passive("knee"));
  EXPECT_EQ(robot->passive[0].position_rad, 0.3);
  EXPECT_EQ(robot->passive[0].damping_Nms_rad, 0.02);
}

TEST(RobotConfig, SaysWhatIsWrongWithALoop) {
  const auto loop = [](const std::string& keys) {
    return errors_of(with_loop("[[loop]]\nname = \"hinge\"\n" + keys));
  };
  EXPECT_NE(loop("type = \"bal\"\nsites = [\"pin\", \"eye\"]").find("did you mean 'ball'?"),
            std::string::npos);
  EXPECT_NE(loop("type = \"ball\"\nsites = [\"pin\", \"eyes\"]")
                .find("loop.hinge.sites: there is no [[site]] 'eyes' (did you mean 'eye'?)"),
            std::string::npos)
      << loop("type = \"ball\"\nsites = [\"pin\", \"eyes\"]");
  EXPECT_NE(loop("type = \"ball\"\nsites = [\"pin\"]").find("must name two [[site]]s, and names 1"),
            std::string::npos);
  EXPECT_NE(loop("type = \"ball\"\nsites = [\"pin\", \"pin\"]").find("between two sites, not one"),
            std::string::npos);
  EXPECT_NE(loop("type = \"ball\"\nsites = [\"pin\", \"sole\"]").find("'sole' is a foot's"),
            std::string::npos);
  EXPECT_NE(loop("type = \"revolute\"\nsites = [\"pin\", \"eye\"]").find("needs its axis"),
            std::string::npos);
  EXPECT_NE(loop("type = \"revolute\"\nsites = [\"pin\", \"eye\"]\naxis = [0, 0, 0]")
                .find("has no length"),
            std::string::npos);
  EXPECT_NE(loop("type = \"rod\"\nsites = [\"pin\", \"eye\"]").find("length_m"), std::string::npos);
  EXPECT_NE(errors_of(with_loop("[[passive]]\nname = \"knee\"\n"))
                .find("the joint 'knee' has a motor: it is a [[joint]] too"),
            std::string::npos);
  EXPECT_NE(errors_of(with_loop("[[passive]]\nname = \"slider\"\ndamping_Nms_rad = -0.1\n"))
                .find("passive.slider.damping_Nms_rad"),
            std::string::npos);
}

TEST(RobotConfig, SaysThatAPostureCannotPlaceAPassiveJoint) {
  const std::string text = with_loop(
      "[[passive]]\nname = \"slider\"\n[[loop]]\nname = \"hinge\"\ntype = \"ball\"\n"
      "sites = [\"pin\", \"eye\"]\n[posture.other]\nslider = 0.3\n");
  EXPECT_NE(errors_of(text).find(
                "posture.other.slider: the joint 'slider' is passive: where it stands follows "
                "from the closed loops (remove it here; position_rad of its [[passive]] says "
                "where it starts from)\n"),
            std::string::npos)
      << errors_of(text);
}

}  // namespace
}  // namespace tandem::hal
