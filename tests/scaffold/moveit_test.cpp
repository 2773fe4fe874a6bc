// Packages for MoveIt: what a reader of YAML and one of XML find in them, against the robot. Nobody
// here has a ROS 2.
#include "scaffold/moveit.hpp"

#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "base/quoting.hpp"
#include "model/urdf.hpp"
#include "robot/robot_files.hpp"
#include "tests/scaffold/robots.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::scaffold {
namespace {

using Names = std::vector<std::string>;
using Pairs = std::set<std::pair<std::string, std::string>>;

robot::RobotFiles bundled(const std::string& name) {
  auto files =
      robot::read_robot(std::string(TANDEM_SOURCE_DIR) + "/config/" + name + "/robot.toml");
  if (!files) throw std::runtime_error(files.error().front().to_string());
  return std::move(*files);
}

Result<MoveItPackage> package_of(const robot::RobotFiles& robot, const std::string& action) {
  return make_moveit_package(robot.config, robot.tree,
                             robot::text_in(robot.files, robot.config.model.urdf), action);
}

const std::string& file_of(const MoveItPackage& package, const std::string& ending) {
  for (const auto& [path, text] : package.files)
    if (path.ends_with(ending)) return text;
  throw std::runtime_error("no such file: " + ending);
}

/// What moveit_package.py reads of it.
nlohmann::json as_ros_reads(const MoveItPackage& package) {
  const test::ScratchFolder scratch;
  const std::filesystem::path folder = scratch / "möve it";
  for (const auto& [path, text] : package.files) {
    const std::filesystem::path file = folder / path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
  }
  const std::string command = "python3 " +
                              shell_word(TANDEM_SOURCE_DIR "/tests/scaffold/moveit_package.py") +
                              " " + shell_word(folder.string());
  std::string read;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  char part[4096];
  for (std::size_t n = 0; (n = std::fread(part, 1, sizeof part, pipe)) > 0;) read.append(part, n);
  EXPECT_EQ(::pclose(pipe), 0) << command;
  return nlohmann::json::parse(read);
}

/// A description's joints by the link that each leads to, with its type.
struct Joint {
  std::string name, parent, type;
};
std::map<std::string, Joint> joints_by_child(const std::string& urdf) {
  tinyxml2::XMLDocument document;
  EXPECT_EQ(document.Parse(urdf.c_str()), tinyxml2::XML_SUCCESS);
  std::map<std::string, Joint> joints;
  const auto* e = document.RootElement()->FirstChildElement("joint");
  for (; e != nullptr; e = e->NextSiblingElement("joint")) {
    joints[e->FirstChildElement("child")->Attribute("link")] = {
        e->Attribute("name"), e->FirstChildElement("parent")->Attribute("link"),
        e->Attribute("type")};
  }
  return joints;
}

std::pair<std::string, std::string> in_order(std::string a, std::string b) {
  if (b < a) std::swap(a, b);
  return {a, b};
}

/// The SRDF, and what it says.
struct Semantics {
  tinyxml2::XMLDocument document;
  explicit Semantics(const std::string& text) {
    EXPECT_EQ(document.Parse(text.c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  }
  [[nodiscard]] std::vector<const tinyxml2::XMLElement*> all(const char* name) const {
    std::vector<const tinyxml2::XMLElement*> found;
    const auto* e = document.RootElement()->FirstChildElement(name);
    for (; e != nullptr; e = e->NextSiblingElement(name)) found.push_back(e);
    return found;
  }
  [[nodiscard]] Pairs disabled() const {
    Pairs pairs;
    for (const auto* e : all("disable_collisions"))
      pairs.insert(in_order(e->Attribute("link1"), e->Attribute("link2")));
    return pairs;
  }
};

/// Joints that move of a group, from the root's side.
Names moving_joints(const tinyxml2::XMLElement& group, const std::map<std::string, Joint>& joints) {
  Names names;
  const auto* chain = group.FirstChildElement("chain");
  if (chain == nullptr) {
    const auto* e = group.FirstChildElement("joint");
    for (; e != nullptr; e = e->NextSiblingElement("joint"))
      names.emplace_back(e->Attribute("name"));
    return names;
  }
  std::string link = chain->Attribute("tip_link");
  while (link != chain->Attribute("base_link")) {
    const auto at = joints.find(link);
    if (at == joints.end()) {
      ADD_FAILURE() << link << " does not hang on " << chain->Attribute("base_link");
      return {};
    }
    if (at->second.type != "fixed") names.push_back(at->second.name);
    link = at->second.parent;
  }
  std::ranges::reverse(names);
  return names;
}

class MoveIt : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Bundled, MoveIt,
                         ::testing::Values("ur5e", "panda", "coman", "walkman", "icub", "anymal_c",
                                           "double_pendulum"),
                         [](const auto& robot) { return std::string(robot.param); });

TEST_P(MoveIt, HasEveryJointInOneGroupThatTheDescriptionKnows) {
  const robot::RobotFiles robot = bundled(GetParam());
  const auto package = package_of(robot, "arm_action");
  ASSERT_TRUE(package) << package.error().to_string();
  const auto joints = joints_by_child(file_of(*package, ".urdf"));
  const Semantics semantics(file_of(*package, ".srdf"));
  EXPECT_EQ(semantics.document.RootElement()->Attribute("name"), robot.tree.name);
  const nlohmann::json read = as_ros_reads(*package);
  const nlohmann::json& manager = read["controllers"]["moveit_simple_controller_manager"];
  const auto groups = semantics.all("group");
  ASSERT_EQ(manager["controller_names"].size(), groups.size());

  std::multiset<std::string> grouped, wanted;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Names names = moving_joints(*groups[g], joints);
    EXPECT_FALSE(names.empty());
    grouped.insert(names.begin(), names.end());
    const std::string controller = manager["controller_names"][g];
    const std::string group = groups[g]->Attribute("name");
    EXPECT_EQ(controller, groups.size() == 1 ? "arm_action" : group + "_arm_action");
    EXPECT_EQ(manager[controller]["joints"], nlohmann::json(names));
    EXPECT_EQ(manager[controller]["action_ns"], "follow_joint_trajectory");
    EXPECT_EQ(manager[controller]["type"], "FollowJointTrajectory");
    EXPECT_EQ(read["kinematics"][group]["kinematics_solver"],
              "kdl_kinematics_plugin/KDLKinematicsPlugin");
    EXPECT_EQ(read["kinematics"][group].value("position_only_ik", false), names.size() < 6U);
  }
  for (const hal::JointConfig& joint : robot.config.joints) wanted.insert(joint.name);
  EXPECT_EQ(grouped, wanted);
}

TEST_P(MoveIt, HasTheLimitsThatARunKeeps) {
  const robot::RobotFiles robot = bundled(GetParam());
  const auto package = package_of(robot, "a");
  ASSERT_TRUE(package);
  const nlohmann::json limits = as_ros_reads(*package)["joint_limits"]["joint_limits"];
  EXPECT_EQ(limits.size(), robot.config.joints.size());
  for (const hal::JointConfig& joint : robot.config.joints) {
    ASSERT_TRUE(limits.contains(joint.name)) << joint.name;
    const nlohmann::json& own = limits[joint.name];
    const std::pair<const char*, double> figures[] = {
        {"min_position", joint.min_position_rad},
        {"max_position", joint.max_position_rad},
        {"max_velocity", joint.max_velocity_rad_s},
        {"max_acceleration", joint.max_acceleration_rad_s2}};
    for (const auto& [key, value] : figures) {
      ASSERT_TRUE(own[key].is_number_float()) << joint.name << ' ' << key << own[key];
      EXPECT_EQ(own[key].get<double>(), value) << joint.name << ' ' << key;
    }
    for (const char* key :
         {"has_position_limits", "has_velocity_limits", "has_acceleration_limits"})
      EXPECT_EQ(own[key], true) << joint.name << ' ' << key;
    EXPECT_EQ(own.contains("max_jerk"), std::isfinite(joint.max_jerk_rad_s3));
  }
}

TEST_P(MoveIt, HasThePosturesAndDescribesTheSameTree) {
  const robot::RobotFiles robot = bundled(GetParam());
  const auto package = package_of(robot, "a");
  ASSERT_TRUE(package);
  const Semantics semantics(file_of(*package, ".srdf"));
  std::map<std::string, std::map<std::string, double>> states;
  for (const auto* state : semantics.all("group_state")) {
    const auto* e = state->FirstChildElement("joint");
    for (; e != nullptr; e = e->NextSiblingElement("joint"))
      states[state->Attribute("name")][e->Attribute("name")] = e->DoubleAttribute("value");
  }
  const nlohmann::json read = as_ros_reads(*package);
  for (const hal::PostureConfig& posture : robot.config.postures) {
    ASSERT_EQ(states[posture.name].size(), robot.config.joints.size());
    for (std::size_t j = 0; j < robot.config.joints.size(); ++j)
      EXPECT_EQ(states[posture.name][robot.config.joints[j].name], posture.position_rad[j]);
  }
  for (const auto& [joint, at] : read["initial"]["initial_positions"].items()) {
    EXPECT_TRUE(at.is_number_float()) << joint;
    EXPECT_EQ(at.get<double>(), states[robot.config.postures[0].name][joint]);
  }

  // Locked joints stand still where they are locked, and nothing else is otherwise.
  const auto again =
      model::parse_urdf(file_of(*package, ".urdf"), "package.urdf",
                        {.floating_base = robot.tree.floating_base, .repair_inertia = true});
  ASSERT_TRUE(again) << again.error().front().to_string();
  ASSERT_EQ(again->tree.joints.size(), robot.tree.joints.size());
  for (std::size_t j = 0; j < robot.tree.joints.size(); ++j)
    EXPECT_EQ(again->tree.joints[j].name, robot.tree.joints[j].name);
  ASSERT_EQ(again->tree.links.size(), robot.tree.links.size());
  for (std::size_t l = 0; l < robot.tree.links.size(); ++l) {
    const model::Link &ours = robot.tree.links[l], &theirs = again->tree.links[l];
    EXPECT_EQ(theirs.name, ours.name);
    EXPECT_TRUE(theirs.in_body.R.isApprox(ours.in_body.R, 1e-12)) << ours.name;
    EXPECT_LT((theirs.in_body.p - ours.in_body.p).norm(), 1e-12) << ours.name;
  }
}

TEST_P(MoveIt, StartsMoveGroupAndRVizWithItsFiles) {
  const auto package = package_of(bundled(GetParam()), "a");
  ASSERT_TRUE(package);
  const nlohmann::json read = as_ros_reads(*package);
  ASSERT_EQ(read["nodes"].size(), 2U);
  EXPECT_EQ(read["nodes"][0]["executable"], "move_group");
  EXPECT_EQ(read["nodes"][0]["parameters"][0]["robot_description"], file_of(*package, ".urdf"));
  EXPECT_EQ(read["nodes"][0]["parameters"][2]["use_sim_time"], "$use_sim_time");
  EXPECT_EQ(read["nodes"][1]["package"], "rviz2");
  EXPECT_EQ(read["arguments"]["use_sim_time"], "true");
  const nlohmann::json& assistant = read["assistant"]["moveit_setup_assistant_config"];
  EXPECT_EQ(assistant["urdf"]["package"], package->name);
  for (const char* which : {"urdf", "srdf"}) {
    const std::string path = assistant[which]["relative_path"];
    EXPECT_NO_THROW(file_of(*package, path)) << path;
  }
  tinyxml2::XMLDocument manifest;
  ASSERT_EQ(manifest.Parse(file_of(*package, "package.xml").c_str()), tinyxml2::XML_SUCCESS);
  EXPECT_EQ(manifest.RootElement()->FirstChildElement("name")->GetText(), package->name);
  EXPECT_NE(file_of(*package, "CMakeLists.txt").find("project(" + package->name),
            std::string::npos);
}

// As its maker's ur_moveit_config has it, but for links without shapes.
TEST(MoveItPackage, KnowsTheNeighboursOfAUr5e) {
  const auto package = package_of(bundled("ur5e"), "a");
  ASSERT_TRUE(package);
  EXPECT_EQ(package->name, "ur5e_moveit_config");
  ASSERT_EQ(package->groups.size(), 1U);
  EXPECT_EQ(package->groups[0].name, "arm");
  EXPECT_EQ(package->groups[0].base_link, "base_link_inertia");
  EXPECT_EQ(package->groups[0].tip_link, "tool0");
  const Semantics semantics(file_of(*package, ".srdf"));
  EXPECT_EQ(semantics.disabled(), (Pairs{{"base_link_inertia", "shoulder_link"},
                                         {"shoulder_link", "upper_arm_link"},
                                         {"forearm_link", "upper_arm_link"},
                                         {"forearm_link", "wrist_1_link"},
                                         {"wrist_1_link", "wrist_2_link"},
                                         {"wrist_2_link", "wrist_3_link"}}));
  const auto* fixed = semantics.all("virtual_joint").at(0);
  EXPECT_STREQ(fixed->Attribute("type"), "fixed");
  EXPECT_STREQ(fixed->Attribute("child_link"), "world");
  ASSERT_EQ(package->warnings.size(), 1U);
  EXPECT_NE(package->warnings[0].to_string().find("max_acceleration_rad_s2"), std::string::npos);
}

TEST(MoveItPackage, KnowsTheNeighboursOfAPanda) {
  const auto package = package_of(bundled("panda"), "a");
  ASSERT_TRUE(package);
  const Pairs disabled = Semantics(file_of(*package, ".srdf")).disabled();
  for (int i = 0; i < 7; ++i) {
    const std::string link = "panda_link";
    EXPECT_TRUE(disabled.contains({link + std::to_string(i), link + std::to_string(i + 1)})) << i;
  }
  for (const char* finger : {"panda_leftfinger", "panda_rightfinger"})
    EXPECT_TRUE(disabled.contains({"panda_hand", finger})) << finger;
  EXPECT_TRUE(disabled.contains({"panda_hand", "panda_link7"})) << "link8 has no shape";
  EXPECT_FALSE(disabled.contains({"panda_link5", "panda_link7"})) << "nobody computed that";
  EXPECT_TRUE(package->warnings.empty()) << package->warnings[0].to_string();
}

TEST(MoveItPackage, GivesAHumanoidAGroupALimbAndABaseThatFloats) {
  const auto package = package_of(bundled("coman"), "a");
  ASSERT_TRUE(package);
  std::map<std::string, std::size_t> sizes;
  for (const MoveItGroup& group : package->groups) sizes[group.name] = group.joints.size();
  EXPECT_EQ(
      sizes,
      (std::map<std::string, std::size_t>{
          {"left_arm", 7}, {"left_leg", 6}, {"right_arm", 7}, {"right_leg", 6}, {"torso", 3}}));
  const Semantics semantics(file_of(*package, ".srdf"));
  EXPECT_STREQ(semantics.all("virtual_joint").at(0)->Attribute("type"), "floating");
  EXPECT_EQ(std::ranges::find(package->groups, "left_leg", &MoveItGroup::name)->tip_link, "l_sole");
}

// Its fingers are free here, and one follows the other.
TEST(MoveItPackage, MakesAHandAnEndEffector) {
  const NewRobot made_robot = made(public_robot("panda"));
  const std::string urdf = robot::text_of(path_of(public_robot("panda")));
  const auto package = make_moveit_package(made_robot.config, made_robot.tree, urdf, "a");
  ASSERT_TRUE(package) << package.error().to_string();
  ASSERT_EQ(package->groups.size(), 2U);
  EXPECT_EQ(package->groups[0].tip_link, "panda_hand");
  const Semantics semantics(file_of(*package, ".srdf"));
  const auto joints = joints_by_child(file_of(*package, ".urdf"));
  const auto groups = semantics.all("group");
  EXPECT_EQ(moving_joints(*groups[1], joints),
            (Names{"panda_finger_joint1", "panda_finger_joint2"}));
  const auto* effector = semantics.all("end_effector").at(0);
  EXPECT_STREQ(effector->Attribute("group"), "arm_end");
  EXPECT_STREQ(effector->Attribute("parent_group"), "arm");
  EXPECT_STREQ(effector->Attribute("parent_link"), "panda_hand");
  const nlohmann::json read = as_ros_reads(*package);
  const nlohmann::json& manager = read["controllers"]["moveit_simple_controller_manager"];
  EXPECT_EQ(manager["arm_end_a"]["joints"], nlohmann::json{"panda_finger_joint1"})
      << "a follower has no drive";
  EXPECT_FALSE(read["kinematics"].contains("arm_end"));
}

TEST(MoveItPackage, RefusesWhatMoveItCannotBeTold) {
  const auto loop = package_of(bundled("four_bar"), "a");
  ASSERT_FALSE(loop);
  EXPECT_NE(loop.error().message.find("loops"), std::string::npos);

  robot::RobotFiles arm = bundled("panda");
  arm.config.model.mimic_independent = true;
  const auto mimic = package_of(arm, "a");
  ASSERT_FALSE(mimic);
  EXPECT_NE(mimic.error().message.find("independent"), std::string::npos);

  arm = bundled("ur5e");
  const std::string floats =
      "<robot name='r'><joint name='base' type='floating'><parent link='w'/><child link='b'/>"
      "</joint></robot>";
  const auto floating = make_moveit_package(arm.config, arm.tree, floats, "a");
  ASSERT_FALSE(floating);
  EXPECT_NE(floating.error().message.find("'base'"), std::string::npos);
}

TEST(MoveItPackage, SaysThatContinuousJointsHaveNoLimitsThere) {
  robot::RobotFiles robot = bundled("panda");
  robot.tree.joints[2].type = model::JointType::kContinuous;
  const auto package = package_of(robot, "a");
  ASSERT_TRUE(package);
  ASSERT_EQ(package->warnings.size(), 1U);
  EXPECT_NE(package->warnings[0].to_string().find("panda_joint3"), std::string::npos);
  const nlohmann::json limits = as_ros_reads(*package)["joint_limits"]["joint_limits"];
  EXPECT_FALSE(limits["panda_joint3"].contains("max_position")) << "MoveIt complains of it";
  EXPECT_TRUE(limits["panda_joint2"].contains("max_position"));
}

// Names are texts of others: a joint called `on`, a robot with a blank, <, & and quotes.
TEST(MoveItPackage, TakesNamesAsTheyAre) {
  robot::RobotFiles robot = bundled("double_pendulum");
  robot.config.name = "0Robot--x";
  robot.tree.name = "a<b & \"c\"";
  robot.config.joints[0].name = robot.tree.joints[0].name = "on";
  robot.config.joints[1].name = robot.tree.joints[1].name = "1: [\"ä\\";
  for (std::size_t j = 0; j < 2; ++j) {
    for (model::Link& link : robot.tree.links)
      if (link.moving == static_cast<int>(j)) link.joint = robot.tree.joints[j].name;
  }
  const auto package = package_of(robot, "no");
  ASSERT_TRUE(package) << package.error().to_string();
  EXPECT_EQ(package->name, "robot_0robot_x_moveit_config");
  const Semantics semantics(file_of(*package, ".srdf"));
  EXPECT_EQ(semantics.document.RootElement()->Attribute("name"), robot.tree.name);
  const nlohmann::json read = as_ros_reads(*package);
  EXPECT_TRUE(read["joint_limits"]["joint_limits"].contains("on"));
  EXPECT_EQ(read["controllers"]["moveit_simple_controller_manager"]["no"]["joints"],
            (nlohmann::json{"on", "1: [\"ä\\"}));
}

}  // namespace
}  // namespace tandem::scaffold
