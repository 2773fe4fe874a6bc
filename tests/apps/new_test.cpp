// `tandem new`: a folder from a URDF alone, and what then runs.
#include <algorithm>
#include <cmath>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class New : public Program {
 protected:
  /// Makes the folder, and lets the robot hold its posture and move.
  void holds_and_moves(const std::string& urdf, double most_rad, const std::string& flags = {}) {
    std::filesystem::remove_all(folder_ / "made");
    const std::string cache = "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
    Outcome outcome =
        tandem("new " + shell_word(TANDEM_SOURCE_DIR "/" + urdf) + " -o made" + flags, cache);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    outcome = tandem("model build made/robot.toml", cache);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    for (const std::string experiment : {"hold", "move"}) {
      outcome = tandem("run made/" + experiment + ".toml --no-log --json run.json", cache);
      ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
      const nlohmann::json run = json("run.json");
      EXPECT_TRUE(run["fault_log"].empty()) << experiment;
      EXPECT_FALSE(run["joints"].empty());
      for (const auto& [name, joint] : run["joints"].items()) {
        EXPECT_LT(joint["max_tracking_error_rad"].get<double>(), most_rad)
            << experiment << ": " << name;
      }
      if (!run["base"].is_null()) {
        EXPECT_LT(run["base"]["final_tilt_rad"].get<double>(), 0.02) << experiment;
      }
    }
  }
};

TEST_F(New, MakesAnArmHoldAndMove) {
  holds_and_moves("config/double_pendulum/double_pendulum.urdf", 0.01);
}

TEST_F(New, MakesAQuadrupedStandAndMoveOnPointFeet) {
  holds_and_moves("config/anymal_c/anymal_c.urdf", 0.01);
}

/// Its feet are meshes: points, by its topology.
TEST_F(New, MakesAQuadrupedStandOnFeetWithoutShapes) {
  holds_and_moves("tests/data/robots/unitree_go2.urdf", 0.03);
}

TEST_F(New, MakesAnArmHoldOnSpringsWithinADegree) {
  holds_and_moves("config/ur5e/ur5e.urdf", 0.0175, " --like coman");
  const std::string robot = read_text(folder_ / "made/robot.toml");
  EXPECT_NE(robot.find("shoulder_lift_joint has stiff for soft_arm: gravity takes"),
            std::string::npos);
}

TEST_F(New, MakesEveryPublicRobotHoldAndMove) {
  if (std::getenv("TANDEM_NEW_ALL") == nullptr) {
    GTEST_SKIP() << "in make test-all: TANDEM_NEW_ALL=1 compiles the kernels of eight robots";
  }
  for (const std::string urdf :
       {"config/ur5e/ur5e.urdf", "config/panda/panda.urdf", "config/coman/coman.urdf",
        "config/walkman/walkman.urdf", "config/icub/icub.urdf",
        "tests/data/robots/simple_humanoid.urdf"}) {
    SCOPED_TRACE(urdf);
    holds_and_moves(urdf, 0.03);
  }
  for (const std::string robot : {"unitree_h1", "unitree_g1"}) {  // light drives: softer hips
    SCOPED_TRACE(robot);
    holds_and_moves("tests/data/robots/" + robot + ".urdf", 0.05);
  }
  for (const std::string urdf :
       {"config/panda/panda.urdf", "tests/data/robots/simple_humanoid.urdf"}) {
    SCOPED_TRACE(urdf + " on springs");
    holds_and_moves(urdf, 0.03, " --like coman");
  }
}

TEST_F(New, WhatSlidesIsShownInMillimetresAndNewtons) {
  write_text(folder_ / "cart.urdf", R"(<robot name="cart">
  <link name="rail"/>
  <link name="wagon"><inertial><mass value="2"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="pole"><inertial><origin xyz="0 0 -0.2"/><mass value="0.5"/>
    <inertia ixx="0.005" iyy="0.005" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="drive" type="prismatic"><parent link="rail"/><child link="wagon"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="50" velocity="1"/></joint>
  <joint name="swing" type="revolute"><parent link="wagon"/><child link="pole"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="5" velocity="3"/></joint>
</robot>)");
  const std::string cache = "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
  Outcome outcome = tandem("new cart.urdf -o cart", cache);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  outcome = tandem("run cart/move.toml --duration 2 --log . --report", cache);
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const auto line = [&outcome](const std::string& joint) {
    const std::size_t at = outcome.out.find("\n  " + joint) + 1;
    return outcome.out.substr(at, outcome.out.find('\n', at) - at);
  };
  EXPECT_EQ(line("drive").substr(line("drive").size() - 3), " mm") << outcome.out;
  EXPECT_EQ(line("swing").substr(line("swing").size() - 4), " deg") << outcome.out;
  const std::string page = read_text(folder_ / "cart-move-001/report.html");
  EXPECT_NE(page.find(" mm</td>"), std::string::npos);
  EXPECT_NE(page.find(" N</td>"), std::string::npos);
}

/// A lift, an arm of four joints on it, and what slides at the arm's end.
const char kLifted[] = R"(<robot name="lifted">
  <link name="base"><inertial><origin xyz="0 0 0.1"/><mass value="10"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="column"><inertial><origin xyz="0 0 0.1"/><mass value="3"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="l0"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="l1"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="l2"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="l3"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="finger"><inertial><origin xyz="0 0 0.02"/><mass value="0.1"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="column"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.4" effort="320" velocity="0.3"/></joint>
  <joint name="r0" type="revolute"><parent link="column"/><child link="l0"/>
    <origin xyz="0 0 0.25"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5" effort="200" velocity="2"/></joint>
  <joint name="r1" type="revolute"><parent link="l0"/><child link="l1"/>
    <origin xyz="0 0 0.25"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5" effort="200" velocity="2"/></joint>
  <joint name="r2" type="revolute"><parent link="l1"/><child link="l2"/>
    <origin xyz="0 0 0.25"/><axis xyz="0 0 1"/>
    <limit lower="-2.5" upper="2.5" effort="200" velocity="2"/></joint>
  <joint name="r3" type="revolute"><parent link="l2"/><child link="l3"/>
    <origin xyz="0 0 0.25"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5" effort="200" velocity="2"/></joint>
  <joint name="grip" type="prismatic"><parent link="l3"/><child link="finger"/>
    <origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" effort="20" velocity="0.1"/></joint>
</robot>)";

// The slides moved the fingers in every direction, so that the stretched arm between them was the
// best posture.
TEST_F(New, BendsAnArmBetweenTwoSlides) {
  write_text(folder_ / "lifted.urdf", kLifted);
  ASSERT_EQ(tandem("new lifted.urdf -o lifted").status, 0);
  const std::string text = read_text(folder_ / "lifted/robot.toml");
  const std::size_t posture = text.find("[posture.");
  ASSERT_NE(posture, std::string::npos);
  double bent = 0.0;
  for (const std::string joint : {"\nr1 = ", "\nr3 = "}) {
    const std::size_t at = text.find(joint, posture);
    if (at != std::string::npos) bent += std::abs(std::stod(text.substr(at + joint.size())));
  }
  EXPECT_GT(bent, 0.5) << text.substr(posture);
}

// 0.5, a joint's that turns, was 0.5 m: the lift was pushed to its end, and nothing tripped.
TEST_F(New, TripsASlideThatIsPushedAway) {
  write_text(folder_ / "lifted.urdf", kLifted);
  const std::string cache = "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
  ASSERT_EQ(tandem("new lifted.urdf -o lifted", cache).status, 0);
  const std::string text = read_text(folder_ / "lifted/robot.toml");
  EXPECT_NE(text.find("following_error_rad = 0.03 "), std::string::npos) << text;
  EXPECT_NE(text.find("following_error_rad = 0.01 "), std::string::npos) << text;
  const std::string run = "run lifted/hold.toml --no-log --no-socket --duration 5 --json run.json";
  EXPECT_EQ(tandem(run, cache).status, 0) << "without a push";
  const auto pushed = [&](const std::string& force_N) {
    write_text(folder_ / "push.toml",
               "[[fault]]\nkind = \"push\"\njoint = \"lift\"\nforce_N = [0, 0, -" + force_N +
                   "]\nafter_enabled_s = 1\nfor_s = 3\n");
    const Outcome outcome = tandem(run + " --scenario push.toml", cache);
    EXPECT_EQ(outcome.status, 1);
    return outcome.err;
  };
  // It weighs 70 N and has 320: the first yields slowly. With the second the lift has more than
  // 400 N in it, 1.25 times its limit, from the first cycle on, and that is a fault sooner.
  const std::string slow = pushed("300"), fast = pushed("600");
  EXPECT_NE(slow.find("lift: following error"), std::string::npos) << slow;
  EXPECT_NE(fast.find("lift: torque limit exceeded"), std::string::npos) << fast;
  EXPECT_EQ(tandem("run lifted/move.toml --no-log --no-socket", cache).status, 0);
}

// The commands were not what a shell takes.
TEST_F(New, QuotesTheCommandsThatComeNext) {
  const Outcome made = tandem("new double_pendulum.urdf -o \"it's mine\"");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.out.find("\n  tandem run 'it'\\''s mine/hold.toml' --report\n"), std::string::npos)
      << made.out;
}

TEST_F(New, WritesOverNothingWithoutForce) {
  EXPECT_EQ(tandem("new double_pendulum.urdf").status, 0);
  write_text(folder_ / "double_pendulum/hold.toml", "mine");
  const Outcome again = tandem("new double_pendulum.urdf");
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.err.find("this exists already"), std::string::npos) << again.err;
  EXPECT_EQ(read_text(folder_ / "double_pendulum/hold.toml"), "mine");
  const Outcome forced = tandem("new double_pendulum.urdf --force");
  EXPECT_EQ(forced.status, 0);
  EXPECT_NE(read_text(folder_ / "double_pendulum/hold.toml"), "mine");
  EXPECT_EQ(read_text(folder_ / "double_pendulum/hold.toml~"), "mine");
  EXPECT_NE(forced.out.find("hold.toml that was there is hold.toml~ now"), std::string::npos)
      << forced.out;
  EXPECT_EQ(forced.out.find("robot.toml~"), std::string::npos) << "the same as before";
  write_text(folder_ / "double_pendulum/hold.toml", "mine, too");
  EXPECT_EQ(tandem("new double_pendulum.urdf --force").status, 0);
  EXPECT_EQ(read_text(folder_ / "double_pendulum/hold.toml~"), "mine") << "nor is a copy lost";
  EXPECT_EQ(read_text(folder_ / "double_pendulum/hold.toml~2"), "mine, too");
}

TEST_F(New, NamesWhatStandsWhereTheFolderShouldBe) {
  write_text(folder_ / "a_file", "mine");
  for (const std::string flags : {"", " --force"}) {
    const Outcome outcome = tandem("new double_pendulum.urdf -o a_file" + flags);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_EQ(outcome.err,
              "error: a_file: this is a file, and the robot needs a folder (give another one with "
              "-o)\n");
  }
  EXPECT_EQ(read_text(folder_ / "a_file"), "mine");
  const Outcome within = tandem("new double_pendulum.urdf -o a_file/robot");
  EXPECT_EQ(within.status, 2);
  EXPECT_EQ(within.err.rfind("error: a_file/robot: the folder cannot be made", 0), 0U)
      << within.err;
}

// It had named what is there already.
TEST_F(New, NamesAnInputThatIsNoFile) {
  std::filesystem::create_directory(folder_ / "arm");
  const Outcome outcome = tandem("new arm");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err, "error: arm: this is a folder (name a .urdf file)\n");
}

TEST_F(New, SaysWhichCommandATomlFileIsFor) {
  const Outcome robot = tandem("new robot.toml");
  EXPECT_EQ(robot.status, 2);
  EXPECT_NE(robot.err.find("robot.toml: this is a robot.toml already"), std::string::npos)
      << robot.err;
  EXPECT_NE(robot.err.find("tandem check robot.toml"), std::string::npos) << robot.err;
  const Outcome experiment = tandem("new hold.toml");
  EXPECT_EQ(experiment.status, 2);
  EXPECT_NE(experiment.err.find("tandem run hold.toml"), std::string::npos) << experiment.err;
}

/// Two links that turn: `first` and `second` stand in their joints, the links are called as given.
std::string two_links(const std::string& name, const std::string& first,
                      const std::string& second) {
  const std::string inertial =
      "<inertial><origin xyz='0 0 0.1'/><mass value='1'/><inertia ixx='0.01' iyy='0.01' "
      "izz='0.005' ixy='0' ixz='0' iyz='0'/></inertial>";
  return "<robot name='r'><link name='base'/>\n<joint name='a' type='revolute'><parent "
         "link='base'/><child link='l'/><axis xyz='0 1 0'/>" +
         first + "</joint>\n<link name='l'>" + inertial + "</link>\n<joint name='" + name +
         "' type='revolute'><origin xyz='0 0 0.2'/><parent link='l'/><child link='m'/><axis "
         "xyz='0 1 0'/>" +
         second + "</joint>\n<link name='m'>" + inertial + "</link></robot>";
}

constexpr char kLimit[] = "<limit lower='-1' upper='1' effort='20' velocity='3'/>";

TEST_F(New, TakesNamesWithQuotesAndRefusesThoseThatAreNoUtf8) {
  write_text(folder_ / "odd.urdf", two_links("b &quot;c\\d &#xFC;", kLimit, kLimit));
  const Outcome odd = tandem("new odd.urdf");
  EXPECT_EQ(odd.status, 0) << odd.err;
  EXPECT_NE(read_text(folder_ / "odd/robot.toml").find("\"b \\\"c\\\\d \xC3\xBC\""),
            std::string::npos);
  EXPECT_EQ(tandem("check odd/hold.toml").status, 0);
  write_text(folder_ / "latin.urdf", two_links("b\xFC", kLimit, kLimit));
  const Outcome latin = tandem("new latin.urdf");
  EXPECT_EQ(latin.status, 2);
  EXPECT_EQ(latin.err.rfind("error: latin.urdf:4: joint", 0), 0U) << latin.err;
  EXPECT_NE(latin.err.find("is not UTF-8"), std::string::npos) << latin.err;
  EXPECT_EQ(std::ranges::count(latin.err, '\n'), 1) << latin.err;
}

TEST_F(New, TakesOfALeadersRangeWhatItsFollowerCanKeep) {
  const auto follower = [](const std::string& range) {
    return "<limit " + range + " effort='20' velocity='3'/><mimic joint='a' multiplier='2'/>";
  };
  write_text(folder_ / "both.urdf", two_links("b", kLimit, follower("lower='-4' upper='1'")));
  const Outcome both = tandem("new both.urdf");
  EXPECT_EQ(both.status, 0) << both.err;
  EXPECT_NE(both.err.find("joint a: its range is narrowed to -1 to 0.5"), std::string::npos)
      << both.err;
  // 3 to 4 leaves the leader nothing, and 2 to 4 one position: such limits contradict the <mimic>.
  for (const std::string limits : {"lower='3' upper='4'", "lower='2' upper='4'"}) {
    write_text(folder_ / "none.urdf", two_links("b", kLimit, follower(limits)));
    const Outcome none = tandem("new none.urdf --force");
    EXPECT_EQ(none.status, 0) << none.err;
    EXPECT_NE(none.err.find("joint b: its limits, "), std::string::npos) << none.err;
    EXPECT_NE(none.err.find("contradict its <mimic>: joint 'a'"), std::string::npos) << none.err;
  }
}

// It was "__________": all such names of one length were one.
TEST_F(New, CallsARobotOfOtherLettersARobot) {
  write_text(folder_ / "робот.urdf", two_links("b", kLimit, kLimit));
  EXPECT_EQ(tandem("new робот.urdf --base fixed").status, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "robot/robot.toml"));
}

TEST_F(New, SaysOnceWhyABaseCannotBeAsItIsTold) {
  write_text(folder_ / "arm.urdf", two_links("b", kLimit, kLimit));
  const Outcome floating = tandem("new arm.urdf --base floating");
  EXPECT_EQ(floating.status, 2);
  EXPECT_EQ(floating.err,
            "error: arm.urdf: the root link 'base' has no mass, so it cannot float (give --base "
            "fixed, or leave --base out; or give the link an <inertial>)\n");
  write_text(folder_ / "free.urdf",
             "<robot name='f'><link name='world'/>\n<joint name='free' type='floating'><parent "
             "link='world'/><child link='base'/></joint>" +
                 two_links("b", kLimit, kLimit).substr(16));
  for (const std::string base : {"floating", "fixed"}) {
    const Outcome free = tandem("new free.urdf --base " + base);
    EXPECT_EQ(free.status, 2);
    EXPECT_EQ(std::ranges::count(free.err, '\n'), 1) << free.err;
    EXPECT_NE(free.err.find("the floating base has no mass"), std::string::npos) << free.err;
  }
}

TEST_F(New, ShowsInertiasThatNoBodyCanHave) {
  std::string urdf = two_links("b", kLimit, kLimit);
  urdf.replace(urdf.rfind("izz='0.005'"), 11, "izz='0.500'");
  write_text(folder_ / "bad.urdf", urdf);
  const Outcome made = tandem("new bad.urdf --json new.json");
  EXPECT_EQ(made.status, 0) << made.err;
  const Outcome ran = tandem("run bad/hold.toml --duration 0.1 --no-log",
                             "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache"));
  EXPECT_NE(made.err.find("link m: the inertia breaks the triangle inequality"), std::string::npos)
      << made.err;
  EXPECT_NE(made.err.find("correct it in the URDF"), std::string::npos) << made.err;
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_NE(ran.err.find("no body can have the inertia of m (`tandem check "), std::string::npos)
      << ran.err;
}

TEST_F(New, LeavesNothingBehindOfWhatIsWrong) {
  write_text(folder_ / "some.xacro", "<robot name='a' xmlns:xacro='x'><xacro:arm/></robot>");
  write_text(folder_ / "broken.urdf", "<robot name='a'><link name='b'>");
  for (const std::string file : {"missing.urdf", "some.xacro", "broken.urdf"}) {
    const Outcome outcome = tandem("new " + file);
    EXPECT_EQ(outcome.status, 2) << file;
    EXPECT_EQ(outcome.err.rfind("error: ", 0), 0U) << outcome.err;
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    EXPECT_FALSE(entry.is_directory()) << entry.path();
  }
}

TEST_F(New, SaysThatALimitWhichEveryJointHasIsLikelyAPlaceholder) {
  const std::string arm = read_text(TANDEM_SOURCE_DIR "/config/ur5e/ur5e.urdf");
  write_text(folder_ / "arm.urdf", arm);
  const std::string said = "likely a placeholder";
  const Outcome own = tandem("new arm.urdf -o own");
  ASSERT_EQ(own.status, 0) << own.err;
  EXPECT_EQ(own.out.find(said), std::string::npos) << own.out;
  std::string same = arm;
  const std::string from = "velocity=\"3.141592653589793\"";
  for (std::size_t at = same.find(from); at != std::string::npos; at = same.find(from)) {
    same.replace(at, from.size(), "velocity=\"20\"");
  }
  write_text(folder_ / "arm.urdf", same);
  const Outcome placeholder = tandem("new arm.urdf -o same");
  ASSERT_EQ(placeholder.status, 0) << placeholder.err;
  EXPECT_NE(placeholder.out.find("every joint has 20 rad/s: " + said), std::string::npos)
      << placeholder.out;
}

TEST_F(New, DoesNotCallALimitThatItReplacesTheRobots) {
  std::string arm = read_text(TANDEM_SOURCE_DIR "/config/ur5e/ur5e.urdf");
  for (const std::string from :
       {"velocity=\"3.141592653589793\"", "velocity=\"2.0943951023931953\"", "effort=\"150.0\"",
        "effort=\"28.0\""}) {
    const std::string huge = from.substr(0, from.find('"')) + "\"1e9\"";
    for (std::size_t at = arm.find(from); at != std::string::npos; at = arm.find(from))
      arm.replace(at, from.size(), huge);
  }
  write_text(folder_ / "arm.urdf", arm);
  const Outcome made = tandem("new arm.urdf -o x");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(made.out.find("likely a placeholder"), std::string::npos) << made.out;
  EXPECT_NE(
      made.out.find("Limits are guessed: an effort of 1e+09 Nm and a speed of 1e+09 rad/s are "
                    "none (joint shoulder_pan_joint), and so with 5 more."),
      std::string::npos)
      << made.out;
}

TEST_F(New, SaysWhichLimitsItHadToGuessAndWhy) {
  std::string arm = read_text(TANDEM_SOURCE_DIR "/config/ur5e/ur5e.urdf");
  arm.replace(arm.find("lower=\"-"), 8, "lower=\"9");
  arm.replace(arm.find("effort=\""), 8, "effort=\"-");
  write_text(folder_ / "arm.urdf", arm);
  const Outcome outcome = tandem("new arm.urdf -o x");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("Limits are guessed: arm.urdf:"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("effort is not above 0"), std::string::npos) << outcome.out;
}

TEST_F(New, SaysWhatItChoseAsJson) {
  const Outcome outcome = tandem("new " + shell_word(TANDEM_SOURCE_DIR "/config/coman/coman.urdf") +
                                 " -o c --like coman --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["base"], "floating");
  EXPECT_EQ(json["joints"], 29);
  EXPECT_EQ(json["feet"].size(), 2U);
  EXPECT_EQ(json["right_angles"]["count"], 2);
  EXPECT_NE(read_text(folder_ / "c/robot.toml").find("spring_Nm_rad"), std::string::npos);
}

}  // namespace
}  // namespace tandem::apps
