// The action of config/ur5e/ros2.toml asked by Fast DDS, as MoveIt with rmw_fastrtps_cpp asks, and
// by Cyclone DDS. The runs are twenty times faster than a clock.
#include <cmath>
#include <limits>
#include <optional>

#include "dds/service_client.hpp"
#include "dds/service_layout.hpp"
#include "tests/apps/running.hpp"
#include "tests/dds/fastdds_caller.hpp"

namespace tandem::apps {
namespace {

using dds::test::Members;
using dds::test::Octets;
using dds::test::Reply;
using tandem::test::eventually;
using SendReply = dds::control_msgs::FollowJointTrajectory_SendGoal_Response;
using ResultReply = dds::control_msgs::FollowJointTrajectory_GetResult_Response;
using CancelReply = dds::action_msgs::CancelGoal_Response;

const std::string kAction = "/trajectory/follow_joint_trajectory/_action/";
const std::vector<std::string> kPan{"shoulder_pan_joint"};
constexpr int kSend = 0, kCancel = 1, kResult = 2;  // clients of the caller
constexpr int kSucceeded = 4, kCanceled = 5, kAborted = 6;

/// A goal as a client says it, and what it may get wrong.
struct Goal {
  struct Point {
    double time_s;
    std::vector<double> position_rad;
    std::vector<double> effort = {};
  };
  struct Tolerance {
    std::string joint;
    double position_rad;
  };
  std::vector<std::string> joints = kPan;
  std::vector<Point> points;
  std::vector<Tolerance> path = {}, goal = {};
  double goal_time_s = 0.0;
  double stamp_s = 0.0;
  bool several_axes = false;
};

class ActionOfRos : public Running {
 protected:
  void SetUp() override {
    if (!dds::test::have_fastdds_caller()) GTEST_SKIP() << dds::test::kNoFastDds;
    if (!dds::answers_fast_dds()) GTEST_SKIP() << "built for another version of Cyclone DDS";
    Running::SetUp();
  }
  void run(const std::string& trust = "domain", const std::vector<std::string>& more = {}) {
    const std::string folder = TANDEM_SOURCE_DIR "/config/ur5e/";
    std::string text = read_text(folder + "ros2.toml");
    text.replace(text.find("robot.toml"), 10, folder + "robot.toml");
    text.replace(text.find("trust = \"domain\""), 16, "trust = \"" + trust + "\"");
    write_text(folder_ / "hold.toml", text);
    begin("--on-fault wait --dds --domain " + std::to_string(dds::test::own_domain()));
    caller_ = client(more);
  }
  static std::unique_ptr<dds::test::FastDdsCaller> client(
      const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{
        kAction + "send_goal",   "control_msgs/action/FollowJointTrajectory_SendGoal",
        kAction + "cancel_goal", "action_msgs/srv/CancelGoal",
        kAction + "get_result",  "control_msgs/action/FollowJointTrajectory_GetResult"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto made = std::make_unique<dds::test::FastDdsCaller>(arguments);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(made->ready(i));
    Members cancelled, asked;
    is_heard(*made, kSend, payload(99, {.points = {}}));
    is_heard(*made, kCancel, add_time(add_id(cancelled, 99), 0.0));
    is_heard(*made, kResult, add_id(asked, 99));
    return made;
  }
  /// Asks, with what changes nothing, until there is an answer: the run may find a client later
  /// than that finds the run, and what was asked before is lost.
  static void is_heard(dds::test::FastDdsCaller& caller, int client, const Octets& request) {
    for (int i = 0; i < 5; ++i) {
      if (!caller.call(client, request).empty()) return;
    }
    ADD_FAILURE() << "nobody answers client " << client;
  }

  static Members& add_time(Members& members, double time_s) {
    const double whole = std::floor(time_s);
    return members.number(static_cast<std::int32_t>(whole))
        .number(static_cast<std::uint32_t>(std::lround((time_s - whole) * 1e9)));
  }
  static Members& add_id(Members& members, std::uint8_t number) {
    for (int i = 0; i < 16; ++i) members.number(static_cast<std::uint8_t>(i == 0 ? number : i));
    return members;
  }
  static Members& add_tolerances(Members& members, const std::vector<Goal::Tolerance>& all) {
    members.number(static_cast<std::uint32_t>(all.size()));
    for (const auto& one : all) {
      members.text(one.joint).number(one.position_rad).number(0.0).number(0.0);
    }
    return members;
  }
  static Octets payload(std::uint8_t number, const Goal& goal) {
    Members members;
    add_time(add_id(members, number), goal.stamp_s).text("").texts(goal.joints);
    members.number(static_cast<std::uint32_t>(goal.points.size()));
    for (const auto& point : goal.points) {
      members.numbers(point.position_rad).nothing().nothing().numbers(point.effort);
      add_time(members, point.time_s);
    }
    add_time(members, 0.0).text("");
    members.texts(goal.several_axes ? std::vector<std::string>{"base"}
                                    : std::vector<std::string>{});
    add_tolerances(members.nothing(), goal.path).nothing();
    add_tolerances(members, goal.goal).nothing();
    return add_time(members, goal.goal_time_s);
  }
  /// Whether it is accepted.
  static bool send(dds::test::FastDdsCaller& caller, std::uint8_t number, const Goal& goal) {
    return Reply<SendReply>(caller.call(kSend, payload(number, goal))).yes("accepted");
  }
  bool send(std::uint8_t number, const Goal& goal) { return send(*caller_, number, goal); }

  /// Asks for the result. @return the request's number
  std::string ask(std::uint8_t number) {
    Members request;
    return caller_->send(kResult, add_id(request, number));
  }
  struct Result {
    int status, code;
    std::string words;
  };
  Result result_of(const std::string& request) {
    const Reply<ResultReply> reply(caller_->reply(kResult, request));
    return {static_cast<int>(reply.at<std::int64_t>("status")),
            static_cast<int>(reply.at<std::int64_t>("result.error_code")),
            reply.text("result.error_string")};
  }
  Result result(std::uint8_t number) { return result_of(ask(number)); }
  /// @return its code
  int cancel(std::uint8_t number) {
    Members request;
    if (number == 0) {
      for (int i = 0; i < 16; ++i) request.number(std::uint8_t{0});
    } else {
      add_id(request, number);
    }
    const Reply<CancelReply> reply(caller_->call(kCancel, add_time(request, 0.0)));
    return static_cast<int>(reply.at<std::int64_t>("return_code"));
  }

  [[nodiscard]] nlohmann::json answer(const std::string& question) const {
    return nlohmann::json::parse(to_run("ask " + shell_word(question)).out, nullptr, false);
  }
  [[nodiscard]] double position_rad(std::size_t joint) const {
    return answer(R"({"do": "joint.list"})")["joints"][joint]["position_rad"].get<double>();
  }
  /// Why the last goal or sample was refused.
  [[nodiscard]] std::string why() const {
    const nlohmann::json all = answer(R"({"do": "input.list"})");
    for (const auto& one : all["inputs"]) {
      if (one["controller"] == "trajectory") return one["why"];
    }
    return "no such input";
  }
  [[nodiscard]] double time_s() const {
    return answer(R"({"do": "clock.show"})")["time_s"].get<double>();
  }
  /// It is where it is after a time in which it would have moved.
  void holds(std::size_t joint) const {
    const double at = position_rad(joint), since_s = time_s();
    EXPECT_TRUE(eventually([&] { return time_s() > since_s + 0.5; }));
    EXPECT_NEAR(position_rad(joint), at, 1e-3);
  }

  std::unique_ptr<dds::test::FastDdsCaller> caller_;
};

/// Two of six joints; the result is asked for before the goal ends, and again after it.
TEST_F(ActionOfRos, LeadsAPartOfTheJointsInAnyOrder) {
  run("domain",
      {"hear", kAction + "feedback", "control_msgs/action/FollowJointTrajectory_FeedbackMessage",
       "latched", kAction + "status", "action_msgs/msg/GoalStatusArray"});
  const double lift = position_rad(1), elbow = position_rad(2);
  ASSERT_TRUE(send(1, {.joints = {"wrist_3_joint", "shoulder_pan_joint"},
                       .points = {{0.0, {0.0, 0.0}}, {20.0, {0.4, -0.6}}, {40.0, {0.2, 0.3}}},
                       .goal = {{"shoulder_pan_joint", 0.01}}}));
  const std::string early = ask(1);
  const std::string id = "01010203";  // of its number, and then their places
  EXPECT_NE(caller_->line(kAction + "feedback heard 00010000" + id), "");
  const Result done = result_of(early);
  EXPECT_EQ(done.status, kSucceeded) << done.words;
  EXPECT_EQ(done.code, 0);
  EXPECT_EQ(result(1).status, kSucceeded);
  EXPECT_NEAR(position_rad(0), 0.3, 0.01);
  EXPECT_NEAR(position_rad(5), 0.2, 0.01);
  EXPECT_NEAR(position_rad(1), lift, 1e-3);
  EXPECT_NEAR(position_rad(2), elbow, 1e-3);
  // One goal: its id, the stamp and the status.
  std::string status;
  EXPECT_TRUE(eventually([&] {
    const std::string said = caller_->take(kAction + "status heard ");
    if (!said.empty()) status = said.substr(said.rfind(' ') + 1);
    return status.size() >= 66 && status.substr(64, 2) == "04";
  })) << status;
  EXPECT_EQ(status.substr(8, 16), "01000000" + id);
  EXPECT_EQ(result(9).status, 0) << "an unknown goal";
  EXPECT_EQ(end(), 0);
}

TEST_F(ActionOfRos, RefusesWhatIsNoGoalAndNothingMoves) {
  run();
  const std::vector<double> before{position_rad(0), position_rad(1), position_rad(5)};
  const auto is_refused = [&](const Goal& goal, const std::string& words) {
    EXPECT_FALSE(send(1, goal)) << words;
    EXPECT_NE(why().find(words), std::string::npos) << words << ": " << why();
  };
  const auto to = [](double pan) { return std::vector<Goal::Point>{{1.0, {pan}}}; };
  is_refused({.points = to(std::nan(""))}, "shoulder_pan_joint: is not finite");
  is_refused({.points = to(std::numeric_limits<double>::infinity())}, "is not finite");
  is_refused({.points = to(100.0)}, "beyond its bounds");
  is_refused({.points = {}}, "has no way-point");
  is_refused({.points = {{1.0, {0.1, 0.2}}}}, "has not a number of each joint");
  is_refused({.points = {{1.0, {0.1}}, {1.0, {0.2}}}}, "does not grow");
  is_refused({.points = {{-1.0, {0.1}}}}, "does not grow");
  is_refused({.points = std::vector<Goal::Point>(1000, {1.0, {0.1}})}, "1000 way-points");
  is_refused({.joints = {}, .points = {{1.0, {}}}}, "0 joints are not");
  is_refused({.joints = {"nobody"}, .points = to(0.1)}, "'nobody'");
  is_refused({.joints = {kPan[0], kPan[0]}, .points = {{1.0, {0.1, 0.1}}}}, "twice");
  is_refused({.joints = std::vector<std::string>(10'000, kPan[0]),
              .points = {{1.0, std::vector<double>(10'000, 0.1)}}},
             "10000 joints");
  is_refused({.points = {{1.0, {0.1}, {5.0}}}}, "efforts");
  is_refused({.points = to(0.1), .path = {{"nobody", 0.1}}}, "'nobody'");
  is_refused({.points = to(0.1), .path = {{kPan[0], -0.5}}}, "-0.5 is no tolerance");
  is_refused({.points = to(0.1), .goal = {{kPan[0], std::nan("")}}}, "is no tolerance");
  is_refused({.points = to(0.1), .goal_time_s = -3.0}, "goal_time_tolerance");
  is_refused({.points = to(0.1), .several_axes = true}, "several axes");
  EXPECT_TRUE(eventually([&] { return time_s() > 3.0; }));
  is_refused({.points = to(0.1), .stamp_s = 0.5}, "it ended");
  is_refused({.points = to(0.1), .stamp_s = 1.7e9}, "it begins in 1699");
  EXPECT_NEAR(position_rad(0), before[0], 1e-4);
  EXPECT_NEAR(position_rad(1), before[1], 1e-4);
  EXPECT_NEAR(position_rad(5), before[2], 1e-4);
  EXPECT_EQ(result(1).status, 0) << "it was never accepted";
  EXPECT_EQ(end(), 0);
}

TEST_F(ActionOfRos, ANewGoalInMotionTakesThePlaceOfTheOldOne) {
  run();
  ASSERT_TRUE(send(1, {.points = {{600.0, {1.5}}}}));
  const std::string first = ask(1);
  EXPECT_TRUE(eventually([&] { return position_rad(0) > 0.01; }));
  EXPECT_FALSE(send(1, {.points = {{1.0, {0.0}}}})) << "an id that there was";
  EXPECT_NE(why().find("known already"), std::string::npos);
  ASSERT_TRUE(send(2, {.points = {{2.0, {-0.2}}}}));
  const Result left = result_of(first);
  EXPECT_EQ(left.status, kAborted);
  EXPECT_EQ(left.code, -1);
  EXPECT_EQ(left.words, "Current goal preempted by new incoming action.");
  EXPECT_EQ(result(2).status, kSucceeded);
  EXPECT_NEAR(position_rad(0), -0.2, 0.01);
  EXPECT_EQ(end(), 0);
}

TEST_F(ActionOfRos, ACancelledGoalHolds) {
  run();
  EXPECT_EQ(cancel(7), 2) << "unknown";
  EXPECT_EQ(cancel(0), 0) << "all of none";
  ASSERT_TRUE(send(1, {.points = {{600.0, {1.5}}}}));
  const std::string asked = ask(1);
  EXPECT_TRUE(eventually([&] { return position_rad(0) > 0.01; }));
  EXPECT_EQ(cancel(1), 0);
  EXPECT_EQ(result_of(asked).status, kCanceled);
  holds(0);
  EXPECT_LT(position_rad(0), 1.4);
  EXPECT_EQ(cancel(1), 3) << "it has ended";
  ASSERT_TRUE(send(2, {.points = {{600.0, {1.5}}}}));
  EXPECT_EQ(cancel(0), 0) << "every goal";
  EXPECT_EQ(result(2).status, kCanceled);
  EXPECT_EQ(end(), 0);
}

TEST_F(ActionOfRos, SaysWhichJointLeftItsPathAndHolds) {
  run();
  ASSERT_TRUE(send(1, {.points = {{600.0, {1.5}}}, .path = {{kPan[0], 1e-9}}}));
  const Result left = result(1);
  EXPECT_EQ(left.status, kAborted);
  EXPECT_EQ(left.code, -4);
  EXPECT_NE(left.words.find("joint 'shoulder_pan_joint' is "), std::string::npos) << left.words;
  EXPECT_NE(left.words.find("beyond the tolerance of 1e-09 rad"), std::string::npos) << left.words;
  holds(0);
  ASSERT_TRUE(send(2, {.points = {{1.0, {0.1}}}, .path = {{kPan[0], -1.0}}}));
  EXPECT_EQ(result(2).status, kSucceeded) << "none of its own, and the controller has none";
  EXPECT_EQ(end(), 0);
}

TEST_F(ActionOfRos, SaysWhichJointIsNotAtTheGoalInTime) {
  run();
  ASSERT_TRUE(
      send(1, {.points = {{1.0, {0.123456789}}}, .goal = {{kPan[0], 1e-12}}, .goal_time_s = 0.5}));
  const Result left = result(1);
  EXPECT_EQ(left.status, kAborted);
  EXPECT_EQ(left.code, -5);
  EXPECT_NE(left.words.find("'shoulder_pan_joint'"), std::string::npos) << left.words;
  EXPECT_NE(left.words.find("from its goal"), std::string::npos) << left.words;
  holds(0);
  EXPECT_EQ(end(), 0);
}

TEST_F(ActionOfRos, AStopAbortsTheGoal) {
  run();
  ASSERT_TRUE(send(1, {.points = {{600.0, {1.5}}}}));
  const std::string asked = ask(1);
  EXPECT_TRUE(eventually([&] { return position_rad(0) > 0.01; }));
  EXPECT_EQ(to_run("estop").status, 0);
  const Result left = result_of(asked);
  EXPECT_EQ(left.status, kAborted);
  EXPECT_EQ(left.code, -1);
  EXPECT_NE(left.words.find("stopped: "), std::string::npos) << left.words;
  EXPECT_FALSE(send(2, {.points = {{1.0, {0.1}}}}));
  EXPECT_NE(why().find("phase"), std::string::npos) << why();
  EXPECT_EQ(end(), 1) << "a stop is no success";
}

TEST_F(ActionOfRos, AControllerThatIsStoppedAbortsTheGoal) {
  run();
  ASSERT_TRUE(send(1, {.points = {{600.0, {1.5}}}}));
  EXPECT_EQ(to_run("controller switch --stop trajectory --start positions").status, 0);
  const Result left = result(1);
  EXPECT_EQ(left.status, kAborted);
  EXPECT_NE(left.words.find("not active"), std::string::npos) << left.words;
  EXPECT_EQ(end(), 0);
}

/// One feeds the input: who has a goal under way, until it ends.
TEST_F(ActionOfRos, AnotherClientAndTheTopicWaitForTheGoalsEnd) {
  run("domain", {"tell", "/joint_trajectory", "trajectory_msgs/msg/JointTrajectory"});
  const auto second = client();
  ASSERT_TRUE(send(1, {.points = {{600.0, {1.5}}}}));
  EXPECT_FALSE(send(*second, 2, {.points = {{1.0, {-0.3}}}}));
  EXPECT_NE(why().find("a goal of its action is under way"), std::string::npos) << why();
  const double lift = position_rad(1);
  Members empty;  // no way-points: it would stop the joints
  add_time(empty, 0.0).text("").nothing().nothing();
  const auto refused = [&] { return answer(R"({"do": "input.list"})")["inputs"][0]["refused"]; };
  const auto before = refused();
  EXPECT_TRUE(eventually([&] {
    caller_->say("/joint_trajectory " + dds::test::to_hex(empty));
    return refused() > before;
  }));
  EXPECT_EQ(cancel(1), 0);
  EXPECT_EQ(result(1).status, kCanceled);
  std::uint8_t number = 2;
  EXPECT_TRUE(eventually([&] { return send(*second, ++number, {.points = {{1.0, {-0.3}}}}); }));
  EXPECT_TRUE(eventually([&] { return std::abs(position_rad(0) + 0.3) < 0.01; }));
  EXPECT_NEAR(position_rad(1), lift, 1e-3);
  EXPECT_EQ(end(), 0);
}

TEST_F(ActionOfRos, AStrangerLeadsNothingUntilHeIsAdmitted) {
  run("admitted");
  const Goal goal{.points = {{1.0, {0.1}}}};
  EXPECT_FALSE(send(1, goal));
  EXPECT_NE(why().find("is a stranger"), std::string::npos) << why();
  const std::string admit =
      R"({"do": "dds.admit", "participant": ")" + caller_->participant() + "\"}";
  EXPECT_EQ(to_run("ask " + shell_word(admit)).status, 0);
  EXPECT_TRUE(send(1, goal));
  EXPECT_EQ(result(1).status, kSucceeded);
  const auto stranger = client();
  ASSERT_TRUE(send(2, {.points = {{600.0, {1.5}}}}));
  Members request;
  add_time(add_id(request, 2), 0.0);
  const Reply<CancelReply> reply(stranger->call(kCancel, request));
  EXPECT_EQ(reply.at<std::int64_t>("return_code"), 1) << "nor does he stop it";
  EXPECT_EQ(end(), 0);
}

/// What is past of a trajectory is left out; what is to come begins later.
TEST_F(ActionOfRos, AStampIsTheTrajectorysBeginning) {
  run();
  EXPECT_TRUE(eventually([&] { return time_s() > 2.0; }));
  ASSERT_TRUE(send(1, {.points = {{0.5, {3.0}}, {600.0, {0.4}}}, .stamp_s = 1.0}));
  EXPECT_TRUE(eventually([&] { return position_rad(0) > 0.01; }));
  EXPECT_LT(position_rad(0), 0.4) << "the first way-point was past";
  ASSERT_TRUE(send(2, {.points = {{1.0, {0.5}}}, .stamp_s = time_s() + 20.0}));
  EXPECT_EQ(result(2).status, kSucceeded);
  EXPECT_NEAR(position_rad(0), 0.5, 0.01);
  EXPECT_EQ(end(), 0);
}

/// The layout of rmw_cyclonedds_cpp, by clients of ours.
TEST_F(ActionOfRos, AnswersCycloneDdsToo) {
  using dds::control_msgs::FollowJointTrajectory_GetResult_Request;
  using dds::control_msgs::FollowJointTrajectory_SendGoal_Request;
  run();
  auto domain = dds::Domain::open(dds::test::own_config());
  ASSERT_TRUE(domain) << domain.error().to_string();
  const auto participant = std::move(*dds::Participant::open(std::move(*domain), "moveit"));
  auto send_goal = dds::ServiceClient<FollowJointTrajectory_SendGoal_Request, SendReply>::create(
      *participant, kAction + "send_goal");
  auto get_result =
      dds::ServiceClient<FollowJointTrajectory_GetResult_Request, ResultReply>::create(
          *participant, kAction + "get_result");
  ASSERT_TRUE(send_goal && get_result);
  std::string nothing, pan = kPan[0];
  std::array<char*, 1> names{pan.data()};
  std::array<double, 1> to{0.2};
  trajectory_msgs_msg_dds__JointTrajectoryPoint_ point{};
  point.positions = {1, 1, to.data(), false};
  point.time_from_start = {.sec = 1, .nanosec = 0};
  FollowJointTrajectory_SendGoal_Request request{};
  request.goal_id.uuid[0] = 5;
  request.goal.trajectory.header.frame_id = nothing.data();
  request.goal.multi_dof_trajectory.header.frame_id = nothing.data();
  request.goal.trajectory.joint_names = {1, 1, names.data(), false};
  request.goal.trajectory.points = {1, 1, &point, false};
  constexpr std::chrono::seconds kPatience{20};
  bool accepted = false;
  int status = -1;
  ASSERT_TRUE(send_goal->call(request, kPatience,
                              [&](const SendReply& reply) { accepted = reply.accepted; }));
  EXPECT_TRUE(accepted);
  FollowJointTrajectory_GetResult_Request wanted{};
  wanted.goal_id.uuid[0] = 5;
  ASSERT_TRUE(get_result->call(wanted, kPatience,
                               [&](const ResultReply& reply) { status = reply.status; }));
  EXPECT_EQ(status, kSucceeded);
  EXPECT_NEAR(position_rad(0), 0.2, 0.01);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
