// config/ur5e/ros2.toml: commands by the topics of ROS 2's controllers, said by Fast DDS.
#include <cmath>
#include <limits>

#include "tests/apps/running.hpp"
#include "tests/dds/fastdds_caller.hpp"

namespace tandem::apps {
namespace {

using dds::test::Members;
using dds::test::Octets;
using tandem::test::eventually;

class CommandsOfRos : public Running {
 protected:
  void SetUp() override {
    if (!dds::test::have_fastdds_caller()) GTEST_SKIP() << dds::test::kNoFastDds;
    Running::SetUp();
    const std::string folder = TANDEM_SOURCE_DIR "/config/ur5e/";
    std::string text = read_text(folder + "ros2.toml");
    text.replace(text.find("robot.toml"), 10, folder + "robot.toml");
    write_text(folder_ / "hold.toml", text);
    begin("--dds --domain " + std::to_string(dds::test::own_domain()));
    const char* numbers = "std_msgs/msg/Float64MultiArray";
    caller_.emplace(std::vector<std::string>{"tell", "/joint_trajectory",
                                             "trajectory_msgs/msg/JointTrajectory",     //
                                             "tell", "/joint_group_position", numbers,  //
                                             "tell", "/joint_group_velocity", numbers,  //
                                             "tell", "/joint_group_effort", numbers,    //
                                             "tell", "/cmd_vel", "geometry_msgs/msg/Twist"});
  }

  /// std_msgs/msg/Float64MultiArray without a layout.
  static Octets numbers(const std::vector<double>& data) {
    Members message;
    message.nothing().number(std::uint32_t{0}).numbers(data);
    return message;
  }
  [[nodiscard]] double position_rad(std::size_t joint) const {
    return answer(R"({"do": "joint.list"})")["joints"][joint]["position_rad"].get<double>();
  }
  [[nodiscard]] nlohmann::json input(const std::string& name) const {
    for (const auto& one : answer(R"({"do": "input.list"})")["inputs"]) {
      if (one["name"] == name && one["active"] != false) return one;
    }
    return {};
  }
  [[nodiscard]] nlohmann::json answer(const std::string& question) const {
    return nlohmann::json::parse(to_run("ask " + shell_word(question)).out, nullptr, false);
  }
  void leads(const std::string& stop, const std::string& start) const {
    const Outcome outcome = to_run("controller switch --stop " + stop + " --start " + start);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  }
  /// Says it again and again until `there`.
  template <class There>
  bool say(const std::string& topic, const Octets& message, const There& there) {
    return eventually([&] {
      caller_->say(topic + " " + dds::test::to_hex(message));
      return there();
    });
  }

  std::optional<dds::test::FastDdsCaller> caller_;
};

TEST_F(CommandsOfRos, MoveTheJointsOneControllerAfterAnother) {
  const std::vector<std::string> names{"wrist_3_joint",       "wrist_2_joint",
                                       "wrist_1_joint",       "elbow_joint",
                                       "shoulder_lift_joint", "shoulder_pan_joint"};
  const double lift = position_rad(1), elbow = position_rad(2);
  Members way;
  way.number(std::int32_t{0}).number(std::uint32_t{0}).text("").texts(names);
  way.number(std::uint32_t{1}).numbers({0.2, -1.571, -1.571, elbow, lift, 0.3});
  way.nothing().nothing().nothing().number(std::int32_t{1}).number(std::uint32_t{0});
  EXPECT_TRUE(say("/joint_trajectory", way, [&] { return position_rad(0) > 0.01; }));
  EXPECT_TRUE(eventually([&] { return std::abs(position_rad(0) - 0.3) < 0.01; }));
  EXPECT_TRUE(eventually([&] { return std::abs(position_rad(5) - 0.2) < 0.01; }));

  leads("trajectory", "positions");
  const auto posture = [&](double pan) { return numbers({pan, lift, elbow, -1.571, -1.571, 0.0}); };
  EXPECT_TRUE(say("/joint_group_position", posture(-0.2),
                  [&] { return std::abs(position_rad(0) + 0.2) < 0.01; }));

  leads("positions", "velocities");
  const Octets turning = numbers({0.2, 0, 0, 0, 0, 0});
  EXPECT_TRUE(say("/joint_group_velocity", turning, [&] { return position_rad(0) > 0.0; }));

  leads("velocities", "base");
  Members twist;
  for (const double one : {0.0, 0.0, 0.0, 0.0, 0.0, -0.2}) twist.number(one);
  EXPECT_TRUE(say("/cmd_vel", twist, [&] { return position_rad(0) < -0.1; }));

  leads("base", "efforts");
  const double pan = position_rad(0);
  EXPECT_TRUE(say("/joint_group_effort", numbers({10, 0, 0, 0, 0, 0}),
                  [&] { return position_rad(0) > pan + 0.05; }));
  EXPECT_EQ(end(), 0);
}

TEST_F(CommandsOfRos, AreRefusedWhereTheyAreWrong) {
  leads("trajectory", "positions");
  const double before = position_rad(0);
  const auto is_refused = [&](const Octets& message, const std::string& words) {
    std::string why;
    EXPECT_TRUE(say("/joint_group_position", message,
                    [&] {
                      why = answer(R"({"do": "input.list"})").dump();
                      return why.find(words) != std::string::npos;
                    }))
        << words << ": " << why;
  };
  is_refused(numbers({0.1, 0.1}), "2");
  is_refused(numbers({std::nan(""), 0, 0, 0, 0, 0}), "is not");
  is_refused(numbers({7.0, 0, 0, 0, 0, 0}), "beyond");
  is_refused(numbers(std::vector<double>(10'000, 0.1)), "10000");
  EXPECT_NEAR(position_rad(0), before, 1e-3);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
