// What exporters and people write into URDFs, a row each: taken with a word, or refused with the
// reason; and what `tandem new` makes of it, the reader of robot.toml takes.
#include <gtest/gtest.h>

#include <fstream>
#include <ostream>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "robot/complete_robot.hpp"
#include "scaffold/new_robot.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::scaffold {
namespace {

constexpr const char* kMass =
    R"(<inertial><origin xyz="0 0 0.1"/><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>)";

/// An arm of two joints and a finger that follows; each mark is where a row writes.
const char* const kArm = R"(<robot name="arm" HEAD>
<link name="base"/>
<link name="a">MASS_A</link>
<link name="b">MASS_B</link>
<link name="tip">MASS_T</link>
<joint name="j1" TYPE1><parent link="base"/><child link="a"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>LIMIT1</joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="10" velocity="3"/></joint>
<joint name="j3" type="revolute"><parent link="b"/><child link="tip"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>LIMIT3</joint>
MORE
</robot>
)";

struct Quirk {
  const char* name;
  std::vector<std::pair<std::string, std::string>> marks;
  bool taken;
  std::vector<std::string> words;  ///< of warnings and files when it is taken, of errors when not
  std::vector<std::pair<std::string, double>> lock = {};
};
void PrintTo(const Quirk& quirk, std::ostream* out) { *out << quirk.name; }

std::string limit(const std::string& attributes) { return "<limit " + attributes + "/>"; }

std::string inertial(const std::string& kg, const std::string& diagonal,
                     const std::string& more = {}) {
  return "<inertial><mass value='" + kg + "'/><inertia ixx='" + diagonal + "' iyy='" + diagonal +
         "' izz='" + diagonal + "' ixy='0' ixz='0' iyz='0' " + more + "/></inertial>";
}

const std::string kSome = "lower='-1' upper='1' effort='20' velocity='3'";
const std::string kMimic = "<mimic joint='j1' multiplier='-1'/>";

std::string text_of(const Quirk& quirk) {
  std::vector<std::pair<std::string, std::string>> all = quirk.marks;
  for (const auto& [mark, usual] :
       std::vector<std::pair<std::string, std::string>>{{"HEAD", ""},
                                                        {"MASS_A", kMass},
                                                        {"MASS_B", kMass},
                                                        {"MASS_T", kMass},
                                                        {"TYPE1", "type='revolute'"},
                                                        {"LIMIT1", limit(kSome)},
                                                        {"LIMIT3", limit(kSome)},
                                                        {"MORE", ""}})
    all.emplace_back(mark, usual);
  std::string text = kArm;
  for (const auto& [mark, instead] : all)
    if (const std::size_t at = text.find(mark); at != std::string::npos)
      text.replace(at, mark.size(), instead);
  return text;
}

std::string joined(const Diagnostics& all) {
  std::string text;
  for (const Error& one : all) text += one.to_string() + "\n";
  return text;
}

const std::vector<Quirk> kQuirks{
    // --- namespaces and extensions ---
    // source: RobotLocomotion/drake #15122
    {"NamespacedLimit",
     {{"HEAD", "xmlns:drake='http://drake.mit.edu'"},
      {"LIMIT1", limit(kSome + " drake:acceleration='10'")}},
     true,
     {"other XML namespaces is not used (1 place): drake:acceleration of <limit>"}},
    {"NamespacedElementAndOrigin",
     {{"MASS_A", std::string(kMass) + "<gz:self_collide>1</gz:self_collide>"},
      {"MORE", "<drake:ignore/><drake:ignore/>"}},
     true,
     {"(3 places): <drake:ignore>, <gz:self_collide> in <link>"}},
    {"NamespaceDeclaredInAJoint", {{"TYPE1", "type='revolute' xmlns:gz='http://gz'"}}, true, {}},
    // source: stack-of-tasks/pinocchio simple_humanoid
    {"CollisionChecking",
     {{"MASS_A",
       std::string("<collision_checking><capsule radius='1'/></collision_checking>") + kMass}},
     true,
     {"<collision_checking> in <link> is not used"}},
    {"ExtensionBesideALimit",
     {{"LIMIT1", limit(kSome + " effort_factor='2'")}},
     true,
     {"'effort_factor' of <limit> is not used"}},
    {"MisspeltCollision",
     {{"MASS_A", std::string("<colision/>") + kMass}},
     false,
     {"did you mean <collision>?"}},
    {"MisspeltInertial", {{"MASS_A", "<intertial/>"}}, false, {"did you mean <inertial>?"}},
    {"OtherNameOfALimit",
     {{"LIMIT1", limit("lower='-1' upper='1' max_effort='20' velocity='3'")}},
     false,
     {"unknown attribute 'max_effort' of <limit> (did you mean 'effort'?)"}},
    {"MisspeltSoftLimit",
     {{"LIMIT1",
       limit(kSome) + "<safety_controller soft_lowr_limit='-0.5' soft_upper_limit='1'/>"}},
     false,
     {"did you mean 'soft_lower_limit'?"}},
    // --- inertias ---
    // source: Kinova/kinova-movo
    {"FullInertiaMatrix", {{"MASS_A", inertial("1", "0.01", "iyx='0' izx='0' izy='0'")}}, true, {}},
    {"FullInertiaMatrixThatDiffers",
     {{"MASS_A", inertial("1", "0.01", "iyx='0.002'")}},
     false,
     {"'iyx' of <inertia> is \"0.002\", but 'ixy' is \"0\""}},
    {"LowerHalfOfAnInertia",
     {{"MASS_A",
       "<inertial><mass value='1'/><inertia ixx='1' iyx='0' izx='0' izy='0' iyy='1' "
       "izz='1'/></inertial>"}},
     false,
     {"'iyx' of <inertia> (did you mean 'ixy'?)", "did you mean 'ixz'?", "did you mean 'iyz'?"}},
    // source: turtlebot/turtlebot_arm #20
    {"InertiaOfAGiant",
     {{"MASS_T", inertial("0.01", "1")}},
     true,
     {"more than 10 m; taken:", "inertia = \"repair\""}},
    // source: Gepetto/example-robot-data romeo.urdf
    {"BadInertiaAndAJointWithoutMass",
     {{"MASS_A",
       "<inertial><mass value='1'/><inertia ixx='0.001' iyy='0.001' izz='0.01' ixy='0' "
       "ixz='0' iyz='0'/></inertial>"},
      {"MASS_T", ""}},
     false,
     {"joint j3: the joint moves nothing that has mass"}},
    {"LinkWithoutMassBetweenJoints",
     {{"MASS_B", ""}},
     true,
     {"1 link has no mass, though between two joints that move: b"}},
    {"InertiaBeyondItsLink",
     {{"MASS_T", inertial("0.1", "0.1") +
                     "<collision><geometry><box size='0.05 0.05 0.05'/></geometry></collision>"}},
     true,
     {"1 link has an inertia that is too large for the link: tip (radius of gyration 1 m"}},
    // source: JAKARobotics/jaka_ros2 #15
    {"MassesInGrams",
     {{"MASS_A", inertial("41377", "20")}, {"MASS_B", inertial("41377", "20")}},
     true,
     {"a density far above lead's: a (41377 kg, radius of gyration 0.022 m), and 1 more",
      "masses are in kilograms"}},
    // --- no limit ---
    // source: RobotLocomotion/drake #9513
    {"LimitsOf1e16",
     {{"LIMIT1", limit("lower='-1e16' upper='1e16' effort='20' velocity='3'")}},
     true,
     {"the limits of 1 revolute joint are none (j1: -1e16 to 1e16): read as continuous"}},
    {"LimitsOf999999",
     {{"LIMIT1", limit("lower='-999999' upper='999999' effort='20' velocity='3'")}},
     true,
     {"read as continuous"}},
    // source: gbionics/rod #66
    {"InfiniteLimits",
     {{"LIMIT1", limit("lower='-inf' upper='inf' effort='inf' velocity='INF'")}},
     true,
     {"(j1: -inf to inf): read as continuous", "velocity is no limit, effort is no limit"}},
    {"NumbersBeyondADouble",
     {{"LIMIT1", limit("lower='-1.8e308' upper='1.8e309' effort='1e400' velocity='nan'")}},
     true,
     {"read as continuous", "velocity is no limit, effort is no limit"}},
    {"InfiniteOnOneSide",
     {{"LIMIT1", limit("lower='0.5' upper='inf' effort='20' velocity='3'")}},
     true,
     {"upper is no limit", "min_position_rad = 0.5  # guess"}},
    {"InfiniteSlide",
     {{"TYPE1", "type='prismatic'"},
      {"LIMIT1", limit("lower='-inf' upper='inf' effort='200' velocity='0.5'")}},
     true,
     {"lower and upper are no limit", "min_position_rad = -0.1  # guess"}},
    {"MassThatIsInfinite",
     {{"MASS_A", inertial("inf", "1")}},
     false,
     {"'value' of <mass> is not finite"}},
    // --- limits that are not the hard ones ---
    // source: ros-industrial/universal_robot #349
    {"SoftLimits",
     {{"LIMIT1", limit(kSome) + "<safety_controller soft_lower_limit='-0.8' soft_upper_limit='0.7' "
                                "k_position='100' k_velocity='10'/>"}},
     true,
     {"min_position_rad = -0.8  # the description's soft limits", "max_position_rad = 0.7"}},
    {"SoftLimitsWithoutAWay",
     {{"LIMIT1", limit(kSome) + "<safety_controller soft_lower_limit='2' soft_upper_limit='3'/>"}},
     true,
     {"leave the joint no way"}},
    // source: ros/urdfdom #177
    {"AccelerationAndJerk",
     {{"LIMIT1", limit(kSome + " acceleration='8' deceleration='5' jerk='90'")}},
     true,
     {"max_acceleration_rad_s2 = 5  # the description's", "max_jerk_rad_s3 = 90"}},
    {"JerkAlone",
     {{"LIMIT1", limit(kSome + " jerk='90'")}},
     true,
     {"max_acceleration_rad_s2 = 60  # guess", "max_jerk_rad_s3 = 90"}},
    // --- followers ---
    // source: ros-industrial-attic/robotiq #157
    {"FollowerAgainstItsMultiplier",
     {{"LIMIT1", limit("lower='0' upper='0.8' effort='20' velocity='3'")},
      {"LIMIT3", limit("lower='0' upper='0.8757' effort='20' velocity='3'") + kMimic}},
     true,
     {"joint j3: its limits, 0 to 0.8757, contradict its <mimic>: joint 'j1' at 0 to 0.8 takes it "
      "to -0.8 to 0"}},
    {"FollowerOfAContinuousJoint",
     {{"TYPE1", "type='continuous'"}, {"LIMIT3", limit(kSome) + kMimic}},
     true,
     {"its range is narrowed to -1 to 1"}},
    // --- joints that are none ---
    {"PlanarJoint",
     {{"TYPE1", "type='planar'"}},
     false,
     {"joints of type 'planar' are not supported", "tandem new --lock j1"}},
    {"PlanarJointLocked",
     {{"TYPE1", "type='planar'"}},
     true,
     {"[model.lock]", "j1 = 0"},
     {{"j1", 0.0}}},
    {"PlanarJointLockedElsewhere",
     {{"TYPE1", "type='planar'"}},
     false,
     {"can be locked at 0 only"},
     {{"j1", 0.5}}},
    {"FloatingJointLocked",
     {{"MORE",
       "<link name='box'/><joint name='free' type='floating'><parent link='tip'/><child "
       "link='box'/></joint>"}},
     true,
     {"free = 0"},
     {{"free", 0.0}}},
    {"LockBeyondLimits",
     {},
     false,
     {"locks the joint at 2.000000, beyond its limits"},
     {{"j2", 2.0}}},
    // --- two defects ---
    {"TwoDefectsOfText",
     {{"LIMIT1", limit("lower='-1' uper='1' effort='20' velocity='3'")},
      {"MASS_T", inertial("-1", "0.01")}},
     false,
     {"unknown attribute 'uper'", "link tip: the mass is negative"}},
    {"LinkThatIsNotThereAndANegativeMass",
     {{"MORE", "<joint name='j4' type='fixed'><parent link='tipp'/><child link='x'/></joint>"},
      {"MASS_T", inertial("-1", "0.01")}},
     false,
     {"there is no link 'tipp', its parent", "link tip: the mass is negative"}},
    {"PlanarJointAndAJointWithoutMass",
     {{"TYPE1", "type='planar'"}, {"MASS_T", ""}},
     false,
     {"type 'planar'", "joint j3: the joint moves nothing that has mass"}},
    // --- exporters' habits ---
    {"ValuesWithBlanks",
     {{"LIMIT1", limit("lower=' -1 ' upper='\t1' effort='+20' velocity='3.'")}},
     true,
     {}},
    {"LimitsReversed",
     {{"LIMIT1", limit("lower='1' upper='-1' effort='20' velocity='3'")}},
     true,
     {"lower is above upper"}},
    {"UnknownElements",
     {{"MORE", "<material name='m'/><verbose value='Default'/>"}},
     true,
     {"<verbose> is not used"}},
};

class EveryQuirk : public ::testing::TestWithParam<Quirk> {};

TEST_P(EveryQuirk, IsTakenOrRefusedWithTheseWords) {
  const Quirk& quirk = GetParam();
  const test::ScratchFolder folder;
  const std::string file = folder / "arm.urdf";
  std::ofstream(file, std::ios::binary) << text_of(quirk);
  const auto robot = make_robot({.urdf = file, .name = "arm", .lock = quirk.lock});
  ASSERT_EQ(robot.has_value(), quirk.taken) << (robot ? "taken" : joined(robot.error()));
  std::string said = robot ? joined(robot->warnings) : joined(robot.error());
  if (robot) {
    const std::string toml = robot_text(*robot, "arm.urdf", "arm.urdf");
    for (const std::string& remark : robot->remarks) said += remark + "\n";
    said += toml;
    std::ofstream(folder / "robot.toml", std::ios::binary) << toml;
    const auto read = robot::read_complete_robot(folder / "robot.toml");
    EXPECT_TRUE(read.has_value()) << joined(read.error()) << toml;
  }
  for (const std::string& words : quirk.words)
    EXPECT_NE(said.find(words), std::string::npos) << words << "\n--- in:\n" << said;
}

INSTANTIATE_TEST_SUITE_P(Quirks, EveryQuirk, ::testing::ValuesIn(kQuirks),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace tandem::scaffold
