// What `tandem new` finds out of a description, and that the files say it.
#include "scaffold/new_robot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

#include "hal/ethercat-can/bus_load.hpp"
#include "runtime/experiment.hpp"
#include "scaffold/strength.hpp"
#include "scaffold/toml_words.hpp"
#include "scaffold/words.hpp"
#include "tests/scaffold/robots.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::scaffold {
namespace {

std::string text_of(const PublicRobot& robot) {
  std::ifstream in(path_of(robot), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

NewRobot made_of(const std::string& urdf) {
  const test::ScratchFolder folder;
  const std::string file = folder / "made.urdf";
  std::ofstream(file, std::ios::binary) << urdf;
  auto found = make_robot({.urdf = file, .name = "made"});
  if (!found) throw std::runtime_error(found.error().front().to_string());
  return std::move(*found);
}

/// In the tree's order, from that of [[joint]].
Eigen::VectorXd positions_in(const NewRobot& robot, const std::vector<double>& position_rad) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(robot.tree.joints.size()));
  for (std::size_t j = 0; j < robot.config.joints.size(); ++j) {
    q[robot.tree.joint_index(robot.config.joints[j].name)] = position_rad[j];
  }
  return q;
}

Eigen::VectorXd posture_in(const NewRobot& robot) {
  return positions_in(robot, robot.config.postures[0].position_rad);
}

std::vector<std::string> sensors_of(const NewRobot& robot) {
  std::vector<std::string> names;
  for (const FoundSensor& sensor : robot.sensors) names.push_back(sensor.config.name);
  return names;
}

class EveryPublicRobot : public ::testing::TestWithParam<PublicRobot> {};

TEST_P(EveryPublicRobot, GetsFilesThatAreReadBackAsTheyWereMeant) {
  const NewRobot robot = made(GetParam());
  auto read =
      hal::parse_robot_config(robot_text(robot, path_of(GetParam()), "x.urdf"), "robot.toml");
  ASSERT_TRUE(read) << read.error().front().to_string();
  const auto description = robot::complete_robot(*read);
  ASSERT_TRUE(description) << description.error().front().to_string();
  EXPECT_TRUE(hal::can::check_bus_load(*read, 1'000'000).empty());
  ASSERT_EQ(read->joints.size(), robot.config.joints.size());
  for (std::size_t j = 0; j < read->joints.size(); ++j) {
    const hal::JointConfig& is = read->joints[j];
    const hal::JointConfig& meant = robot.config.joints[j];
    EXPECT_EQ(is.name, meant.name);
    EXPECT_EQ(is.board, meant.board);
    EXPECT_EQ(is.axis, meant.axis);
    EXPECT_EQ(is.actuator, meant.actuator);
    EXPECT_EQ(is.gains, meant.gains);
    EXPECT_NEAR(is.max_torque_Nm, meant.max_torque_Nm, 1e-2 * meant.max_torque_Nm);
    EXPECT_NEAR(read->postures[0].position_rad[j], robot.config.postures[0].position_rad[j], 1e-4);
  }
  for (std::size_t s = 0; s < read->sensors.size(); ++s) {
    EXPECT_EQ(read->sensors[s].bus, robot.config.sensors[s].bus);
    EXPECT_EQ(read->sensors[s].node_id, robot.config.sensors[s].node_id);
  }
  for (const std::string& text : {hold_text(robot), move_text(robot)}) {
    const auto experiment = runtime::parse_experiment(text, "experiment.toml", *read);
    EXPECT_TRUE(experiment) << experiment.error().front().to_string();
  }
}

INSTANTIATE_TEST_SUITE_P(, EveryPublicRobot, ::testing::ValuesIn(kPublicRobots),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(NewRobot, GivesSensorsNamesThatATopicMayHave) {
  model::Tree tree;
  tree.bodies.resize(3);
  for (const char* name : {"imu/1", "imu.1", "1-imu"}) {
    model::Link& link = tree.links.emplace_back();
    link.name = name;
    link.body = static_cast<int>(tree.links.size()) - 1;
  }
  std::vector<std::string> names;
  for (const FoundSensor& sensor : find_sensors(tree, {})) names.push_back(sensor.config.name);
  EXPECT_EQ(names, (std::vector<std::string>{"imu_1", "imu_1_2", "_1_imu"}));
}

TEST(NewRobot, FindsOneSensorForEachWrenchAndEachImu) {
  EXPECT_EQ(sensors_of(made(kPublicRobots[1])), std::vector<std::string>{"ft_frame"});
  EXPECT_EQ(sensors_of(made(kPublicRobots[3])), std::vector<std::string>{"imu_link"});
  const NewRobot walkman = made(kPublicRobots[6]);  // six frames in a row in each foot: one sensor
  ASSERT_EQ(walkman.sensors.size(), 3U);
  EXPECT_EQ(walkman.sensors[0].config.joint, "FT_LFoot_X");
  EXPECT_FALSE(walkman.sensors[2].guess.empty()) << "its description names no IMU";
  const NewRobot icub = made(kPublicRobots[7]);
  EXPECT_EQ(std::ranges::count(icub.sensors, hal::SensorType::kForceTorque,
                               [](const FoundSensor& s) { return s.config.type; }),
            6);
}

TEST(NewRobot, GivesAFollowerNoDriveAndItsLeaderItsLoad) {
  const NewRobot panda = made(kPublicRobots[2]);  // the second finger mimics the first
  const int second = panda.tree.joint_index("panda_finger_joint2");
  ASSERT_TRUE(panda.tree.joints[second].follows());
  EXPECT_EQ(panda.config.joints.size(), 8U);
  const std::string text = robot_text(panda, "panda.urdf", "panda.urdf");
  EXPECT_EQ(text.find("\"panda_finger_joint2\""), std::string::npos);
  EXPECT_EQ(text.find("mimic ="), std::string::npos);
  EXPECT_NE(text.find("panda_finger_joint2 follows panda_finger_joint1"), std::string::npos);
  const Posed posed(panda.tree, neutral_posture(panda.tree));
  const int first = panda.tree.joints[second].leader;  // both slide
  EXPECT_NEAR(
      posed.inertia(first),
      panda.tree.bodies[first + 1].inertia.mass_kg + panda.tree.bodies[second + 1].inertia.mass_kg,
      1e-9);
}

TEST(NewRobot, OffersExactRightAnglesWhereTheDescriptionHasFewDigits) {
  const NewRobot panda = made(kPublicRobots[2]);
  ASSERT_GT(panda.right_angles.count, 0);
  EXPECT_GT(panda.turned.distance_m, 0.0);
  const auto text = [](const NewRobot& robot) { return robot_text(robot, "x.urdf", "x.urdf"); };
  EXPECT_NE(text(panda).find("\n# right_angles = \"exact\""), std::string::npos);
  const NewRobot coman = made(kPublicRobots[5]);  // two, of inertias: exact ones save nothing
  EXPECT_EQ(coman.right_angles.count, 2);
  EXPECT_EQ(text(coman).find("right_angles"), std::string::npos);
}

TEST(NewRobot, SaysOnceWhatAllDrivesHaveInCommon) {
  const std::string text = robot_text(made(kPublicRobots[7]), "icub.urdf", "icub.urdf");
  for (const char* key : {"\norder = ", "\ngear_ratio = ", "\nemf_compensation = "}) {
    const std::size_t first = text.find(key);
    ASSERT_NE(first, std::string::npos) << key;
    EXPECT_EQ(text.find(key, first + 1), std::string::npos) << key;
  }
}

TEST(NewRobot, TakesWhereTheDescriptionHasNoLimitWhatTheModelNeeds) {
  const NewRobot pendulum = made(kPublicRobots[0]);  // effort and velocity are 0
  for (const JointLimits& limit : pendulum.limits) {
    EXPECT_TRUE(limit.effort_guessed && limit.velocity_guessed);
    EXPECT_GT(limit.effort, 0.0);
  }
  const NewRobot icub = made(kPublicRobots[7]);  // 20 joints of 50000 Nm at 50000 rad/s
  EXPECT_EQ(std::ranges::count(icub.limits, true, &JointLimits::effort_guessed), 20);
  const std::string text = robot_text(icub, "icub.urdf", "icub.urdf");
  EXPECT_NE(text.find("# guess: from its load and its neighbours'; the description's is 50000"),
            std::string::npos);
}

/// One joint with a link of 10 kg, whose centre of mass is 4 m away: 392 Nm hold it.
std::string long_arm(const std::string& effort) {
  return "<robot name='long_arm'><link name='base'/>"
         "<joint name='lift' type='revolute'><parent link='base'/><child link='arm'/>"
         "<axis xyz='0 1 0'/><limit lower='-1' upper='1' velocity='1' effort='" +
         effort +
         "'/></joint><link name='arm'><inertial><origin xyz='4 0 0'/><mass value='10'/>"
         "<inertia ixx='1' iyy='10' izz='10' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";
}

TEST(NewRobot, BelievesAnEffortThatItsReachCanUse) {
  const NewRobot strong = made_of(long_arm("2000"));  // 10 times its weight at 1 m are 981 Nm
  EXPECT_FALSE(strong.limits[0].effort_guessed);
  EXPECT_EQ(strong.limits[0].effort, 2000.0);
  EXPECT_TRUE(made_of(long_arm("4000")).limits[0].effort_guessed) << "and at 4 m 3924 Nm";
}

TEST(NewRobot, NamesLimbsAsPeopleDo) {
  std::vector<std::string> names;
  for (const Limb& limb : made(kPublicRobots[5]).limbs) names.push_back(limb.name);
  std::ranges::sort(names);
  EXPECT_EQ(names,
            (std::vector<std::string>{"left_arm", "left_leg", "right_arm", "right_leg", "torso"}));
  const NewRobot anymal = made(kPublicRobots[3]);
  EXPECT_EQ(anymal.limbs[0].name, "left_front_leg");
  EXPECT_EQ(anymal.feet[0].points.size(), 1U) << "a ball";
}

// The twenty-seventh bus of a limb was called "arm_{".
TEST(NewRobot, NamesMoreBusesThanThereAreLetters) {
  std::ostringstream urdf;
  urdf << "<robot name='chain'><link name='l0'/>";
  for (int i = 1; i <= 220; ++i) {
    urdf << "<link name='l" << i << "'><inertial><origin xyz='0 0 0.05'/><mass value='0.1'/>"
         << "<inertia ixx='1e-4' ixy='0' ixz='0' iyy='1e-4' iyz='0' izz='1e-4'/></inertial></link>"
         << "<joint name='j" << i << "' type='revolute'><parent link='l" << i - 1
         << "'/><child link='l" << i << "'/><origin xyz='0 0 0.1'/><axis xyz='" << i % 2 << " "
         << 1 - i % 2 << " 0'/><limit lower='-2' upper='2' effort='400' velocity='5'/></joint>";
  }
  const NewRobot robot = made_of(urdf.str() + "</robot>");
  ASSERT_GT(robot.config.buses.size(), 26U);
  EXPECT_EQ(robot.config.buses[25].name, "arm_z");
  EXPECT_EQ(robot.config.buses[26].name, "arm_aa");
}

TEST(NewRobot, TakesTheBaseThatItIsTold) {
  const std::string urdf = path_of(kPublicRobots[5]);
  const auto fixed = make_robot({.urdf = urdf, .name = "coman", .base = Base::kFixed});
  ASSERT_TRUE(fixed);
  EXPECT_FALSE(fixed->config.model.floating_base);
  EXPECT_TRUE(fixed->feet.empty());
}

TEST(NewRobot, TakesSpringsInProportionFromAnother) {
  auto read = hal::read_robot_config(TANDEM_SOURCE_DIR "/config/coman/robot.toml");
  ASSERT_TRUE(read);
  auto description = robot::complete_robot(*read);
  ASSERT_TRUE(description);
  const Like coman{*read, description->tree};
  const auto same =
      make_robot({.urdf = path_of(kPublicRobots[5]), .name = "coman", .like = &coman});
  ASSERT_TRUE(same) << same.error().front().to_string();
  EXPECT_NEAR(same->scale, 1.0, 1e-9);
  const std::string hold = hold_text(*same);  // its wrists would ring
  EXPECT_NE(hold.find("\"RKneeSag\""), std::string::npos) << hold;
  EXPECT_EQ(hold.find("Wrj"), std::string::npos) << hold;
  for (const hal::JointConfig& joint : same->config.joints) {  // like itself: the same drives
    const hal::JointConfig& theirs = read->joints[read->joint_index(joint.name)];
    EXPECT_EQ(joint.actuator, theirs.actuator) << joint.name;
    EXPECT_NEAR(same->config.actuator_of(joint).spring_Nm_rad,
                read->actuator_of(theirs).spring_Nm_rad, 0.5)
        << joint.name;
  }
}

/// COMAN's springs times 0.911 let iCub fall over in 3 s; with 1.5 times as stiff ones it stands.
TEST(NewRobot, WarnsOfSpringsOnWhichItWouldFallOver) {
  auto read = hal::read_robot_config(TANDEM_SOURCE_DIR "/config/coman/robot.toml");
  ASSERT_TRUE(read);
  auto description = robot::complete_robot(*read);
  ASSERT_TRUE(description);
  const auto firmness = [&](const PublicRobot& robot, double springs) {
    Like like{*read, description->tree};
    for (hal::ActuatorConfig& drive : like.config.actuators) drive.spring_Nm_rad *= springs;
    const auto made = make_robot({.urdf = path_of(robot), .name = robot.name, .like = &like});
    EXPECT_TRUE(made) << made.error().front().to_string();
    std::string said;
    for (const Error& warning : made->warnings) {
      if (warning.message.contains("it falls over")) said += warning.to_string();
    }
    return said;
  };
  EXPECT_EQ(firmness(kPublicRobots[5], 1.0), "") << "COMAN on its own";
  EXPECT_EQ(firmness(kPublicRobots[6], 1.0), "") << "WALK-MAN";
  EXPECT_EQ(firmness(kPublicRobots[4], 1.0), "") << "simple_humanoid";
  const std::string icub = firmness(kPublicRobots[7], 1.0);
  EXPECT_NE(icub.find("Nm/rad, and the robot needs"), std::string::npos) << icub;
  EXPECT_NE(icub.find("make [actuator.soft_leg] spring_Nm_rad"), std::string::npos) << icub;
  EXPECT_EQ(firmness(kPublicRobots[7], 1.5), "");
}

/// Numbers come from the description, from an option, or are marked. Lists of texts, and the
/// count in `base_height_m`'s own comment, are no numbers of ours.
TEST_P(EveryPublicRobot, MarksEveryNumberThatIsNotTheDescriptionsAsAGuess) {
  const NewRobot robot = made(GetParam());
  std::istringstream lines(robot_text(robot, path_of(GetParam()), "x.urdf"));
  int marked = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t equals = line.find(" = ");
    if (line.starts_with('#') || equals == std::string::npos) continue;
    bool text = false, number = false;
    for (const char c : line.substr(equals, line.find("  # ") - equals)) {
      if (c == '"') text = !text;
      number = number || (!text && c >= '0' && c <= '9');
    }
    if (!number) continue;
    const bool ours = line.find("  # guess") != std::string::npos;
    EXPECT_TRUE(ours || line.find("  # from the collision shapes") != std::string::npos) << line;
    marked += ours ? 1 : 0;
  }
  EXPECT_GT(marked, 20);
}

TEST(NewRobot, GivesAJointAboutAVerticalAxisTheEffortToTurnWhatItCarries) {
  std::string text = text_of(kPublicRobots[1]);  // UR5e, as if nobody knew its drives
  text = std::regex_replace(text, std::regex("effort=\"[0-9.]+\""), "effort=\"0\"");
  text = std::regex_replace(text, std::regex("velocity=\"[0-9.]+\""), "velocity=\"0\"");
  const NewRobot arm = made_of(text);
  const std::vector<JointLoad> loads = loads_of(arm.tree, {}, nullptr);
  for (std::size_t j = 0; j < arm.limits.size(); ++j) {
    ASSERT_TRUE(arm.limits[j].effort_guessed);
    EXPECT_GE(arm.limits[j].effort, 2.0 * loads[j].gravity_Nm + 10.0 * loads[j].most_inertia);
    const double before = j == 0 ? 0.0 : arm.limits[j - 1].effort;
    EXPECT_GE(arm.limits[j].effort, 0.15 * before);
  }
  const int pan = arm.tree.joint_index("shoulder_pan_joint");
  EXPECT_LT(loads[pan].gravity_Nm, 1e-6) << "gravity alone says nothing of it";
  EXPECT_GT(arm.limits[pan].effort, 20.0);
}

TEST(NewRobot, SaysWhichDrivesAreTooWeakForThePosture) {
  std::string text = text_of(kPublicRobots[1]);
  text = std::regex_replace(text, std::regex("effort=\"[0-9.]+\""), "effort=\"4\"");
  const NewRobot arm = made_of(text);
  const std::vector<double> torques = torques_at(arm.tree, {}, Posed(arm.tree, posture_in(arm)));
  std::size_t weak = 0;
  for (const double torque : torques) weak += std::abs(torque) > 0.9 * 4.0 ? 1U : 0U;
  ASSERT_GT(weak, 0U);
  EXPECT_EQ(arm.warnings.size(), weak);
  for (const Error& warning : arm.warnings) {
    EXPECT_NE(warning.message.find("its limit (<limit effort>) is 4 Nm"), std::string::npos)
        << warning.to_string();
    EXPECT_NE(warning.message.find("it will sag, or stop with a fault"), std::string::npos);
    EXPECT_GT(warning.line, 0);
  }
  EXPECT_TRUE(made(kPublicRobots[1]).warnings.empty());
  // At 0.95 of its limit a joint holds, and the warning said that it would not.
  for (const Error& warning : weak_drives(arm, std::vector<double>(torques.size(), 0.95 * 4.0))) {
    EXPECT_NE(warning.message.find("4 Nm: little reserve is left to move"), std::string::npos)
        << warning.to_string();
  }
  EXPECT_EQ(weak_drives(arm, std::vector<double>(torques.size(), 3.8)).size(), torques.size());
}

TEST(NewRobot, KeepsAnArmThatStandsOnItsBaseAboveIt) {
  for (const int arm : {1, 2}) {
    const NewRobot robot = made(kPublicRobots[arm]);
    EXPECT_GT(Posed(robot.tree, posture_in(robot)).lowest_m(), 0.0) << robot.config.name;
    for (const WayPoint& point : robot.move.points) {
      EXPECT_GE(Posed(robot.tree, positions_in(robot, point.position_rad)).lowest_m(), 0.0);
    }
  }
  EXPECT_FALSE(stands_on_its_base(made(kPublicRobots[0]).tree) &&
               Posed(made(kPublicRobots[0]).tree, posture_in(made(kPublicRobots[0]))).lowest_m() <
                   0.0);
}

TEST(NewRobot, SaysOfAMoveWhatItDoes) {
  const NewRobot humanoid = made(kPublicRobots[4]);  // limits that do not belong together
  EXPECT_EQ(humanoid.move.squat_m, 0.0);
  EXPECT_EQ(move_text(humanoid).find("Squat"), std::string::npos) << move_text(humanoid);
  EXPECT_NE(move_text(humanoid).find("hold back [rad or m]: "), std::string::npos);
  EXPECT_TRUE(std::ranges::any_of(humanoid.move.held_back,
                                  [](const auto& held) { return held.joint == "WAIST_P"; }));
  const int elbow = humanoid.config.joint_index("LARM_ELBOW");
  EXPECT_GT(
      humanoid.move.points[0].position_rad[elbow] - humanoid.move.points[1].position_rad[elbow],
      0.1)
      << "a weak waist is no reason for the arms to stay";
  const NewRobot coman = made(kPublicRobots[5]);
  EXPECT_GT(coman.move.squat_m, 0.005);
  EXPECT_NE(move_text(coman).find("# Squats "), std::string::npos);
}

/// The simulated contact of a ball is a point of its shank, and no slip can help feet that are
/// asked to part.
TEST(NewRobot, LeavesPointFeetWhereTheyAreWhileTheRobotGoesDown) {
  const NewRobot anymal = made(kPublicRobots[3]);
  ASSERT_GT(anymal.move.squat_m, 0.005);
  const auto spans = [&](const Eigen::VectorXd& q) {
    const Posed posed(anymal.tree, q);
    std::vector<double> found;
    for (const FoundFoot& foot : anymal.feet) {
      const model::Placement sole = posed.link(foot.link) * foot.sole_in_link;
      const model::Placement first = posed.link(anymal.feet[0].link) * anymal.feet[0].sole_in_link;
      found.push_back(
          (sole.R * foot.points[0] + sole.p - first.R * anymal.feet[0].points[0] - first.p).norm());
    }
    return found;
  };
  const std::vector<double> standing = spans(posture_in(anymal));
  for (const WayPoint& point : anymal.move.points) {
    const std::vector<double> now = spans(positions_in(anymal, point.position_rad));
    for (std::size_t f = 0; f < now.size(); ++f) EXPECT_NEAR(now[f], standing[f], 1e-4);
  }
}

TEST(NewRobot, WritesNamesAsTomlNeedsThem) {
  std::string text = text_of(kPublicRobots[0]);
  const std::string name = made(kPublicRobots[0]).tree.joints[1].name;
  for (std::size_t at = 0; (at = text.find('"' + name + '"', at)) != std::string::npos; ++at) {
    text.replace(at, name.size() + 2, "\"a &quot;b\\c\"");
  }
  const NewRobot robot = made_of(text);
  const auto read =
      hal::parse_robot_config(robot_text(robot, "x\".urdf", "x\".urdf"), "robot.toml");
  ASSERT_TRUE(read) << read.error().front().to_string();
  EXPECT_EQ(read->joints[1].name, "a \"b\\c");
  EXPECT_TRUE(runtime::parse_experiment(move_text(robot), "move.toml", *read));
}

TEST(TomlWords, KeysAreBareWhereTomlAllowsIt) {
  EXPECT_EQ(key_of("Left-knee_2"), "Left-knee_2");
  for (const std::string quoted : {"left knee", "left.knee", "l+r", "gen\xC3\xBC", ""}) {
    EXPECT_EQ(key_of(quoted), '"' + quoted + '"');
  }
}

/// A one-legged hopper whose root moves by a floating joint, and whose foot's inertia is
/// impossible.
constexpr char kHopper[] = R"(<robot name="hopper">
  <link name="world"/>
  <joint name="free" type="floating"><parent link="world"/><child link="body"/></joint>
  <link name="body"><inertial><mass value="10"/><inertia ixx="0.2" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hip" type="revolute"><parent link="body"/><child link="thigh"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="50" velocity="10"/></joint>
  <link name="thigh"><inertial><origin xyz="0 0 -0.2"/><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="knee" type="revolute"><origin xyz="0 0 -0.4"/><parent link="thigh"/><child link="shank"/><axis xyz="0 1 0"/><limit lower="0" upper="2" effort="50" velocity="10"/></joint>
  <link name="shank"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="ankle" type="revolute"><origin xyz="0 0 -0.4"/><parent link="shank"/><child link="stub"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="30" velocity="10"/></joint>
  <link name="stub"><inertial><mass value="0.5"/><inertia ixx="0.001" iyy="0.001" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.03 0 -0.05"/><geometry><box size="0.2 0.1 0.02"/></geometry></collision></link>
</robot>)";

TEST(NewRobot, UsesWhatTheReaderOffersForFloatingRootsAndImpossibleInertias) {
  const test::ScratchFolder folder;
  const std::string file = folder / "hopper.urdf";
  std::ofstream(file) << kHopper;
  const auto robot = make_robot({.urdf = file, .name = "hopper"});
  ASSERT_TRUE(robot) << robot.error().front().to_string();
  EXPECT_TRUE(robot->config.model.floating_base);
  EXPECT_TRUE(robot->config.model.repair_inertia);
  ASSERT_EQ(robot->feet.size(), 1U) << "the lowest end, though it is called stub";
  EXPECT_EQ(robot->feet[0].points.size(), 4U);
  EXPECT_NE(robot_text(*robot, "h.urdf", "h.urdf").find("inertia = \"repair\""), std::string::npos);
}

/// Its box ends 15 mm above the ground that the link says.
TEST(NewRobot, PutsContactPointsIntoThePlaneOfALevelSoleLink) {
  const std::string sole = R"(<link name="sole"/>
  <joint name="to_sole" type="fixed"><origin xyz="0.03 0 -0.075"/><parent link="stub"/><child link="sole"/></joint>
</robot>)";
  const NewRobot robot = made_of(std::regex_replace(kHopper, std::regex("</robot>"), sole));
  ASSERT_EQ(robot.feet.size(), 1U);
  const FoundFoot& foot = robot.feet[0];
  EXPECT_EQ(robot.tree.links[static_cast<std::size_t>(foot.link)].name, "sole");
  ASSERT_EQ(foot.points.size(), 4U);
  for (const Eigen::Vector3d& p : foot.points) {
    const Eigen::Vector3d in_link = foot.sole_in_link.R * p + foot.sole_in_link.p;
    EXPECT_NEAR(in_link.z(), 0.0, 1e-12);
    EXPECT_NEAR(std::abs(in_link.x()), 0.1, 1e-12) << "where the box has its corners";
    EXPECT_NEAR(std::abs(in_link.y()), 0.05, 1e-12);
  }
}

/// Chains of two joints each on a fixed root, at `y_m`.
std::string star(const std::vector<double>& y_m) {
  std::string urdf = "<robot name='star'><link name='root'/>";
  for (std::size_t i = 0; i < y_m.size(); ++i) {
    std::string parent = "root", origin = "0 " + std::to_string(y_m[i]) + " 0";
    for (const char* part : {"upper", "lower"}) {
      const std::string link = part + std::to_string(i);
      urdf += "<joint name='to_" + link + "' type='revolute'><origin xyz='" + origin +
              "'/><parent link='" + parent + "'/><child link='" + link +
              "'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='20' velocity='5'/></joint>"
              "<link name='" +
              link +
              "'><inertial><origin xyz='0 0 0.1'/><mass value='1'/><inertia ixx='0.01' iyy='0.01' "
              "izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link>";
      parent = link;
      origin = "0 0 0.2";
    }
  }
  return urdf + "</robot>";
}

TEST(NewRobot, CallsALimbLeftOrRightOnlyWhenItIsAside) {
  std::vector<std::string> names;
  for (const Limb& limb : made_of(star({0.3, 0.0, -0.3})).limbs) names.push_back(limb.name);
  EXPECT_EQ(names, (std::vector<std::string>{"left_arm", "arm", "right_arm"}));
}

TEST(NewRobot, ToldOfNoMovingJointIsAnError) {
  const test::ScratchFolder folder;
  const std::string file = folder / "stone.urdf";
  std::ofstream(file) << "<robot name='stone'><link name='stone'/></robot>";
  const auto robot = make_robot({.urdf = file, .name = "stone"});
  ASSERT_FALSE(robot);
  EXPECT_NE(robot.error().front().message.find("no joint that moves"), std::string::npos);
}

TEST(Words, StandByThemselves) {
  EXPECT_TRUE(has_word("l_leg_ft", "ft"));
  EXPECT_TRUE(has_word("FT_LFoot_X", "ft"));
  EXPECT_TRUE(has_word("wristFtSensor", "ft"));
  EXPECT_FALSE(has_word("RSoftHand", "ft"));
  EXPECT_FALSE(has_word("left_arm", "ft"));
}

}  // namespace
}  // namespace tandem::scaffold
