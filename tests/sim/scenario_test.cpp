#include "hal/sim/scenario.hpp"

#include "model/urdf.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::sim {
namespace {

using hal::FaultKind;

auto parse(std::string_view text, int order = 2) {
  return parse_scenario(text, "faults.toml", test::swing_robot(order), 1'000'000);
}

std::string errors_of(std::string_view text, int order = 2) {
  const auto faults = parse(text, order);
  std::string all;
  if (!faults) {
    for (const Error& error : faults.error()) all += error.to_string() + "\n";
  }
  return all;
}

TEST(Scenario, GivesEveryKeyItsPlace) {
  const auto faults = parse(R"(
[[fault]]
kind = "frame_delay"
after_enabled_s = 0.25
for_cycles = 20
board = "board"
direction = "to_master"
probability = 0.5
count = 7
seed = 3
steps = 2
[[fault]]
kind = "encoder_jump"
at_cycle = 1500
joint = "swing"
encoder = "motor"
rad = -0.2
[[fault]]
kind = "supply_sag"
at_s = 1.5
for_s = 0.5
board = "board"
volts = 12
ramp_s = 0.1
[[fault]]
kind = "board_kill"
sensor = "tip"
)");
  ASSERT_TRUE(faults) << faults.error()[0].to_string();
  ASSERT_EQ(faults->size(), 4U);
  const ScenarioFault& delay = (*faults)[0];
  EXPECT_EQ(delay.kind, FaultKind::kFrameDelay);
  EXPECT_EQ(delay.from, FaultFrom::kEnabled);
  EXPECT_EQ(delay.start_ns, 250'000'000);
  EXPECT_EQ(delay.duration_ns, 20'000'000);
  EXPECT_EQ(delay.bus, 0);
  EXPECT_EQ(delay.node_id, 1U);
  EXPECT_EQ(delay.direction, FrameDirection::kToMaster);
  EXPECT_EQ(delay.probability, 0.5);
  EXPECT_EQ(delay.count, 7U);
  EXPECT_EQ(delay.seed, 3U);
  EXPECT_EQ(delay.steps, 2U);
  const ScenarioFault& jump = (*faults)[1];
  EXPECT_EQ(jump.start_ns, 1'500'000'000);
  EXPECT_EQ(jump.duration_ns, -1);
  EXPECT_EQ(jump.joint, 0);
  EXPECT_EQ(jump.encoder, EncoderSide::kMotor);
  EXPECT_EQ(jump.value, -0.2);
  const ScenarioFault& sag = (*faults)[2];
  EXPECT_EQ(sag.board, 0);
  EXPECT_EQ(sag.value, 12.0);
  EXPECT_EQ(sag.ramp_ns, 100'000'000);
  EXPECT_EQ((*faults)[3].sensor, 0);
}

TEST(Scenario, ReadsAPush) {
  const auto faults = parse(
      "[[fault]]\nkind = 'push'\njoint = 'swing'\nforce_N = [1.0, -2.0, 3.0]\n"
      "point_m = [0, 0, 0.5]\nat_s = 1.0\nfor_s = 0.2\n");
  ASSERT_TRUE(faults) << faults.error().front().to_string();
  EXPECT_EQ((*faults)[0].force_N, (std::array<double, 3>{1.0, -2.0, 3.0}));
  EXPECT_EQ((*faults)[0].point_m[2], 0.5);
  EXPECT_EQ((*faults)[0].duration_ns, 200'000'000);
  EXPECT_NE(errors_of("[[fault]]\nkind = 'push'\njoint = 'swing'\n").find("force_N"),
            std::string::npos);
  EXPECT_NE(errors_of("[[fault]]\nkind = 'push'\njoint = 'swing'\nforce_N = [1.0, 2.0]\n")
                .find("force_N"),
            std::string::npos);
}

constexpr char kTwoLinks[] = R"(<robot name="swing"><link name="world"/><link name="bracket"/>
<joint name="mount" type="fixed"><parent link="world"/><child link="bracket"/></joint>
<link name="pole"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
 iyz="0"/></inertial></link>
<joint name="swing" type="continuous"><parent link="bracket"/><child link="pole"/><axis xyz="0 1 0"/>
</joint>
<link name="hand"/><joint name="tip" type="fixed"><parent link="pole"/><child link="hand"/>
 <origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/></joint></robot>)";

/// With a description, and a site above the hand.
auto parse_push(const std::string& row) {
  hal::RobotConfig robot = test::swing_robot(2);
  hal::SiteConfig grip, bolt;
  grip.name = "grip";
  grip.link = "hand";
  grip.xyz_m = {0.0, 0.0, 0.25};
  bolt.name = "bolt";
  bolt.link = "bracket";
  robot.model.sites = {grip, bolt};
  const auto read = model::parse_urdf(kTwoLinks, "swing.urdf", {});
  return parse_scenario("[[push]]\n" + row, "faults.toml", robot, 1'000'000, &read->tree);
}
std::string push_errors(const std::string& row) {
  const auto faults = parse_push(row);
  std::string all;
  if (faults) return "none";
  for (const Error& error : faults.error()) all += error.to_string() + "\n";
  return all;
}

TEST(Scenario, ReadsAPushAtASiteInItsOwnFrame) {
  const auto faults = parse_push(
      "site = 'grip'\nimpulse_Ns = [3, 0, 0]\npoint_m = [0.5, 0, 0]\nframe = 'local'\n"
      "shape = 'triangle'\nat_s = 1.5\nfor_s = 0.1\n");
  ASSERT_TRUE(faults) << faults.error().front().to_string();
  const ScenarioFault& push = faults->front();
  EXPECT_EQ(push.kind, FaultKind::kPush);
  EXPECT_EQ(push.joint, 0);
  EXPECT_EQ(push.shape, PushShape::kTriangle);
  EXPECT_EQ(push.start_ns, 1'500'000'000);
  EXPECT_EQ(push.duration_ns, 100'000'000);
  // Turned by 90 degrees about z: its x is the body's y. Twice 3 Ns / 0.1 s at the tip.
  EXPECT_NEAR(push.point_m[0], 0.0, 1e-15);
  EXPECT_NEAR(push.point_m[1], 0.5, 1e-15);
  EXPECT_NEAR(push.point_m[2], 1.25, 1e-15);
  EXPECT_NEAR(push.force_N[0], 0.0, 1e-13);
  EXPECT_NEAR(push.force_N[1], 60.0, 1e-12);
  EXPECT_EQ(push.turns, 1);
}

TEST(Scenario, SaysWhatIsWrongWithAPush) {
  const auto has = [](const std::string& row, const std::string& words) {
    EXPECT_NE(push_errors(row).find(words), std::string::npos) << row << push_errors(row);
  };
  has("force_N = [1, 0, 0]\n", "nothing says where it acts");
  has("site = 'gripp'\nforce_N = [1, 0, 0]\n", "did you mean 'grip'?");
  has("link = 'hnd'\nforce_N = [1, 0, 0]\n", "faults.toml:2: push[0].link");
  has("site = 'bolt'\nforce_N = [1, 0, 0]\n", "it is fixed to the world: it cannot be pushed");
  has("link = 'world'\nforce_N = [1, 0, 0]\n", "it cannot be pushed");
  has("site = 'grip'\nlink = 'hand'\nforce_N = [1, 0, 0]\n", "keep one of both");
  has("site = 'grip'\njoint = 'swing'\nforce_N = [1, 0, 0]\n", "acts at one place");
  has("site = 'grip'\n", "nothing says how hard it pushes");
  has("site = 'grip'\nforce_N = [1, 0, 0]\nimpulse_Ns = [1, 0, 0]\nfor_s = 1\n", "not both");
  has("site = 'grip'\nimpulse_Ns = [1, 0, 0]\n", "an impulse takes a time");
  has("site = 'grip'\nforce_N = [1, 0, 0]\nshape = 'half_sine'\n", "with a shape takes a time");
  has("site = 'grip'\nforce_N = [1, 0, 0]\nfor_s = 0\n", "takes a time");
  has("site = 'grip'\nforce_N = [1, 0, 0]\nfor_s = -1\n", "for_s");
  has("site = 'grip'\nforce_N = [nan, 0, 0]\n", "must be finite");
  has("site = 'grip'\nforce_N = [1, 0]\n", "force_N");
  has("site = 'grip'\nforce_N = [1, 0, 0]\nshape = 'square'\n", "shape");
  has("site = 'grip'\nforce_N = [1, 0, 0]\nkind = 'push'\n", "kind");
}

TEST(Scenario, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(errors_of("[[fault]]\nkind = \"board_kil\"\n").find("faults.toml:2: "), 0U);
  EXPECT_NE(errors_of("[[fault]]\nkind = \"board_kil\"\n").find("board_kill"), std::string::npos);
  EXPECT_NE(errors_of("[[fault]]\nkind = \"spring_break\"\njoint = \"swin\"\n")
                .find("did you mean 'swing'?"),
            std::string::npos);
  EXPECT_NE(errors_of("[[fault]]\nkind = \"board_kill\"\nboard = \"board\"\nrad = 1.0\n")
                .find("faults.toml:4: fault[0].rad"),
            std::string::npos)
      << errors_of("[[fault]]\nkind = \"board_kill\"\nboard = \"board\"\nrad = 1.0\n");
  EXPECT_NE(errors_of("[[fault]]\nkind = \"bus_down\"\nbus = \"line\"\nat_s = 1\nat_cycle = 1\n")
                .find("begins once"),
            std::string::npos);
  EXPECT_NE(errors_of("[[fault]]\nkind = \"board_reset\"\nboard = \"board\"\nfor_s = 1\n")
                .find("happens once"),
            std::string::npos);
  EXPECT_NE(errors_of("[[fault]]\nkind = \"spring_break\"\njoint = \"swing\"\n", 0).find("rigid"),
            std::string::npos);
  EXPECT_NE(errors_of("[[fault]]\nkind = 'board_kill'\nboard = 'board'\nsensor = 'tip'\n")
                .find("a fault is of one node"),
            std::string::npos);
  EXPECT_NE(errors_of("").find("there is no fault"), std::string::npos);
  const std::string robot = errors_of("name = \"arm\"\n[model]\nurdf = \"arm.urdf\"\n");
  EXPECT_NE(robot.find("there is no fault"), std::string::npos);
  EXPECT_EQ(robot.find("unknown key"), std::string::npos) << "a file of another kind: " << robot;
  EXPECT_NE(errors_of("[[fault]]\nkind = \"frame_drop\"\nprobability = 0\n").find("probability"),
            std::string::npos);
}

TEST(Scenario, OfAnEthercatLineStrikesWholeFramesAndCables) {
  const auto read = [](const std::string& text) {
    return parse_scenario(text, "faults.toml", test::line_swing_robot(), 1'000'000);
  };
  const auto good = read(
      "[[fault]]\nkind = 'bus_down'\nbus = 'line'\nboard = 'board'\n"
      "[[fault]]\nkind = 'frame_drop'\nbus = 'line'\ncount = 2\ndirection = 'to_master'\n");
  ASSERT_TRUE(good.has_value()) << good.error()[0].to_string();
  EXPECT_EQ((*good)[0].board, 0);
  EXPECT_EQ((*good)[1].count, 2U);
  const auto error = [&](const std::string& text) {
    const auto faults = read("[[fault]]\n" + text);
    return faults ? std::string() : faults.error()[0].to_string();
  };
  EXPECT_NE(error("kind = 'frame_corrupt'\nbus = 'line'").find("Ethernet drops frames"),
            std::string::npos);
  EXPECT_NE(error("kind = 'frame_drop'\nboard = 'board'").find("is of no single node"),
            std::string::npos);
  EXPECT_NE(error("kind = 'frame_drop'\nbus = 'line'\ncob_id = 1").find("cob_id: unknown key"),
            std::string::npos);
  EXPECT_NE(errors_of("[[fault]]\nkind = 'bus_down'\nbus = 'line'\nboard = 'board'")
                .find("a CAN bus is down for all of its nodes"),
            std::string::npos);
}

TEST(Scenario, TakesTheWordsOfACommandLine) {
  const std::vector<std::string> words{"kind=encoder_jump", "joint=swing", "rad=-0.5"};
  const auto faults = parse(scenario_of_words(words));
  ASSERT_TRUE(faults) << faults.error()[0].to_string();
  EXPECT_EQ((*faults)[0].value, -0.5);
  const std::vector<std::string> toml{"kind = \"frame_drop\"\ncob_id = 0x181"};
  const auto same = parse(scenario_of_words(toml));
  ASSERT_TRUE(same) << same.error()[0].to_string();
  EXPECT_EQ((*same)[0].cob_id, 0x181U);
  const std::vector<std::string> list{"kind=push", "joint=swing", "force_N=[0, 0, 40]",
                                      "for_s=0.1"};
  const auto push = parse(scenario_of_words(list));
  ASSERT_TRUE(push) << push.error()[0].to_string();
  EXPECT_EQ((*push)[0].force_N[2], 40.0);
}

}  // namespace
}  // namespace tandem::sim
