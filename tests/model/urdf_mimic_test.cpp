#include <algorithm>

#include "tests/model/urdf_fixture.hpp"

namespace tandem::model {
namespace {

// The arm with a third moving joint, and mimics as asked for.
std::string arm(const std::string& of_shoulder, const std::string& of_slide,
                const std::string& of_hook = {}) {
  const std::string hook = R"(<joint name="hook" type="revolute">
    <parent link="weight"/>
    <child link="tip"/>
    <limit lower="-3" upper="3" velocity="9" effort="4"/>)" +
                           of_hook + "\n  </joint>\n";
  std::string text =
      with("velocity=\"3\" effort=\"4\"/>", "velocity=\"3\" effort=\"4\"/>" + of_shoulder);
  text = replaced(text, "effort=\"10\"/>", "effort=\"10\"/>" + of_slide);
  const std::size_t end = text.find("  <joint name=\"end\"");
  text = text.substr(0, end) + hook + "</robot>\n";
  return replaced(text, "<link name=\"tip\"/>", R"(<link name="tip"><inertial><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>)");
}

const Joint& joint_of(const UrdfModel& model, const std::string& name) {
  return model.tree.joints.at(static_cast<std::size_t>(model.tree.joint_index(name)));
}

TEST(UrdfMimic, MakesAFollowerOfTheJointAndNoCoordinate) {
  const auto model = parse_urdf(
      arm("", "<mimic joint=\"shoulder\" multiplier=\"0.1\" offset=\"0.2\"/>"), "arm.urdf", {});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  const Joint& slide = joint_of(*model, "slide");
  EXPECT_EQ(slide.leader, model->tree.joint_index("shoulder"));
  EXPECT_EQ(slide.multiplier, 0.1);
  EXPECT_EQ(slide.offset, 0.2);
  EXPECT_EQ(model->tree.joints.size(), 3u);
  EXPECT_EQ(model->tree.nq(), 2);
  EXPECT_TRUE(model->warnings.empty()) << to_text(model->warnings);
}

TEST(UrdfMimic, FollowsTheLastJointOfAChainWhereverItStands) {
  const auto model = parse_urdf(arm("<mimic joint=\"slide\" multiplier=\"2\" offset=\"0.1\"/>",
                                    "<mimic joint=\"hook\" multiplier=\"-0.25\" offset=\"0.25\"/>"),
                                "arm.urdf", {});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  const int hook = model->tree.joint_index("hook");
  EXPECT_EQ(joint_of(*model, "slide").leader, hook);
  const Joint& shoulder = joint_of(*model, "shoulder");
  EXPECT_EQ(shoulder.leader, hook);
  EXPECT_DOUBLE_EQ(shoulder.multiplier, -0.5);
  EXPECT_DOUBLE_EQ(shoulder.offset, 0.6);
  EXPECT_EQ(model->tree.coordinates(), 1);
}

TEST(UrdfMimic, NarrowsTheLeaderToWhatItsFollowersAllowAndSaysSo) {
  const auto model = parse_urdf(
      arm("", "<mimic joint=\"shoulder\" multiplier=\"-0.5\" offset=\"0.25\"/>"), "arm.urdf", {});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  const Joint& shoulder = joint_of(*model, "shoulder");  // 0 <= 0.25 - 0.5 q <= 0.5
  EXPECT_DOUBLE_EQ(shoulder.lower, -0.5);
  EXPECT_DOUBLE_EQ(shoulder.upper, 0.5);
  EXPECT_DOUBLE_EQ(shoulder.velocity, 2.0);
  ASSERT_EQ(model->warnings.size(), 2u) << to_text(model->warnings);
  EXPECT_EQ(model->warnings[0].message,
            "its range is narrowed to -0.5 to 0.5, in which its follower 'slide' keeps its own");
  EXPECT_EQ(model->warnings[0].key, "joint shoulder");
}

// source: ros-industrial-attic/robotiq #157
TEST(UrdfMimic, TakesAwayAFollowersLimitsThatLeaveItsLeaderNoWay) {
  for (const char* mimic :
       {"<mimic joint=\"shoulder\" offset=\"7\"/>", "<mimic joint=\"shoulder\" offset=\"-2\"/>"}) {
    const auto model = parse_urdf(arm("", mimic), "arm.urdf", {});
    ASSERT_TRUE(model.has_value()) << to_text(model.error());
    const Joint& slide = joint_of(*model, "slide");
    EXPECT_FALSE(slide.has_limits());
    const Joint& shoulder = joint_of(*model, "shoulder");
    EXPECT_EQ(shoulder.lower, -1.0);
    EXPECT_EQ(shoulder.upper, 2.0);
    EXPECT_EQ(model->warnings[0].key, "joint slide");
    EXPECT_NE(model->warnings[0].message.find("its limits, 0 to 0.5, contradict its <mimic>: joint "
                                              "'shoulder' at -1 to 2 takes it to "),
              std::string::npos)
        << to_text(model->warnings);
  }
}

TEST(UrdfMimic, FixesTheFollowerOfAJointThatStandsStill) {
  const std::string text = arm("", "<mimic joint=\"shoulder\" multiplier=\"0.1\" offset=\"0.2\"/>",
                               "<mimic joint=\"slide\" multiplier=\"4\"/>");
  const auto model = parse_urdf(text, "arm.urdf", {.lock = {{"shoulder", 1.0}}});
  ASSERT_TRUE(model.has_value()) << to_text(model.error());
  EXPECT_TRUE(model->tree.joints.empty());
  const auto same =
      parse_urdf(arm("", ""), "arm.urdf",
                 {.lock = {{"shoulder", 1.0}, {"slide", 0.1 + 0.2}, {"hook", 4 * 0.1 + 0.8}}});
  ASSERT_TRUE(same.has_value()) << to_text(same.error());
  for (std::size_t i = 0; i < model->tree.links.size(); ++i) {
    EXPECT_LT((model->tree.links[i].in_body.p - same->tree.links[i].in_body.p).norm(), 1e-15);
    EXPECT_LT((model->tree.links[i].in_body.R - same->tree.links[i].in_body.R).norm(), 1e-15);
  }
  EXPECT_NE(errors_of(text, {.lock = {{"shoulder", -1.0 - 1.0}}}).find("beyond its limits"),
            std::string::npos);
}

TEST(UrdfMimic, RefusesAFollowerThatItsStillLeaderTakesBeyondItsLimits) {
  const std::string text = arm("", "<mimic joint=\"shoulder\" multiplier=\"0.1\"/>");
  EXPECT_NE(errors_of(text, {.lock = {{"shoulder", -0.5}}})
                .find("joint slide: follows a joint that stands still, and so stands at "
                      "-0.050000, beyond its limits 0.000000 to 0.500000"),
            std::string::npos);
}

TEST(UrdfMimic, RefusesAJointThatMimicsItselfAndRings) {
  EXPECT_NE(errors_of(arm("", "", "<mimic joint=\"hook\"/>"))
                .find("joint hook: mimics itself (name another joint)"),
            std::string::npos);
  const std::string ring = errors_of(
      arm("<mimic joint=\"slide\"/>", "<mimic joint=\"hook\"/>", "<mimic joint=\"shoulder\"/>"));
  for (const char* joint : {"shoulder", "slide", "hook"})
    EXPECT_NE(ring.find(std::string("joint ") + joint + ": mimics joint"), std::string::npos);
  EXPECT_EQ(std::ranges::count(ring, '\n'), 3);
}

TEST(UrdfMimic, LeavesJointsIndependentWhenAskedAndLockedOnesLocked) {
  const std::string text = arm("", "<mimic joint=\"shoulder\"/>");
  const auto model = parse_urdf(text, "arm.urdf", {.mimic_independent = true});
  ASSERT_TRUE(model.has_value());
  EXPECT_EQ(model->tree.nq(), 3);
  const auto locked = parse_urdf(text, "arm.urdf", {.lock = {{"slide", 0.1}}});
  ASSERT_TRUE(locked.has_value());
  EXPECT_EQ(locked->tree.joint_index("slide"), -1);
  EXPECT_EQ(locked->tree.nq(), 2);
}

TEST(UrdfMimic, RefusesNumbersThatAreNoneAndProductsThatAreNotFinite) {
  EXPECT_NE(errors_of(arm("", "<mimic joint=\"shoulder\" multiplier=\"two\"/>"))
                .find("'multiplier' of <mimic> is no number: 'two'"),
            std::string::npos);
  std::string chain = arm("", "<mimic joint=\"shoulder\" multiplier=\"0\"/>");
  const auto still = parse_urdf(chain, "arm.urdf", {});
  ASSERT_TRUE(still.has_value()) << to_text(still.error());
  EXPECT_EQ(still->tree.joint_index("slide"), -1) << "it follows nothing and stands at its offset";
}

}  // namespace
}  // namespace tandem::model
