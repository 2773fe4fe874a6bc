// `tandem new`: a folder from a URDF alone, and what then runs.
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class New : public Program {
 protected:
  /// Makes the folder, and lets the robot hold its posture and move.
  void holds_and_moves(const std::string& urdf, double most_rad) {
    std::filesystem::remove_all(folder_ / "made");
    const std::string cache = "XDG_CACHE_HOME='" + folder_.string() + "/cache'";
    Outcome outcome = tandem("new '" TANDEM_SOURCE_DIR "/" + urdf + "' -o made", cache);
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
        EXPECT_LT(joint["max_tracking_error_rad"], most_rad) << experiment << ": " << name;
      }
      if (!run["base"].is_null()) {
        EXPECT_LT(run["base"]["final_tilt_rad"], 0.02) << experiment;
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

TEST_F(New, MakesEveryPublicRobotHoldAndMove) {
  if (std::getenv("TANDEM_NEW_ALL") == nullptr) {
    GTEST_SKIP() << "compiles the kernels of six robots, minutes of work: set TANDEM_NEW_ALL=1";
  }
  for (const std::string urdf :
       {"config/ur5e/ur5e.urdf", "config/panda/panda.urdf", "config/coman/coman.urdf",
        "config/walkman/walkman.urdf", "config/icub/icub.urdf",
        "tests/data/robots/simple_humanoid.urdf"}) {
    SCOPED_TRACE(urdf);
    holds_and_moves(urdf, 0.03);
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
  const std::string cache = "XDG_CACHE_HOME='" + folder_.string() + "/cache'";
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

TEST_F(New, WritesOverNothingWithoutForce) {
  EXPECT_EQ(tandem("new double_pendulum.urdf").status, 0);
  write_text(folder_ / "double_pendulum/hold.toml", "mine");
  const Outcome again = tandem("new double_pendulum.urdf");
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.err.find("this exists already"), std::string::npos) << again.err;
  EXPECT_EQ(read_text(folder_ / "double_pendulum/hold.toml"), "mine");
  EXPECT_EQ(tandem("new double_pendulum.urdf --force").status, 0);
  EXPECT_NE(read_text(folder_ / "double_pendulum/hold.toml"), "mine");
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

TEST_F(New, SaysWhatItChoseAsJson) {
  const Outcome outcome =
      tandem("new '" TANDEM_SOURCE_DIR "/config/coman/coman.urdf' -o c --like coman --json -");
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
