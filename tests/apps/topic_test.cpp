// `tandem run --dds` as `tandem topic` sees it, and what publishing does not change.
#include <map>
#include <set>

#include "dds/endpoint.hpp"
#include "tests/apps/running.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::apps {
namespace {

class Topic : public Running {
 protected:
  void SetUp() override {
    Running::SetUp();
    domain_ = " --domain " + std::to_string(dds::test::own_domain());
  }
  [[nodiscard]] Outcome topic(const std::string& arguments) const {
    return tandem("topic " + arguments + domain_);
  }
  [[nodiscard]] nlohmann::json topic_json(const std::string& arguments) const {
    const Outcome outcome = topic(arguments + " --json -");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
  /// The list once `topic` is on it.
  [[nodiscard]] std::map<std::string, nlohmann::json> listed_with(const std::string& topic) const {
    std::map<std::string, nlohmann::json> found;
    for (int i = 0; i < 60 && !found.contains(topic); ++i) {
      found.clear();
      for (const auto& one : topic_json("list --wait 0.5")) found[one["topic"]] = one;
    }
    EXPECT_TRUE(found.contains(topic)) << topic;
    return found;
  }

  std::string domain_;
};

TEST_F(Topic, ListHasEveryTopicWithItsTypeAndQuality) {
  begin("--dds" + domain_);
  const auto found = listed_with("/tandem/state");
  const std::map<std::string, std::pair<std::string, bool>> expected{
      {"/joint_states", {"sensor_msgs/msg/JointState", false}},
      {"/clock", {"rosgraph_msgs/msg/Clock", false}},
      {"/tf", {"tf2_msgs/msg/TFMessage", false}},
      {"/tf_static", {"tf2_msgs/msg/TFMessage", true}},
      {"/robot_description", {"std_msgs/msg/String", true}},
      {"/diagnostics", {"diagnostic_msgs/msg/DiagnosticArray", false}},
      {"/tandem/state", {"tandem_msgs/msg/State", false}},
      {"/tandem/command", {"tandem_msgs/msg/Command", false}},
      {"/tandem/statistics", {"tandem_msgs/msg/LoopStatistics", false}},
      {"/tandem/robot", {"tandem_msgs/msg/Robot", true}},
      {"/tandem/faults", {"tandem_msgs/msg/Faults", true}},
  };
  for (const auto& [name, type] : expected) {
    ASSERT_TRUE(found.contains(name)) << name;
    const nlohmann::json& one = found.at(name);
    EXPECT_EQ(one["type"], type.first);
    EXPECT_EQ(one["transient_local"], type.second) << name;
    EXPECT_EQ(one["reliable"], true) << name;
    EXPECT_EQ(one["writers"], 1) << name;
    EXPECT_EQ(one["known"], true) << name;
  }
  EXPECT_FALSE(found.contains("/dynamic_joint_states")) << "it is off";
  EXPECT_FALSE(found.contains("/odom")) << "the base is fixed";
  const Outcome table = topic("list");
  EXPECT_NE(table.out.find("/joint_states"), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("reliable, transient"), std::string::npos) << table.out;
  EXPECT_EQ(end(), 0);
}

TEST_F(Topic, EchoPrintsWhatTheRunMeasures) {
  begin("--dds" + domain_);
  const Outcome yaml = topic("echo /joint_states --once --wait 30");
  EXPECT_EQ(yaml.status, 0) << yaml.err;
  EXPECT_NE(yaml.out.find("header:\n  stamp:\n    sec: "), std::string::npos) << yaml.out;
  EXPECT_NE(yaml.out.find("  frame_id: ''\nname:\n- joint1\n- joint2\nposition:\n- "),
            std::string::npos)
      << yaml.out;
  EXPECT_TRUE(yaml.out.ends_with("---\n")) << yaml.out;
  EXPECT_EQ(topic("echo joint_states --once --field name[1]").out, "joint2\n---\n");
  const auto samples = topic_json("echo /tandem/state --count 3");
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[1]["cycle"].get<int>() - samples[0]["cycle"].get<int>(), 10);
  EXPECT_EQ(samples[0]["cycle"].get<int>() % 10, 0);
  EXPECT_EQ(samples[0]["time_ns"].get<std::int64_t>(),
            samples[0]["cycle"].get<std::int64_t>() * 1'000'000);
  const auto text = topic_json("echo /robot_description --once");  // it came before we did
  EXPECT_EQ(text["data"].get<std::string>(), read_text(folder_ / "double_pendulum.urdf"));
  EXPECT_EQ(end(), 0);
}

TEST_F(Topic, HzCountsWhatIsLostByTheCyclesNumbers) {
  begin("--dds" + domain_);
  const auto state = topic_json("hz /tandem/state --count 100 --wait 30");
  EXPECT_EQ(state["samples"], 100);
  EXPECT_EQ(state["window"], 99);
  EXPECT_TRUE(state["lost"].is_number());
  EXPECT_GT(state["rate_Hz"].get<double>(), 0.0);
  EXPECT_LE(state["min_s"].get<double>(), state["max_s"].get<double>());
  EXPECT_TRUE(state["interval_ns"]["p99"].is_number());
  EXPECT_TRUE(topic_json("hz /joint_states --count 5")["lost"].is_null());
  EXPECT_EQ(end(), 0);
}

TEST_F(Topic, ErrorsNameTheNearestTopicAndField) {
  begin("--dds" + domain_);
  (void)listed_with("/tandem/state");
  const Outcome wrong = topic("echo /joint_state --once --wait 2");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.err.find("no process writes /joint_state"), std::string::npos) << wrong.err;
  EXPECT_NE(wrong.err.find("did you mean '/joint_states'?"), std::string::npos) << wrong.err;
  const Outcome field = topic("echo /joint_states --once --field positions");
  EXPECT_EQ(field.status, 2);
  EXPECT_NE(field.err.find("did you mean 'position'?"), std::string::npos) << field.err;
  EXPECT_EQ(end(), 0);
}

#ifndef TANDEM_NOTHING_APART  // by these sanitizers
/// A vendor's SDK and the program each have a Cyclone DDS: the calls of one went to the other's.
TEST_F(Topic, OfARunWhoseControllerBringsALibddscOfItsOwn) {
  const std::string plugins = TANDEM_BINARY_DIR "/tests/test_plugins/";
  const std::string hold = read_text(folder_ / "hold.toml");
  const auto with = [&](const std::string& name) {
    const std::size_t at = hold.find("[[controller]]");
    return hold.substr(0, at) + "[[controller]]\nplugin = \"" + plugins + name + ".so\"\n";
  };
  write_text(folder_ / "other.toml", with("gets_ddsc"));
  const Outcome mixed = tandem("check other.toml");
  EXPECT_EQ(mixed.status, 2);
  EXPECT_NE(
      mixed.err.find("libddsc.so.0, whose calls would go to the program's libddsc.so.0debian"),
      std::string::npos)
      << mixed.err;
  write_text(folder_ / "hold.toml", with("brings_ddsc"));
  begin("--dds" + domain_);
  const Outcome echo = topic("echo /joint_states --once --wait 30");
  EXPECT_EQ(echo.status, 0) << echo.err;
  EXPECT_EQ(end(), 0);
  EXPECT_EQ(json("run.json")["fault_log"].size(), 0U);
}
#endif

TEST_F(Topic, ListSaysWhatToLookAtWhenNobodyIsThere) {
  const Outcome nobody = topic("list --wait 0.2");
  EXPECT_EQ(nobody.status, 0) << nobody.err;
  EXPECT_NE(nobody.out.find("--dds"), std::string::npos) << nobody.out;
}

TEST_F(Topic, OfTwoRobotsInOneDomainAreKeptApartByTheirNamespaces) {
  const std::string hold = read_text(folder_ / "hold.toml");
  write_text(folder_ / "other.toml", hold + "[dds]\nnamespace = \"right\"\n");
  write_text(folder_ / "hold.toml", hold + "[dds]\nnamespace = \"left\"\n");
  begin(domain_);
  std::thread other([&] {
    const std::string command = "cd " + shell_word(folder_.string()) +
                                " && echo $$ >other.pid && exec " +
                                shell_word(TANDEM_BINARY_DIR "/bin/tandem") +
                                " run other.toml --no-log -q"
                                " --no-socket --rate 20 --duration 2000" +
                                domain_;
    (void)!std::system(command.c_str());
  });
  const auto found = listed_with("/right/joint_states");
  EXPECT_TRUE(found.contains("/left/joint_states"));
  EXPECT_EQ(found.at("/left/joint_states")["writers"], 1);
  EXPECT_EQ(found.at("/right/joint_states")["writers"], 1);
  EXPECT_FALSE(found.contains("/joint_states"));
  EXPECT_EQ(topic("echo /right/joint_states --once --field name[0]").out, "joint1\n---\n");
  EXPECT_EQ(
      std::system(("kill $(cat " + shell_word((folder_ / "other.pid").string()) + ")").c_str()), 0);
  other.join();
  EXPECT_EQ(end(), 0);
}

TEST_F(Topic, ClockGoesOnWhileTheRunIsPausedAndSaysTheSameTime) {
  start("--start-paused --duration 2000 --dds" + domain_);
  until(R"("paused": true)");
  const auto times = [&] {
    std::set<std::int64_t> found;
    for (const auto& one : topic_json("echo /clock --count 3 --wait 30")) {
      found.insert(one["clock"]["sec"].get<std::int64_t>() * 1'000'000'000 +
                   one["clock"]["nanosec"].get<std::int64_t>());
    }
    return found;
  };
  EXPECT_EQ(times(), std::set<std::int64_t>{0});
  EXPECT_EQ(to_run("clock step 51").status, 0);
  EXPECT_EQ(times(), std::set<std::int64_t>{50'000'000});
  EXPECT_EQ(end(), 0);
}

TEST_F(Topic, FaultsAndDiagnosticsTellAnEmergencyStopAndItsReset) {
  begin("--on-fault wait --dds" + domain_);
  EXPECT_EQ(topic_json("echo /tandem/faults --once --wait 30")["faults"].size(), 0U);
  EXPECT_EQ(to_run("estop").status, 0);
  until(R"("phase": "faulted")");
  nlohmann::json faults;
  const auto told = [&](bool latched) {
    for (int i = 0; i < 100; ++i) {
      faults = topic_json("echo /tandem/faults --once")["faults"];
      if (faults.size() == 1 && faults[0]["latched"] == latched) return true;
    }
    return false;
  };
  EXPECT_TRUE(told(true)) << faults;
  EXPECT_EQ(faults[0]["category"], "category1");
  EXPECT_EQ(faults[0]["joint"], "");
  const auto run = topic_json("echo /diagnostics --once --field status[0]");
  EXPECT_EQ(run["name"], "tandem: run");
  EXPECT_EQ(run["level"], 2);
  EXPECT_EQ(run["message"], faults[0]["text"]);
  EXPECT_EQ(to_run("fault reset").status, 0);
  EXPECT_TRUE(told(false)) << faults;
  EXPECT_GT(faults[0]["cleared_s"].get<double>(), faults[0]["time_s"].get<double>());
  EXPECT_EQ(end(), 0);
}

TEST_F(Topic, PublishingDoesNotChangeTheRun) {
  const auto run = [&](const std::string& flags) {
    const Outcome outcome = tandem("run trajectory.toml --duration 2 --quiet --json - " + flags);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  };
  const auto without = run("--no-dds");
  EXPECT_TRUE(without["dds"].is_null());
  const auto domain = dds::Domain::open(dds::test::own_config());
  ASSERT_TRUE(domain) << domain.error().to_string();
  const auto listener = dds::Participant::open(*domain, "listener");
  ASSERT_TRUE(listener) << listener.error().to_string();
  auto reader = dds::Reader<dds::tandem_msgs::State>::create(**listener, "rt/tandem/state", {});
  ASSERT_TRUE(reader) << reader.error().to_string();
  const auto with = run("--dds --rate 1" + domain_);
  EXPECT_GT(reader->take([](const auto&, const auto&) {}), 0U);
  EXPECT_EQ(with["dds"]["domain"], dds::test::own_domain());
  EXPECT_GT(with["dds"]["samples"].get<int>(), 4);  // more than those that do not change
  EXPECT_EQ(without["log"]["data_sha256"], with["log"]["data_sha256"]);
}

TEST_F(Topic, OfADomainThatCannotBeEnteredEndTheRunBeforeItBegins) {
  edit("hold.toml", "[[controller]]", "[dds]\ninterfaces = [\"nosuch0\"]\n[[controller]]");
  const Outcome outcome = tandem("run hold.toml" + domain_);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("nosuch0"), std::string::npos) << outcome.err;
  EXPECT_FALSE(has_log());
}

TEST_F(Topic, NeedNoNetwork) {
  const std::string isolated = "unshare --user --map-root-user --net sh -c ";
  const std::string with_loopback = "ip link set lo up && ";
  if (std::system((isolated + shell_word(with_loopback + "true") + " >/dev/null 2>&1").c_str()) !=
      0) {
    GTEST_SKIP() << test::needs_root("a network of its own (unshare --user --net)");
  }
  const std::string tandem = shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " ";
  const std::string script =
      "cd " + shell_word(folder_.string()) + " && " + isolated +
      shell_word(with_loopback + "{ " + tandem +
                 "run hold.toml --dds --no-log -q --rate 20 --duration 2000 & run=$!; " + tandem +
                 "topic echo /joint_states --once --wait 30 --field name; " +
                 "status=$?; kill $run; wait $run; exit $status; }") +
      " >out.txt 2>err.txt";
  EXPECT_EQ(std::system(script.c_str()), 0) << read_text(folder_ / "err.txt");
  EXPECT_EQ(read_text(folder_ / "out.txt"), "- joint1\n- joint2\n---\n");
}

/// Before --dds-from an operator in a secured domain could not stop the robot over DDS.
TEST_F(Topic, InASecuredDomainTheKeysOfATomlOpenEveryCommand) {
#ifndef TANDEM_DDS_SECURITY
  GTEST_SKIP() << "Cyclone DDS has no security plugins here";
#endif
  if (std::system("openssl version > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "the openssl command is not installed";
  }
  const std::string keys = (folder_ / "keys").string();
  ASSERT_EQ(std::system((shell_word(TANDEM_SOURCE_DIR "/examples/dds_security/make-files") + " " +
                         shell_word(keys) + " > /dev/null 2>&1")
                            .c_str()),
            0);
  write_text(folder_ / "hold.toml", read_text(folder_ / "hold.toml") + R"(
[dds]
namespace = "cell"
domain = )" + std::to_string(dds::test::own_domain()) +
                                        R"(
[dds.security]
identity_ca = "keys/ca.pem"
identity_certificate = "keys/robot.pem"
private_key = "keys/robot.key"
permissions_ca = "keys/ca.pem"
governance = "keys/governance.p7s"
permissions = "keys/permissions.p7s"
)");
  begin("");
  EXPECT_EQ(topic("echo /cell/joint_states --once --wait 1").status, 2)
      << "a stranger hears nothing";
  const Outcome stranger = tandem("estop --dds" + domain_);
  EXPECT_NE(stranger.status, 0);
  EXPECT_NE(stranger.err.find("--dds-from"), std::string::npos) << stranger.err;
  const Outcome echo = tandem("topic echo /cell/joint_states --once --dds-from hold.toml");
  EXPECT_EQ(echo.status, 0) << echo.err;
  const Outcome stop = tandem("estop --dds-from hold.toml");
  EXPECT_EQ(stop.status, 0) << stop.err;
  EXPECT_NE(stop.out.find("emergency stop"), std::string::npos);
  const Outcome without = tandem("estop --dds-from robot.toml");
  EXPECT_NE(without.err.find("robot.toml: there is no table [dds]"), std::string::npos);
  EXPECT_EQ(join(), 1) << "simulated time: the run ends with the stop";
}

}  // namespace
}  // namespace tandem::apps
