// A run's services asked by Fast DDS, as the ROS 2 nodes ask that have its middleware.
#include "dds/service_layout.hpp"
#include "tests/apps/running.hpp"
#include "tests/dds/fastdds_caller.hpp"

namespace tandem::apps {
namespace {

using dds::test::Members;
using dds::test::Octets;
using dds::test::Reply;
using namespace dds::tandem_msgs;
using dds::std_srvs::Trigger_Response;

const Octets kTrigger{0, 1, 0, 0, 0};

class RunForFastDds : public Running {
 protected:
  void SetUp() override {
    if (!dds::test::have_fastdds_caller()) GTEST_SKIP() << dds::test::kNoFastDds;
    if (!dds::answers_fast_dds()) GTEST_SKIP() << "built for another version of Cyclone DDS";
    Running::SetUp();
  }
  void begin_with(const std::string& remote) {
    if (!remote.empty()) {
      write_text(folder_ / "hold.toml",
                 read_text(folder_ / "hold.toml") + "[remote]\ncommand = \"local\"\n" + remote);
    }
    begin("--on-fault wait --dds --domain " + std::to_string(dds::test::own_domain()));
  }
  static nlohmann::json ask(dds::test::FastDdsCaller& caller, int client,
                            const std::string& question) {
    const Reply<Ask_Response> reply(caller.call(client, Members().text(question)));
    const auto answer = nlohmann::json::parse(reply.text("answer"), nullptr, false);
    return answer.is_object() ? answer : nlohmann::json::object();
  }
};

TEST_F(RunForFastDds, StopsResetsAndStartsAgain) {
  begin_with("trust = \"domain\"\n");
  dds::test::FastDdsCaller caller({"/tandem/emergency_stop", "std_srvs/srv/Trigger",
                                   "/tandem/clear_faults", "std_srvs/srv/Trigger",
                                   "/tandem/start_controllers", "std_srvs/srv/Trigger"});
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(caller.ready(i));
  const auto trigger = [&](int client) {
    const Reply<Trigger_Response> reply(caller.call(client, kTrigger));
    return std::string(reply.yes("success") ? "yes: " : "no: ") + reply.text("message");
  };
  EXPECT_EQ(trigger(0), "yes: emergency stop, category 1");
  until(R"("phase": "faulted")");
  EXPECT_TRUE(trigger(1).starts_with("yes: "));
  until(R"("phase": "held")");
  EXPECT_TRUE(trigger(2).starts_with("yes: "));
  until(R"("phase": "running")");
  EXPECT_EQ(end(), 0);
}

TEST_F(RunForFastDds, ListsAndSwitchesControllers) {
  begin_with("trust = \"domain\"\n");
  dds::test::FastDdsCaller caller({"/tandem/list_controllers", "tandem_msgs/srv/ListControllers",
                                   "/tandem/switch_controllers",
                                   "tandem_msgs/srv/SwitchControllers"});
  ASSERT_TRUE(caller.ready(0) && caller.ready(1));
  const Reply<ListControllers_Response> listed(caller.call(0, kTrigger));
  EXPECT_TRUE(listed.yes("success"));
  EXPECT_EQ(listed.text("controllers.0.name"), "hold");
  EXPECT_TRUE(listed.yes("controllers.0.active"));
  EXPECT_EQ(listed.text("controllers.0.claims.1.joint"), "joint2");
  const Reply<SwitchControllers_Response> refused(
      caller.call(1, Members().texts({"nobody"}).nothing()));
  EXPECT_FALSE(refused.yes("success"));
  EXPECT_NE(refused.text("message").find("nobody"), std::string::npos);
  const Reply<SwitchControllers_Response> stopped(
      caller.call(1, Members().texts({"hold"}).nothing()));
  EXPECT_TRUE(stopped.yes("success")) << stopped.text("message");
  EXPECT_FALSE(
      Reply<ListControllers_Response>(caller.call(0, kTrigger)).yes("controllers.0.active"));
  EXPECT_EQ(end(), 0);
}

/// The refusal tells the GUID by which the operator lets it in.
TEST_F(RunForFastDds, RefusesAStrangerUntilHeIsAdmitted) {
  begin_with("trust = \"admitted\"\n");
  dds::test::FastDdsCaller caller({"/tandem/ask", "tandem_msgs/srv/Ask"});
  dds::test::FastDdsCaller stranger({"/tandem/ask", "tandem_msgs/srv/Ask"});
  const std::string participant = caller.participant();
  ASSERT_TRUE(caller.ready(0) && stranger.ready(0));
  const std::string stop = R"({"do": "controller.stop", "name": "hold"})";
  const std::string refused = ask(caller, 0, stop).dump();
  EXPECT_NE(refused.find("takes no commands from a stranger"), std::string::npos) << refused;
  EXPECT_NE(refused.find(participant), std::string::npos) << refused;
  const std::string admit = R"({"do": "dds.admit", "participant": ")" + participant + "\"}";
  EXPECT_EQ(ask(caller, 0, admit)["ok"], false) << "not by himself";
  EXPECT_EQ(to_run("ask " + shell_word(admit)).status, 0);
  EXPECT_EQ(ask(caller, 0, stop)["ok"], true);
  EXPECT_EQ(ask(stranger, 0, stop)["ok"], false);
  EXPECT_EQ(end(), 0);
}

TEST_F(RunForFastDds, HasTheParametersOfARosNode) {
  using namespace dds::rcl_interfaces;
  begin_with("trust = \"domain\"\n");
  dds::test::FastDdsCaller caller(
      {"/tandem_run/list_parameters", "rcl_interfaces/srv/ListParameters",
       "/tandem_run/get_parameters", "rcl_interfaces/srv/GetParameters",
       "/tandem_run/set_parameters", "rcl_interfaces/srv/SetParameters",
       "/tandem_run/describe_parameters", "rcl_interfaces/srv/DescribeParameters"});
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(caller.ready(i));
  const std::string damping = "hold.link_damping_Nms_rad";
  const Reply<ListParameters_Response> listed(
      caller.call(0, Members().nothing().number(std::uint64_t{0})));
  EXPECT_EQ(listed.text("result.names.2"), damping);
  EXPECT_EQ(listed.text("result.prefixes.0"), "hold");
  const auto get = [&] {
    return Reply<GetParameters_Response>(caller.call(1, Members().texts({damping})))
        .at<double>("values.0.double_value");
  };
  const auto set = [&](double value) {
    Members request;
    request.number(std::uint32_t{1}).text(damping);
    request.number(std::uint8_t{3}).number(std::uint8_t{0}).number(std::int64_t{0}).number(value);
    request.text("").nothing().nothing().nothing().nothing().nothing();
    return Reply<SetParameters_Response>(caller.call(2, request)).text("results.0.reason");
  };
  EXPECT_EQ(get(), 0.0);
  EXPECT_EQ(set(0.75), "");
  EXPECT_EQ(get(), 0.75);
  EXPECT_NE(set(-1.0).find("is out of range"), std::string::npos);
  EXPECT_NE(set(std::numeric_limits<double>::quiet_NaN()), "");
  EXPECT_EQ(get(), 0.75);
  EXPECT_EQ(Reply<DescribeParameters_Response>(caller.call(3, Members().texts({damping})))
                .text("descriptors.0.name"),
            damping);
  EXPECT_EQ(end(), 0);
}

/// In another process than the run, Cyclone DDS sees the replies to Fast DDS and leaves them out.
TEST_F(RunForFastDds, DoesNotDisturbClientsOfCycloneDds) {
  begin_with("");
  dds::test::FastDdsCaller caller({"/tandem/ask", "tandem_msgs/srv/Ask"});
  ASSERT_TRUE(caller.ready(0));
  const std::string status = R"({"do": "fault.show"})";
  std::vector<std::string> numbers;
  std::atomic<bool> asked{false};
  std::thread cyclone([&] {
    for (int i = 0; i < 5; ++i) {
      const Outcome outcome =
          tandem("ask '" + status + "' --dds --domain " + std::to_string(dds::test::own_domain()));
      EXPECT_EQ(outcome.status, 0);
      EXPECT_EQ(outcome.err, "");
      EXPECT_NE(outcome.out.find("\"faults\""), std::string::npos) << outcome.out;
    }
    asked = true;
  });
  std::uint64_t answers = 0;
  while (!asked) {  // as often as a node may ask: a hundred times a second
    EXPECT_EQ(ask(caller, 0, status)["ok"], true);
    ++answers;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  cyclone.join();
  EXPECT_GT(answers, 5U);
  EXPECT_EQ(end(), 0);
}

/// What one client sends comes in order, what several send in any.
TEST_F(RunForFastDds, CountsWhatIsNoRequest) {
  begin_with("trust = \"domain\"\n");
  dds::test::FastDdsCaller caller({"/tandem/emergency_stop", "std_srvs/srv/Trigger", "/tandem/ask",
                                   "tandem_msgs/srv/Ask", "/tandem/set_joint",
                                   "tandem_msgs/srv/SetJoint"});
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(caller.ready(i));
  caller.send(0, {0, 1, 0, 0});
  caller.send(1, {0, 1, 0, 0, 200, 0, 0, 0, '{', 0});
  caller.send(2, Members().text("joint2").text("position"));
  Members no_joint;
  no_joint.text("nobody").text("").text("").nothing().nothing();
  EXPECT_FALSE(Reply<SetJoint_Response>(caller.call(2, no_joint)).yes("success"));
  EXPECT_EQ(ask(caller, 1, R"({"do": "status"})")["phase"], "running");
  EXPECT_TRUE(Reply<Trigger_Response>(caller.call(0, kTrigger)).yes("success"));
  EXPECT_EQ(end(), 1) << "the stop that is one";
  EXPECT_EQ(json("run.json")["dds"]["requests_malformed"], 3);
  EXPECT_EQ(json("run.json")["dds"]["requests"], 3) << "a stop that is none stops nothing";
}

}  // namespace
}  // namespace tandem::apps
