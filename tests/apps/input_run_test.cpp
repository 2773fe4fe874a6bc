// Inputs of a running run: by the command line, by topics of other nodes, and who may.
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <thread>

#include "apps/transport/control_path.hpp"
#include "dds/endpoint.hpp"
#include "dds/participant.hpp"
#include "dds/service.hpp"
#include "tests/apps/running.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::apps {
namespace {

using dds::geometry_msgs::Twist;
using dds::geometry_msgs::TwistStamped;
using dds::trajectory_msgs::JointTrajectory;
using JointTrajectoryPoint = ::trajectory_msgs_msg_dds__JointTrajectoryPoint_;

class InputOfARun : public Running {
 protected:
  /// hold.toml with this controller instead of its own.
  void with(const std::string& controller) {
    std::string text = read_text(folder_ / "hold.toml");
    text.resize(text.find("[[controller]]"));
    write_text(folder_ / "hold.toml", text + controller);
  }
  void with_jog(const std::string& more = "") {
    with("[[controller]]\nplugin = \"jog\"\n[controller.parameters]\njoints = [\"joint2\"]\n" +
         more);
  }
  /// In real time: a time-out of the input is one of the wall clock.
  void begin_in_time(const std::string& more) {
    start("--rate 1 --duration 2000 " + more);
    until(R"("phase": "running")");
  }
  [[nodiscard]] nlohmann::json ask(const std::string& question) const {
    const Outcome outcome = to_run("ask " + shell_word(question));
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
  [[nodiscard]] nlohmann::json input() const { return ask(R"({"do": "input.list"})")["inputs"][0]; }
  [[nodiscard]] double position(std::size_t joint) const {
    return ask(R"({"do": "joint.list"})")["joints"][joint]["position_rad"].get<double>();
  }
  /// Looks until `there` says yes; `act` before each look.
  template <class There, class Act>
  static bool until_true(const There& there, const Act& act) {
    for (int i = 0; i < 600; ++i) {
      act();
      if (there()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
  void join_domain() {
    auto domain = dds::Domain::open(dds::test::own_config());
    ASSERT_TRUE(domain) << domain.error().to_string();
    auto joined = dds::Participant::open(std::move(*domain), "teleop");
    ASSERT_TRUE(joined) << joined.error().to_string();
    participant_ = std::move(*joined);
  }
  [[nodiscard]] static std::string in_domain() {
    return "--dds --domain " + std::to_string(dds::test::own_domain());
  }
  template <class T>
  dds::Writer<T> writer(const std::string& topic) {
    return dds::Writer<T>::create(*participant_, "rt/" + topic, {}).value();
  }

  std::unique_ptr<dds::Participant> participant_;
};

TEST_F(InputOfARun, IsFedByTheCommandLine) {
  with_jog("timeout_s = 60.0\n");
  begin_in_time("");
  const Outcome listed = to_run("input list");
  EXPECT_NE(listed.out.find("no sample yet"), std::string::npos) << listed.out;
  const double before = position(1);
  const Outcome set = to_run("input rate joint2=0.4");
  EXPECT_EQ(set.status, 0) << set.err;
  EXPECT_NE(set.out.find("done in cycle"), std::string::npos) << set.out;
  EXPECT_TRUE(until_true([&] { return std::abs(position(1) - before) > 0.2; }, [] {}));
  EXPECT_EQ(input()["fresh"], true);
  EXPECT_EQ(input()["values"]["joint2"], 0.4);
  EXPECT_NE(to_run("input list").out.find("joint2=0.4"), std::string::npos);
  EXPECT_EQ(to_run("input jog/rate joint2=0 --for 0.25").status, 0);
  EXPECT_GE(input()["arrived"], 2);
  EXPECT_EQ(input()["values"]["joint2"], 0.0);
  EXPECT_EQ(end(), 0);
}

/// Questions as fast as a socket takes them: who asks waits for a cycle each time, others do not.
TEST_F(InputOfARun, AFloodOverTheSocketIsASampleACycleAndHoldsUpNobody) {
  with_jog("timeout_s = 60.0\n");
  begin_in_time("");
  const int flood = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const auto address = control_address(socket_);
  ASSERT_EQ(::connect(flood, reinterpret_cast<const sockaddr*>(&*address), sizeof *address), 0);
  constexpr int kFlood = 1000;
  std::thread sender([&] {
    std::string all;
    for (int i = 1; i <= kFlood; ++i) {
      all += R"({"do": "input.set", "name": "rate", "values": {"joint2": )" +
             std::to_string(i * 1e-4) + "}}\n";
    }
    EXPECT_EQ(::send(flood, all.data(), all.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(all.size()));
  });
  std::atomic<int> answered{0};
  std::thread reader([&] {
    std::array<char, 4096> bytes{};
    for (ssize_t count = 0;
         answered < kFlood && (count = ::recv(flood, bytes.data(), 4096, 0)) > 0;)
      answered += static_cast<int>(std::count(bytes.begin(), bytes.begin() + count, '\n'));
  });
  int asked_between = 0;
  for (; answered < kFlood / 2; ++asked_between) EXPECT_EQ(to_run("input list").status, 0);
  sender.join();
  reader.join();
  ::close(flood);
  EXPECT_GT(asked_between, 0);
  EXPECT_EQ(answered, kFlood);
  EXPECT_NEAR(input()["values"]["joint2"].get<double>(), kFlood * 1e-4, 1e-9) << "the newest";
  EXPECT_EQ(input()["arrived"].get<int>() + input()["superseded"].get<int>(), kFlood);
  EXPECT_EQ(input()["refused"], 0);
  EXPECT_EQ(end(), 0);
}

TEST_F(InputOfARun, WhatIsWrongIsRefusedByNameAndTheRunGoesOn) {
  with_jog();
  begin_in_time("");
  for (const auto& [words, why] : {std::pair{"rate joint2=99", "joint2: 99 is beyond its bounds"},
                                   {"rate joint2=nan", "no finite number"},
                                   {"rate joint2=0.1rad/s", "'0.1rad/s' is no finite number"},
                                   {"rate joint2=0.1rad/s", "joint2 is in rad/s: write joint2=0.2"},
                                   {"rate joint2=0.1 joint2=0.2", "'joint2' is given twice"},
                                   {"rate joint3=0.1", "no component 'joint3'"},
                                   {"rote joint2=0.1", "no loaded controller has an input 'rote'"},
                                   {"rate", "give values"},
                                   {"rate --point 1,2", "fed with values"},
                                   {"", "name the input"},
                                   {"list rote", "rote"}}) {
    const Outcome outcome = to_run(std::string("input ") + words);
    EXPECT_EQ(outcome.status, 2) << words;
    EXPECT_NE((outcome.err + outcome.out).find(why), std::string::npos) << words << outcome.err;
  }
  for (const char* question :
       {R"({"do": "input.set", "name": "rate", "values": {"joint2": "x"}})",
        R"({"do": "input.set", "name": "rate", "trajectory": {"points": 3}})"}) {
    EXPECT_EQ(to_run("ask " + shell_word(question)).status, 2) << question;
  }
  EXPECT_EQ(input()["sequence"], 0);
  EXPECT_NE(input()["why"].get<std::string>().find("trajectory: is not"), std::string::npos);
  EXPECT_EQ(input()["refused"], 8) << "numbers that are none count, too";
  const std::string table = to_run("input list").out;  // its last column is broken into lines
  EXPECT_NE(table.find("trajectory"), std::string::npos) << table;
  EXPECT_EQ(to_run("controller stop jog").status, 0);
  const Outcome stopped = to_run("input rate joint2=0.1");
  EXPECT_NE(stopped.err.find("its controller is not active"), std::string::npos) << stopped.err;
  EXPECT_EQ(end(), 0);
  const std::string warned = read_text(folder_ / "run.txt");
  EXPECT_NE(warned.find("the input jog/rate refused 9 samples; the last: jog/rate: its"),
            std::string::npos)
      << warned;
}

constexpr char kTwist[] =
    "timeout_s = 2.0\ntwist = [\"yaw\"]\n[controller.inputs.twist]\nsource = \"topic\"\ntopic = "
    "\"cmd_vel\"\n";

TEST_F(InputOfARun, IsFedByATwistOfAnotherNode) {
  with_jog(std::string(kTwist) + "[remote]\ncommand = \"local\"\ntrust = \"domain\"\n");
  join_domain();
  begin_in_time(in_domain());
  auto cmd_vel = writer<Twist>("cmd_vel");
  const double before = position(1);
  const Twist twist{.linear = {}, .angular = {0.0, 0.0, 0.5}};
  EXPECT_TRUE(until_true([&] { return std::abs(position(1) - before) > 0.1; },
                         [&] { EXPECT_TRUE(cmd_vel.write(twist)); }));
  EXPECT_EQ(input()["values"]["yaw"], 0.5);
  EXPECT_NE(to_run("input twist yaw=0.1").err.find("is fed by its topic"), std::string::npos);
  // Another node beside it, and what is beyond the bounds.
  auto other = writer<Twist>("cmd_vel");
  EXPECT_TRUE(until_true([&] { return input()["why"].get<std::string>().contains("another node"); },
                         [&] {
                           EXPECT_TRUE(cmd_vel.write(twist));
                           EXPECT_TRUE(other.write(twist));
                         }));
  const Twist wild{.linear = {}, .angular = {0.0, 0.0, std::nan("")}};
  EXPECT_TRUE(until_true([&] { return input()["why"].get<std::string>().contains("yaw: is not"); },
                         [&] { EXPECT_TRUE(cmd_vel.write(wild)); }));
  EXPECT_TRUE(until_true([&] { return input()["fresh"] == false; }, [] {})) << "silence";
  EXPECT_EQ(input()["values"]["yaw"], 0.0);
  EXPECT_EQ(end(), 0);
}

TEST_F(InputOfARun, AStrangersTwistWaitsUntilHeIsAdmitted) {
  with_jog(std::string(kTwist) + "type = \"geometry_msgs/msg/TwistStamped\"\n" +
           "[remote]\ncommand = \"local\"\n");
  join_domain();
  begin_in_time(in_domain());
  auto cmd_vel = writer<TwistStamped>("cmd_vel");
  std::string frame;
  const TwistStamped twist{.header = {.stamp = {}, .frame_id = frame.data()},
                           .twist = {.linear = {}, .angular = {0.0, 0.0, 0.5}}};
  const auto write = [&] { EXPECT_TRUE(cmd_vel.write(twist)); };
  EXPECT_TRUE(
      until_true([&] { return input()["why"].get<std::string>().contains("stranger"); }, write));
  EXPECT_EQ(input()["arrived"], 0);
  const std::string self = dds::to_text(dds::id_of(*participant_));
  EXPECT_EQ(ask(R"({"do": "dds.admit", "participant": ")" + self + "\"}")["ok"], true);
  EXPECT_TRUE(until_true([&] { return input()["arrived"] > 0; }, write));
  EXPECT_EQ(end(), 0);
}

/// The lease goes to one process. Its end, by a silence here, gives the inputs back.
TEST_F(InputOfARun, WhileAnotherProcessHasTheLeaseIsRefusedByItsName) {
  with_jog("[remote]\ncommand = \"local\"\ntrust = \"domain\"\nlease_timeout_s = 1.0\n");
  begin_in_time(in_domain());
  EXPECT_EQ(to_run("input rate joint2=0.1").status, 0);
  EXPECT_EQ(input()["values"]["joint2"], 0.1);
  std::thread owner([this] {
    const std::string command =
        "cd " + shell_word(folder_.string()) + " && echo $$ >owner.pid && exec " +
        shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " run trajectory.toml --hal dds --domain " +
        std::to_string(dds::test::own_domain()) +
        " --duration 1000 --no-log --no-socket -q >owner.txt 2>&1 </dev/null";
    (void)std::system(command.c_str());
  });
  Outcome told;
  const auto ask_again = [&] { told = to_run("input rate joint2=0.1"); };
  EXPECT_TRUE(until_true([&] { return told.err.contains("' commands the robot"); }, ask_again))
      << told.err << read_text(folder_ / "owner.txt");
  EXPECT_NE(told.err.find("jog/rate"), std::string::npos) << told.err;
  EXPECT_GT(input()["refused"], 0);
  EXPECT_EQ(input()["fresh"], false);
  EXPECT_EQ(input()["values"]["joint2"], 0.0) << "what the input holds without a sample";
  (void)std::system(
      ("kill -KILL $(cat " + shell_word((folder_ / "owner.pid").string()) + ")").c_str());
  owner.join();
  EXPECT_TRUE(until_true([&] { return told.err.contains("not active"); }, ask_again)) << told.err;
  EXPECT_EQ(to_run("controller start jog").status, 0);
  EXPECT_EQ(to_run("input rate joint2=0.1").status, 0);
  EXPECT_EQ(end(), 1) << "the owner's loss is a fault";
}

/// Its samples went to the build that had gone, and were refused.
TEST_F(InputOfARun, ATopicGoesOnToFeedAControllerThatWasReloaded) {
  with_jog(std::string(kTwist) + "[remote]\ncommand = \"local\"\ntrust = \"domain\"\n");
  join_domain();
  begin_in_time(in_domain());
  auto cmd_vel = writer<Twist>("cmd_vel");
  const Twist twist{.linear = {}, .angular = {0.0, 0.0, 0.1}};
  const auto write = [&] { EXPECT_TRUE(cmd_vel.write(twist)); };
  EXPECT_TRUE(until_true([&] { return input()["fresh"] == true; }, write));
  const Outcome reloaded = to_run("controller reload jog");
  EXPECT_EQ(reloaded.status, 0) << reloaded.err;
  const auto refused = input()["refused"], arrived = input()["arrived"];
  EXPECT_TRUE(until_true([&] { return input()["arrived"] > arrived; }, write)) << input()["why"];
  EXPECT_EQ(input()["refused"], refused) << input()["why"];
  EXPECT_EQ(end(), 0);
}

TEST_F(InputOfARun, ATopicThatNobodyMayUseIsAnErrorAtTheStart) {
  const auto why = [this](const std::string& flags) {
    return tandem("run hold.toml --no-log --no-socket -q --duration 0.1 " + flags).err;
  };
  with_jog(kTwist);
  EXPECT_NE(why("").find("hold.toml:"), std::string::npos) << why("");
  EXPECT_NE(why("").find("the run is not on DDS"), std::string::npos) << why("");
  const Outcome check = tandem("check hold.toml");
  EXPECT_EQ(check.status, 2) << "it had called it right";
  EXPECT_NE(check.err.find("the run is not on DDS"), std::string::npos) << check.err;
  EXPECT_NE(why(in_domain()).find("takes no commands over DDS"), std::string::npos);
  with_jog(std::string(kTwist) + "type = \"sensor_msgs/msg/Imu\"\n");
  EXPECT_NE(why("").find("bring no twist"), std::string::npos) << why("");
  with_jog("[controller.inputs.rate]\nsource = \"topic\"\ntopic = \"rates\"\nframe = \"hand\"\n");
  EXPECT_NE(why("").find("'std_msgs/msg/Float64MultiArray' name no frame"), std::string::npos);
  with_jog("[controller.inputs.rate]\nsource = \"topic\"\ntopic = \"rates\"\naction = \"go\"\n");
  EXPECT_NE(why("").find("'rate' of 'jog' takes no goals"), std::string::npos) << why("");
  with_jog("[controller.inputs.rate]\nsource = \"command\"\naction = \"go\"\n");
  EXPECT_NE(why("").find("its source is \"command\""), std::string::npos) << why("");
  with_jog("[controller.inputs.rate]\nsource = \"command\"\nframe = \"hand\"\n");
  EXPECT_NE(why("").find("its source is \"command\""), std::string::npos) << why("");
  with_jog(
      "[controller.inputs.rate]\nsource = \"gamepad\"\ndevice = \"/dev/input/none\"\n"
      "mapping = { joint2 = \"ABS_X 0.5\" }\n");
  EXPECT_NE(why("").find("cannot open the game pad /dev/input/none"), std::string::npos) << why("");
  with_jog("[controller.inputs.rate]\nsource = \"timeline\"\ntopic = \"rates\"\n");
  EXPECT_NE(why("").find("its source is \"timeline\""), std::string::npos) << why("");
}

/// Joints in another order; then one that lacks a joint, and none at all, which holds.
TEST_F(InputOfARun, ATrajectoryOfAnotherNodeLeadsTheJoints) {
  with(
      "[[controller]]\nplugin = \"trajectory_follower\"\n[controller.inputs.trajectory]\n"
      "source = \"topic\"\ntopic = \"joint_trajectory\"\n"
      "[remote]\ncommand = \"local\"\ntrust = \"domain\"\n");
  join_domain();
  begin_in_time(in_domain());
  auto topic = writer<JointTrajectory>("joint_trajectory");
  std::string frame, one = "joint1", two = "joint2";
  std::array<char*, 2> names{two.data(), one.data()};
  std::array<double, 2> to{-0.9, 0.2};
  JointTrajectoryPoint point{};
  point.positions = {2, 2, to.data(), false};
  point.time_from_start = {.sec = 1, .nanosec = 500'000'000};
  JointTrajectory way{};
  way.header.frame_id = frame.data();
  way.joint_names = {2, 2, names.data(), false};
  way.points = {1, 1, &point, false};
  EXPECT_TRUE(
      until_true([&] { return input()["arrived"] > 0; }, [&] { EXPECT_TRUE(topic.write(way)); }));
  EXPECT_EQ(input()["points"][0]["position_rad"], nlohmann::json({0.2, -0.9}));
  EXPECT_EQ(input()["points"][0]["after_s"], 1.5);
  const auto is_there = [&] {
    return std::abs(position(0) - 0.2) < 0.05 && std::abs(position(1) + 0.9) < 0.05;
  };
  EXPECT_TRUE(until_true(is_there, [] {}));
  way.joint_names._length = 1;
  EXPECT_TRUE(until_true([&] { return input()["why"].get<std::string>().contains("joint_names"); },
                         [&] { EXPECT_TRUE(topic.write(way)); }));
  way.points._length = 0;
  EXPECT_TRUE(until_true([&] { return input()["points"].empty(); },
                         [&] { EXPECT_TRUE(topic.write(way)); }));
  EXPECT_NEAR(position(1), -0.9, 0.05);
  EXPECT_EQ(to_run("input trajectory --point 1,0.5,-0.5").status, 2);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
