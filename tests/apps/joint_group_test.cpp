// What a run answers of several joints: a posture, and its gains as TOML.
#include "apps/control/joint_group.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "apps/control/joint_tuning.hpp"
#include "apps/control/run_control.hpp"
#include "tests/runtime/loop_run.hpp"

namespace tandem::apps {
namespace {

hal::RobotConfig with_a_posture() {
  hal::RobotConfig robot = hal::test::fake_robot();
  hal::PostureConfig& ready = robot.postures.emplace_back();
  ready.name = "ready";
  ready.position_rad = {0.9, -0.1, 0.3};
  return robot;
}

/// A run without controllers whose cycles are made while somebody waits for an answer.
struct JointGroup : ::testing::Test, runtime::test::LoopRun {
  JointGroup() : LoopRun(with_a_posture()) {}
  void begin() {
    LoopRun::begin(backend, {.after_stop = runtime::AfterStop::kWait});
    steps(100);
    add_run_commands(registry, *cycle, robot, {}, {}, {.lead = lead});
  }
  Json answer(const std::string& question) {
    return while_cycling([&] { return registry.answer(question); });
  }
  std::string refused(const std::string& question) {
    const Json said = answer(question);
    EXPECT_EQ(said["ok"], false) << said;
    return said.value("error", "") + " (" + said.value("hint", "") + ")";
  }
  /// When each joint came to rest [cycles from now].
  std::array<int, 3> ends(int cycles) {
    std::array<int, 3> at{};
    for (int i = 1; i <= cycles; ++i) {
      steps(1);
      for (std::size_t j = 0; j < 3; ++j)
        if (look(j).moving != 0) at[j] = i;
    }
    return at;
  }

  runtime::test::FirstOrderRobot backend{robot};
  ControlRegistry registry;
  LeadSite lead;
};

TEST_F(JointGroup, ArrivesTogetherInItsPosture) {
  begin();
  const Json said = answer(R"({"do": "joint.posture", "posture": "ready", "speed": 0.4})");
  ASSERT_EQ(said["ok"], true) << said;
  EXPECT_EQ(said["joints"], Json({"shoulder", "elbow", "wrist"}));
  // From 0.1 rad: 0.8 rad is the longest way, at 0.4 of 2 rad/s, and half a second of ramps.
  EXPECT_NEAR(said["duration_s"].get<double>(), 1.5, 1e-6);
  const auto at = ends(1700);
  for (const int one : at) {
    EXPECT_NEAR(one, at[0], 20) << at[0] << " " << at[1] << " " << at[2];
    EXPECT_LT(one, 1600);
    EXPECT_GT(one, 1300);
  }
  for (std::size_t j = 0; j < 3; ++j)
    EXPECT_NEAR(reference(j), robot.postures[0].position_rad[j], 1e-9);
  EXPECT_EQ(answer(R"({"do": "joint.posture", "posture": "ready"})")["note"],
            "nothing moves: every joint is where it is to be");
}

TEST_F(JointGroup, MovesOnlyTheJointsThatAreNamed) {
  begin();
  const Json said =
      answer(R"({"do": "joint.posture", "posture": "ready", "joints": ["wrist", "wrist"]})");
  EXPECT_EQ(said["joints"], Json({"wrist"})) << said;
  EXPECT_EQ(look(0).moving, 0);
  EXPECT_EQ(look(2).moving, 1);
}

TEST_F(JointGroup, MovesNoneWhereOneCannot) {
  begin();
  EXPECT_EQ(answer(R"({"do": "joint.set", "joint": "wrist", "mode": "idle"})")["ok"], true);
  EXPECT_EQ(refused(R"({"do": "joint.posture", "posture": "ready"})"),
            "wrist: is in the mode idle, which has no path (put it into position control: tandem "
            "joint set wrist --mode position)");
  EXPECT_EQ(look(0).moving, 0);
  EXPECT_EQ(refused(R"({"do": "joint.posture", "posture": "redy"})"),
            "redy: the robot has no posture of that name (did you mean 'ready'?)");
  EXPECT_EQ(refused(R"({"do": "joint.posture", "posture": "ready", "joints": []})"),
            "joint.posture: no joint is named (leave out joints: all move)");
}

TEST_F(JointGroup, OfAControllerStays) {
  add_sine({1});
  begin();
  EXPECT_EQ(refused(R"({"do": "joint.posture", "posture": "ready"})"),
            "elbow: the controller 'sine' has this joint (stop it first: tandem controller stop "
            "sine)");
  EXPECT_EQ(look(0).moving, 0);
}

TEST_F(JointGroup, LeadsASiteNoFasterThanAJointMayBe) {
  lead = [](const std::string& site, std::size_t axis, bool own, double by,
            const std::vector<double>& from) -> Result<LedJoints> {
    if (site != "hand") return fail_at(site, "no such site", "hand");
    EXPECT_EQ(axis, 4U);
    EXPECT_TRUE(own);
    EXPECT_DOUBLE_EQ(by, 0.1);
    return LedJoints{.joints = {0, 2}, .target_rad = {from[0] + 1.0, from[2] + 0.1}};
  };
  begin();
  const Json said = answer(
      R"({"do": "site.move", "site": "hand", "axis": "pitch", "by": 0.1, "axes": "site", "speed": 2})");
  ASSERT_EQ(said["ok"], true) << said;
  // 0.1 rad at 2 rad/s would take 0.05 s: the shoulder's 1 rad at its 2 rad/s takes longer.
  EXPECT_NEAR(said["duration_s"].get<double>(), 1.0, 1e-6);
  const double before = reference(0);
  steps(1);
  EXPECT_LE(reference(0) - before, 2.0 * 1e-3);
  const auto at = ends(1200);
  EXPECT_NEAR(at[0], at[2], 20);
  EXPECT_EQ(refused(R"({"do": "site.move", "site": "foot", "axis": "x", "by": 0.1})"),
            "foot: no such site (hand)");
}

TEST_F(JointGroup, TurnsRoundAtOnce) {
  begin();
  ASSERT_EQ(answer(R"({"do": "joint.posture", "posture": "ready", "speed": 1})")["ok"], true);
  steps(500);
  const double fast = look(0).velocity_rad_s;
  ASSERT_GT(fast, 0.5);
  // A posture that is near where the joint is now: it may not coast on with a slow ramp.
  robot.postures[0].position_rad[0] = reference(0);
  ASSERT_EQ(answer(R"({"do": "joint.posture", "posture": "ready", "speed": 0.01})")["ok"], true);
  steps(1000);
  EXPECT_LT(std::abs(look(0).velocity_rad_s), 0.05 * fast);
}

TEST_F(JointGroup, TuningHasATableOfItsOwnForAJointThatDiffers) {
  begin();
  EXPECT_EQ(answer(R"({"do": "joint.tuning"})")["changed"], Json::array());
  ASSERT_EQ(
      answer(R"({"do": "joint.gains", "joint": "wrist", "loop": "position", "kp": 150.5})")["ok"],
      true);
  steps(5);
  const Json said = answer(R"({"do": "joint.tuning"})");
  EXPECT_EQ(said["changed"], Json({"wrist"}));
  const auto toml = said["toml"].get<std::string>();
  const auto has = [&](const char* words) {
    EXPECT_NE(toml.find(words), std::string::npos) << toml;
  };
  has("[gains.arm]\nposition = { kp = 200, ki = 0, kd = 25 }\n");
  has("# Split the [[joint]] of [\"wrist\"], and give it gains = \"arm_wrist\".\n"
      "[gains.arm_wrist]\nposition = { kp = 150.5, ki = 0, kd = 25 }\n");
  has("stiffness_Nm_rad = 50\n");
}

}  // namespace
}  // namespace tandem::apps
