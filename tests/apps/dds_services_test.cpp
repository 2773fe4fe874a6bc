// A run's services over DDS do what its registry's commands do, and no more than [remote] allows.
#include "apps/transport/dds_services.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <regex>

#include "dds/service_client.hpp"
#include "tests/apps/running.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::apps {
namespace {

using namespace dds::tandem_msgs;
using dds::std_srvs::Trigger_Request;
using dds::std_srvs::Trigger_Response;
using tandem::test::eventually;
using Texts = std::vector<std::string>;

class RunOverDds : public Running {
 protected:
  void SetUp() override {
    Running::SetUp();
    dds::Config config = dds::test::own_config();
    auto domain = dds::Domain::open(config);
    ASSERT_TRUE(domain) << domain.error().to_string();
    auto joined = dds::Participant::open(std::move(*domain), "tester");
    ASSERT_TRUE(joined) << joined.error().to_string();
    participant_ = std::move(*joined);
  }
  /// A run in this program's domain. @param remote  [remote] command; empty: none
  /// @param more  lines of [remote]
  void begin_with(const std::string& remote, const std::string& more = "") {
    if (!remote.empty()) {
      write_text(folder_ / "hold.toml",
                 read_text(folder_ / "hold.toml") + "[remote]\ncommand = \"" + remote + "\"\n" +
                     more +
                     (more.find("trust") == std::string::npos ? "trust = \"domain\"\n" : ""));
    }
    begin("--on-fault wait --dds --domain " + std::to_string(dds::test::own_domain()));
  }
  /// Calls a service; `use` sees the reply.
  template <class Response, class Request>
  void call(const std::string& name, const Request& request,
            const std::function<void(const Response&)>& use) {
    auto client = dds::ServiceClient<Request, Response>::create(*participant_, "tandem/" + name);
    ASSERT_TRUE(client) << client.error().to_string();
    const Status done = client->call(request, std::chrono::seconds(30), use);
    EXPECT_TRUE(done) << done.error().to_string();
  }
  nlohmann::json ask(const std::string& question) {
    nlohmann::json answer;
    std::string text = question;
    call<Ask_Response>("ask", Ask_Request{0, 0, text.data()}, [&](const Ask_Response& reply) {
      answer = nlohmann::json::parse(reply.answer, nullptr, false);
    });
    return answer;
  }
  /// The same over the control socket, which is the local operator's.
  [[nodiscard]] nlohmann::json ask_local(const std::string& question) const {
    const Outcome outcome = to_run("ask " + shell_word(question));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
  /// "success message" of a trigger.
  std::string trigger(const std::string& name) {
    std::string text;
    call<Trigger_Response>(name, Trigger_Request{}, [&text](const Trigger_Response& reply) {
      text = std::string(reply.success ? "yes: " : "no: ") + reply.message;
    });
    return text;
  }
  Texts active_after(Texts stop, Texts start) {
    std::vector<char*> stops, starts;
    for (std::string& name : stop) stops.push_back(name.data());
    for (std::string& name : start) starts.push_back(name.data());
    const auto sequence = [](std::vector<char*>& names) {
      const auto count = static_cast<std::uint32_t>(names.size());
      return dds_sequence_string{count, count, names.data(), false};
    };
    Texts active;
    call<SwitchControllers_Response>(
        "switch_controllers", SwitchControllers_Request{0, 0, sequence(stops), sequence(starts)},
        [&](const SwitchControllers_Response& reply) {
          if (!reply.success) active.emplace_back(reply.message);
          for (std::uint32_t i = 0; i < reply.active._length; ++i) {
            active.emplace_back(reply.active._buffer[i]);
          }
          EXPECT_EQ(reply.done, reply.success);
          EXPECT_EQ(reply.cycle > 0, reply.success);
        });
    return active;
  }

  std::unique_ptr<dds::Participant> participant_;
};

TEST_F(RunOverDds, AnswerAsTheControlSocketDoes) {
  begin_with("");
  EXPECT_EQ(ask(R"({"do": "help"})"), ask_local(R"({"do": "help"})"));
  EXPECT_EQ(ask(R"({"do": "fault.show"})")["faults"], nlohmann::json::array());
  EXPECT_EQ(ask(R"({"do": "stattus"})")["hint"], R"({"do": "help"} lists them)") << "a stranger";
  EXPECT_EQ(ask_local(R"({"do": "dds.show"})")["participant"],
            ask(R"({"do": "dds.show"})")["participant"]);
  EXPECT_EQ(ask("rubbish")["ok"], false);
  EXPECT_EQ(ask("\xff\xfe")["ok"], false);
  EXPECT_NE(ask(std::string(300'000, ' '))["error"].dump().find("of more than 4096 bytes by"),
            std::string::npos);
  EXPECT_EQ(end(), 0);
  const auto counts = json("run.json")["dds"];
  EXPECT_EQ(counts["requests"], 7);
  EXPECT_EQ(counts["replies"], 7);
  EXPECT_EQ(counts["requests_dropped"], 0);
}

TEST_F(RunOverDds, ChangeNothingUnlessTheExperimentAllowsIt) {
  begin_with("");
  const auto refused = ask(R"({"do": "controller.stop", "name": "hold"})");
  EXPECT_EQ(refused["ok"], false);
  EXPECT_NE(refused["error"].dump().find("takes no commands over DDS"), std::string::npos);
  EXPECT_NE(refused["hint"].dump().find("[remote] command"), std::string::npos);
  EXPECT_EQ(ask(R"({"do": "run.stop"})")["ok"], false);
  EXPECT_NE(trigger("clear_faults").find("no: fault.reset: this process takes no commands"),
            std::string::npos);
  EXPECT_NE(active_after({"hold"}, {})[0].find("takes no commands"), std::string::npos);
  EXPECT_EQ(ask_local(R"({"do": "controller.list"})")["controllers"][0]["active"], true);
  EXPECT_EQ(trigger("emergency_stop"), "yes: emergency stop, category 1");
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1) << "it is latched";
}

/// "local" is every user of this machine: a participant is a stranger until somebody who may use
/// the control socket has named it.
TEST_F(RunOverDds, ChangesForAStrangerWaitUntilHeIsAdmitted) {
  begin_with("local", "trust = \"admitted\"\n");
  const auto refused = ask(R"({"do": "controller.stop", "name": "hold"})");
  EXPECT_EQ(refused["ok"], false);
  EXPECT_NE(refused["error"].dump().find("takes no commands from a stranger"), std::string::npos);
  const std::string self = dds::to_text(dds::id_of(*participant_));
  EXPECT_NE(refused["hint"].dump().find(self), std::string::npos) << refused["hint"];
  EXPECT_NE(refused["hint"].get<std::string>().find("[remote] trust = \"domain\""),
            std::string::npos)
      << "a `tandem` command is another participant at every try: " << refused["hint"];
  EXPECT_NE(active_after({"hold"}, {})[0].find("from a stranger"), std::string::npos);
  const std::string admit = R"({"do": "dds.admit", "participant": ")" + self + "\"}";
  EXPECT_EQ(ask(admit)["ok"], false) << "nor does he admit himself";
  EXPECT_EQ(ask(R"({"do": "status"})")["ok"], true);
  EXPECT_EQ(ask_local(R"({"do": "controller.list"})")["controllers"][0]["active"], true);
  EXPECT_EQ(ask_local(admit)["ok"], true);
  EXPECT_EQ(ask(R"({"do": "controller.stop", "name": "hold"})")["ok"], true);
  EXPECT_EQ(ask_local(R"({"do": "controller.list"})")["controllers"][0]["active"], false);
  EXPECT_EQ(trigger("emergency_stop"), "yes: emergency stop, category 1");
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1) << "it is latched";
}

TEST_F(RunOverDds, LoadsNoCodeUnlessAskedFor) {
  begin_with("local");
  std::string plugin = "/tmp/x.so", name = "x", parameters;
  LoadController_Request load{0, 0, plugin.data(), name.data(), parameters.data()};
  call<LoadController_Response>("load_controller", load, [](const LoadController_Response& reply) {
    EXPECT_FALSE(reply.success);
    EXPECT_NE(std::string(reply.message).find("loads no code over DDS"), std::string::npos)
        << reply.message;
  });
  EXPECT_EQ(end(), 0);
}

TEST_F(RunOverDds, LoadSwitchListAndUnloadControllers) {
  begin_with("local", "load = true\n");
  std::string plugin = "hold", name = "rest", parameters = "joints = ['joint2']";
  LoadController_Request load{0, 0, plugin.data(), name.data(), parameters.data()};
  const auto loaded = [](const LoadController_Response& reply) {
    EXPECT_TRUE(reply.success) << reply.message;
    ASSERT_EQ(reply.active._length, 1U);
    EXPECT_STREQ(reply.active._buffer[0], "hold");
  };
  call<LoadController_Response>("load_controller", load, loaded);
  EXPECT_NE(active_after({}, {"rest"})[0].find("claimed by the controllers"), std::string::npos);
  EXPECT_EQ(active_after({"hold"}, {"rest"}), Texts{"rest"});
  const auto local = ask_local(R"({"do": "controller.list"})")["controllers"];
  call<ListControllers_Response>(
      "list_controllers", ListControllers_Request{}, [&](const ListControllers_Response& reply) {
        EXPECT_TRUE(reply.success);
        ASSERT_EQ(reply.controllers._length, local.size());
        for (std::uint32_t i = 0; i < reply.controllers._length; ++i) {
          const auto& one = reply.controllers._buffer[i];
          EXPECT_EQ(one.name, local[i]["name"]);
          EXPECT_EQ(one.plugin, local[i]["plugin"]);
          EXPECT_EQ(one.active, local[i]["active"]);
          EXPECT_EQ(one.finished, local[i]["finished"]);
          EXPECT_EQ(one.of_experiment, local[i]["of_experiment"]);
          ASSERT_EQ(one.claims._length, local[i]["claims"].size());
          for (std::uint32_t c = 0; c < one.claims._length; ++c) {
            EXPECT_EQ(one.claims._buffer[c].joint, local[i]["claims"][c]["joint"]);
            EXPECT_EQ(one.claims._buffer[c].mode, local[i]["claims"][c]["mode"]);
            EXPECT_EQ(one.claims._buffer[c].interaction, local[i]["claims"][c]["interaction"]);
          }
        }
      });
  EXPECT_EQ(active_after({"rest"}, {}), Texts{});
  call<UnloadController_Response>(
      "unload_controller", UnloadController_Request{0, 0, name.data()},
      [](const UnloadController_Response& reply) { EXPECT_TRUE(reply.success) << reply.message; });
  const auto left = ask_local(R"({"do": "controller.list"})")["controllers"];
  ASSERT_EQ(left.size(), 2U);
  EXPECT_EQ(left[0]["name"], "hold");
  EXPECT_EQ(left[1]["name"], "remote") << "an owner's, which [remote] command brings";
  EXPECT_EQ(end(), 0);
}

TEST_F(RunOverDds, SetJointsAndTheirGains) {
  begin_with("local");
  ASSERT_EQ(active_after({"hold"}, {}), Texts{});
  std::string joint = "joint2", mode = "position", interaction = "compliant", none;
  double stiffness = 2.5, kp = 7.5;
  SetJoint_Request set{0,
                       0,
                       joint.data(),
                       mode.data(),
                       interaction.data(),
                       {1, 1, &stiffness, false},
                       {0, 0, nullptr, false}};
  std::string message;
  const auto was_set = [&](const SetJoint_Response& reply) {
    message = reply.message;
    EXPECT_EQ(reply.done, reply.success);
  };
  const auto before = ask_local(R"({"do": "joint.list"})")["joints"][1];
  call<SetJoint_Response>("set_joint", set, was_set);
  EXPECT_EQ(message, "");
  auto now = ask_local(R"({"do": "joint.list"})")["joints"][1];
  EXPECT_EQ(now["interaction"], "compliant");
  EXPECT_EQ(now["stiffness_Nm_rad"], 2.5);
  EXPECT_EQ(now["damping_Nms_rad"], before["damping_Nms_rad"]) << "what is empty stays";
  set.mode = set.interaction = none.data();
  stiffness = 1e6;
  call<SetJoint_Response>("set_joint", set, was_set);
  EXPECT_NE(message.find("joint2: the stiffness 1e+06 Nm/rad is beyond"), std::string::npos);

  std::string loop = "position";
  const dds_sequence_double stays{0, 0, nullptr, false};
  call<SetGains_Response>(
      "set_gains",
      SetGains_Request{0, 0, joint.data(), loop.data(), {1, 1, &kp, false}, stays, stays},
      [](const SetGains_Response& reply) { EXPECT_TRUE(reply.success) << reply.message; });
  now = ask_local(R"({"do": "joint.list"})")["joints"][1];
  EXPECT_EQ(now["gains"]["position"]["kp"], 7.5);
  EXPECT_EQ(now["gains"]["position"]["ki"], before["gains"]["position"]["ki"]);
  EXPECT_EQ(end(), 0);
}

/// A parameter's name and value, as ROS 2's tools send it.
struct RosParameter {
  RosParameter(std::string its_name, double number) : name(std::move(its_name)) {
    sample.name = name.data();
    sample.value.type = 3;  // PARAMETER_DOUBLE
    sample.value.double_value = number;
    sample.value.string_value = none.data();
  }
  std::string name, none;
  ::rcl_interfaces_msg_dds__Parameter_ sample{};
};

TEST_F(RunOverDds, ReadAndSetParametersAsThoseOfARosNode) {
  using namespace dds::rcl_interfaces;
  begin_with("local");
  const auto call_node = [&]<class Response, class Request>(
                             const char* name, const Request& request,
                             const std::function<void(const Response&)>& use) {
    auto client = dds::ServiceClient<Request, Response>::create(*participant_,
                                                                std::string("tandem_run/") + name);
    ASSERT_TRUE(client) << client.error().to_string();
    const Status done = client->call(request, std::chrono::seconds(30), use);
    EXPECT_TRUE(done) << done.error().to_string();
  };
  Texts names;
  const auto list = [&](Texts prefixes, std::uint64_t depth) {
    std::vector<char*> pointers;
    for (std::string& one : prefixes) pointers.push_back(one.data());
    const auto count = static_cast<std::uint32_t>(pointers.size());
    names.clear();
    call_node.operator()<ListParameters_Response>(
        "list_parameters",
        ListParameters_Request{0, 0, {count, count, pointers.data(), false}, depth},
        [&](const ListParameters_Response& reply) {
          for (std::uint32_t i = 0; i < reply.result.names._length; ++i)
            names.emplace_back(reply.result.names._buffer[i]);
          if (count == 0 && depth == 0) {
            ASSERT_EQ(reply.result.prefixes._length, 1U);
            EXPECT_STREQ(reply.result.prefixes._buffer[0], "hold");
          }
        });
    return names;
  };
  const Texts all{"hold.interaction", "hold.duration_s", "hold.link_damping_Nms_rad"};
  EXPECT_EQ(list({}, 0), all);
  EXPECT_EQ(list({"hold"}, 0), all);
  EXPECT_EQ(list({"hold"}, 1), all);
  EXPECT_EQ(list({}, 1), Texts{}) << "each has a dot";
  EXPECT_EQ(list({"hold.duration_s"}, 0), Texts{"hold.duration_s"});
  EXPECT_EQ(list({"hol"}, 0), Texts{});

  std::string damping = "hold.link_damping_Nms_rad", nobody = "hold.nobody";
  std::string interaction = "hold.interaction";
  char* asked[]{damping.data(), nobody.data(), interaction.data()};
  const dds_sequence_string three{3, 3, asked, false};
  double value = -1.0;
  const auto get = [&] {
    call_node.operator()<GetParameters_Response>(
        "get_parameters", GetParameters_Request{0, 0, three},
        [&](const GetParameters_Response& reply) {
          ASSERT_EQ(reply.values._length, 3U);
          EXPECT_EQ(reply.values._buffer[0].type, 3);
          EXPECT_EQ(reply.values._buffer[1].type, 0) << "not set";
          EXPECT_EQ(reply.values._buffer[2].type, 4);
          EXPECT_STREQ(reply.values._buffer[2].string_value, "stiff");
          value = reply.values._buffer[0].double_value;
        });
    return value;
  };
  EXPECT_EQ(get(), 0.0);
  call_node.operator()<GetParameterTypes_Response>("get_parameter_types",
                                                   GetParameterTypes_Request{0, 0, three},
                                                   [&](const GetParameterTypes_Response& reply) {
                                                     ASSERT_EQ(reply.types._length, 3U);
                                                     EXPECT_EQ(reply.types._buffer[0], 3);
                                                     EXPECT_EQ(reply.types._buffer[1], 0);
                                                     EXPECT_EQ(reply.types._buffer[2], 4);
                                                   });
  call_node.operator()<DescribeParameters_Response>(
      "describe_parameters", DescribeParameters_Request{0, 0, three},
      [&](const DescribeParameters_Response& reply) {
        ASSERT_EQ(reply.descriptors._length, 3U);
        const auto& first = reply.descriptors._buffer[0];
        EXPECT_STREQ(first.name, damping.c_str());
        EXPECT_FALSE(first.read_only);
        EXPECT_NE(std::string(first.additional_constraints).find("Nms/rad"), std::string::npos);
        ASSERT_EQ(first.floating_point_range._length, 1U);
        EXPECT_EQ(first.floating_point_range._buffer[0].from_value, 0.0);
        EXPECT_TRUE(reply.descriptors._buffer[2].read_only);
        EXPECT_STREQ(reply.descriptors._buffer[2].additional_constraints, "stiff, compliant");
      });

  RosParameter right(damping, 0.75), wrong(damping, -1.0), unknown(nobody, 1.0);
  Texts reasons;
  const auto set = [&](std::vector<::rcl_interfaces_msg_dds__Parameter_> samples) {
    const auto count = static_cast<std::uint32_t>(samples.size());
    reasons.clear();
    call_node.operator()<SetParameters_Response>(
        "set_parameters", SetParameters_Request{0, 0, {count, count, samples.data(), false}},
        [&](const SetParameters_Response& reply) {
          for (std::uint32_t i = 0; i < reply.results._length; ++i) {
            reasons.emplace_back(reply.results._buffer[i].reason);
            EXPECT_EQ(reply.results._buffer[i].successful, reasons.back().empty());
          }
        });
  };
  set({unknown.sample, right.sample});
  ASSERT_EQ(reasons.size(), 2U);
  EXPECT_NE(reasons[0].find("has no such parameter"), std::string::npos) << reasons[0];
  EXPECT_EQ(reasons[1], "") << "each by itself";
  EXPECT_EQ(get(), 0.75);
  const auto set_all = [&](std::vector<::rcl_interfaces_msg_dds__Parameter_> samples) {
    const auto count = static_cast<std::uint32_t>(samples.size());
    std::string reason = "no reply";
    call_node.operator()<SetParametersAtomically_Response>(
        "set_parameters_atomically",
        SetParametersAtomically_Request{0, 0, {count, count, samples.data(), false}},
        [&](const SetParametersAtomically_Response& reply) { reason = reply.result.reason; });
    return reason;
  };
  right.sample.value.double_value = 2.0;
  EXPECT_NE(set_all({right.sample, unknown.sample}), "");
  EXPECT_EQ(get(), 0.75) << "all or none";
  EXPECT_NE(set_all({wrong.sample}).find("is out of range"), std::string::npos);
  EXPECT_EQ(set_all({right.sample}), "");
  EXPECT_EQ(get(), 2.0);
  EXPECT_EQ(end(), 0);
}

/// A list's name and numbers.
struct RosList : RosParameter {
  RosList(std::string its_name, std::vector<double> its_numbers)
      : RosParameter(std::move(its_name), 0.0), numbers(std::move(its_numbers)) {
    sample.value.type = 8;  // PARAMETER_DOUBLE_ARRAY
    const auto count = static_cast<std::uint32_t>(numbers.size());
    sample.value.double_array_value = {count, count, numbers.data(), false};
  }
  std::vector<double> numbers;
};

TEST_F(RunOverDds, HaveParametersByJointAsDoubleArraysAndTellOfTheirChanges) {
  using namespace dds::rcl_interfaces;
  using Values = std::vector<double>;
  begin_with("local");
  auto events = dds::Reader<ParameterEvent>::create(
      *participant_, "rt/parameter_events",
      {.reliable = true, .transient_local = false, .depth = 1000, .user_data = {}});
  ASSERT_TRUE(events);
  ASSERT_TRUE(eventually([&] { return events->endpoint().matched() == 1; }));
  std::string told;  // of "weigh"
  const auto tells = [&](const std::string& what) {
    return eventually([&] {
      events->take([&](const ParameterEvent& event, const auto&) {
        EXPECT_STREQ(event.node, "/tandem_run");
        const auto add = [&](const char* sign, const auto& all) {
          for (std::uint32_t i = 0; i < all._length; ++i)
            told += sign + std::string(all._buffer[i].name) + " ";
        };
        add("+", event.new_parameters);
        add("~", event.changed_parameters);
        add("-", event.deleted_parameters);
      });
      return told.find(what) != std::string::npos;
    });
  };
  ASSERT_EQ(to_run("controller load gravity_compensation --name weigh").status, 0);
  EXPECT_TRUE(tells("+weigh.damping_Nms_rad ")) << told;

  std::string damping = "weigh.damping_Nms_rad";
  char* asked[]{damping.data()};
  const dds_sequence_string one{1, 1, asked, false};
  const auto call_node = [&]<class Response, class Request>(
                             const char* name, const Request& request,
                             const std::function<void(const Response&)>& use) {
    auto client = dds::ServiceClient<Request, Response>::create(*participant_,
                                                                std::string("tandem_run/") + name);
    ASSERT_TRUE(client);
    const Status done = client->call(request, std::chrono::seconds(30), use);
    EXPECT_TRUE(done) << done.error().to_string();
  };
  const auto get = [&] {
    Values values;
    call_node.operator()<GetParameters_Response>(
        "get_parameters", GetParameters_Request{0, 0, one},
        [&](const GetParameters_Response& reply) {
          ASSERT_EQ(reply.values._length, 1U);
          EXPECT_EQ(reply.values._buffer[0].type, 8);
          const auto& list = reply.values._buffer[0].double_array_value;
          values.assign(list._buffer, list._buffer + list._length);
        });
    return values;
  };
  EXPECT_EQ(get(), Values({0.1, 0.1}));
  call_node.operator()<GetParameterTypes_Response>(
      "get_parameter_types", GetParameterTypes_Request{0, 0, one},
      [&](const GetParameterTypes_Response& reply) { EXPECT_EQ(reply.types._buffer[0], 8); });
  call_node.operator()<DescribeParameters_Response>(
      "describe_parameters", DescribeParameters_Request{0, 0, one},
      [&](const DescribeParameters_Response& reply) {
        ASSERT_EQ(reply.descriptors._length, 1U);
        const auto& it = reply.descriptors._buffer[0];
        EXPECT_EQ(it.type, 8);
        EXPECT_FALSE(it.read_only);
        EXPECT_STREQ(it.additional_constraints, "Nms/rad, joint1, joint2");
        ASSERT_EQ(it.floating_point_range._length, 1U);
        EXPECT_EQ(it.floating_point_range._buffer[0].from_value, 0.0);
      });

  const auto set = [&](std::vector<::rcl_interfaces_msg_dds__Parameter_> samples) {
    const auto count = static_cast<std::uint32_t>(samples.size());
    Texts reasons;
    call_node.operator()<SetParameters_Response>(
        "set_parameters", SetParameters_Request{0, 0, {count, count, samples.data(), false}},
        [&](const SetParameters_Response& reply) {
          for (std::uint32_t i = 0; i < reply.results._length; ++i) {
            reasons.emplace_back(reply.results._buffer[i].reason);
            EXPECT_EQ(reply.results._buffer[i].successful, reasons.back().empty());
          }
        });
    return reasons;
  };
  RosList both(damping, {0.2, 0.15}), short_one(damping, {0.2}), wrong(damping, {0.2, -1.0});
  EXPECT_EQ(set({both.sample}), Texts{""});
  EXPECT_EQ(get(), Values({0.2, 0.15}));
  EXPECT_TRUE(tells("~weigh.damping_Nms_rad ")) << told;
  EXPECT_NE(set({short_one.sample}).at(0).find("has 2 elements, not 1"), std::string::npos);
  EXPECT_NE(set({wrong.sample}).at(0).find("weigh.damping_Nms_rad.joint2: -1 is out of range"),
            std::string::npos);
  std::vector<std::int64_t> whole{0, 0};
  RosList integers(damping, {});
  integers.sample.value.type = 7;  // PARAMETER_INTEGER_ARRAY, as of `ros2 param set … "[0, 0]"`
  integers.sample.value.integer_array_value = {2, 2, whole.data(), false};
  EXPECT_EQ(set({integers.sample}), Texts{""});
  EXPECT_EQ(get(), Values({0, 0}));
  RosParameter element(damping + ".joint2", 0.125), all(damping, 0.25);
  EXPECT_EQ(set({all.sample, element.sample}), Texts({"", ""}));
  EXPECT_EQ(get(), Values({0.25, 0.125}));

  const Texts many = set(std::vector(10'000, all.sample));
  ASSERT_EQ(many.size(), 10'000U) << "an answer for each, as a client expects it";
  EXPECT_NE(many.front().find("sets "), std::string::npos) << many.front();
  EXPECT_EQ(many.back(), many.front());
  EXPECT_EQ(get(), Values({0.25, 0.125}));
  ASSERT_EQ(to_run("controller unload weigh").status, 0);
  EXPECT_TRUE(tells("-weigh.damping_Nms_rad ")) << told;
  EXPECT_EQ(end(), 0);
}

TEST_F(RunOverDds, SetNoParametersUnlessTheExperimentAllowsIt) {
  using namespace dds::rcl_interfaces;
  begin_with("");
  RosParameter damping("hold.link_damping_Nms_rad", 0.75);
  auto client = dds::ServiceClient<SetParameters_Request, SetParameters_Response>::create(
      *participant_, "tandem_run/set_parameters");
  ASSERT_TRUE(client);
  std::string reason;
  ASSERT_TRUE(client->call(SetParameters_Request{0, 0, {1, 1, &damping.sample, false}},
                           std::chrono::seconds(30), [&](const SetParameters_Response& reply) {
                             ASSERT_EQ(reply.results._length, 1U);
                             EXPECT_FALSE(reply.results._buffer[0].successful);
                             reason = reply.results._buffer[0].reason;
                           }));
  EXPECT_NE(reason.find("takes no commands over DDS"), std::string::npos) << reason;
  EXPECT_EQ(end(), 0);
}

TEST_F(RunOverDds, PauseStepAndScaleTime) {
  begin_with("local");
  Clock_Response last{};
  std::string message;
  const auto clock = [&](std::string action, std::uint64_t cycles, double rate) {
    call<Clock_Response>("clock", Clock_Request{0, 0, action.data(), cycles, rate},
                         [&](const Clock_Response& reply) {
                           last = reply;  // its text is gone after this
                           message = reply.message;
                         });
    return last.success;
  };
  EXPECT_TRUE(clock("rate", 0, 50.0));
  EXPECT_EQ(last.rate, 50.0);
  EXPECT_FALSE(clock("step", 3, 0.0)) << "time is running";
  EXPECT_NE(message, "");
  EXPECT_TRUE(clock("pause", 0, 0.0));
  EXPECT_TRUE(eventually([&] { return clock("show", 0, 0.0) && last.standing; }));
  const Clock_Response before = last;
  EXPECT_TRUE(clock("step", 3, 0.0));
  EXPECT_TRUE(eventually([&] { return clock("", 0, 0.0) && last.standing; }));
  EXPECT_EQ(last.cycles, before.cycles + 3);
  EXPECT_NEAR(last.time_s, before.time_s + 0.003, 1e-9);
  EXPECT_TRUE(last.paused);
  const auto local = ask_local(R"({"do": "clock.show"})");
  EXPECT_EQ(last.time_s, local["time_s"]);
  EXPECT_EQ(last.cycles, local["cycles"]);
  EXPECT_EQ(trigger("emergency_stop").find("yes: emergency stop, category 1, in the next cycle"),
            0U);
  EXPECT_FALSE(clock("rewind", 0, 0.0));
  EXPECT_NE(message.find("by_s"), std::string::npos) << message;
  EXPECT_TRUE(clock("resume", 0, 0.0));
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1);
}

TEST_F(RunOverDds, StopTheRobotAndClearItsFaults) {
  begin_with("local");
  EXPECT_EQ(trigger("clear_faults"), "yes: nothing is latched");
  EXPECT_EQ(ask(R"({"do": "estop", "category": 0})")["category"], "category0");
  until(R"("phase": "faulted")");
  EXPECT_NE(trigger("clear_faults").find("yes: the reset of 1 is asked for"), std::string::npos);
  EXPECT_TRUE(eventually([&] { return ask(R"({"do": "status"})").value("resets", 0) == 1; }));
  until(R"("phase": "held")");
  EXPECT_EQ(trigger("start_controllers"), "yes: active: hold");
  until(R"("phase": "running")");
  EXPECT_NE(trigger("start_controllers").find("no: no controllers are held back"),
            std::string::npos);
  EXPECT_EQ(end(), 0);
}

TEST_F(RunOverDds, SayThatAStopIsNotConfirmedByALoopThatHangs) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"" TANDEM_BINARY_DIR
       "/tests/test_plugins/hangs.so\"\n"
       "[faults]\nwatchdog_s = 4.0");
  start("--dds --domain " + std::to_string(dds::test::own_domain()));
  until(R"("running_cycles": 99)");
  EXPECT_EQ(trigger("emergency_stop").find("no: the emergency stop is latched, but not confirmed"),
            0U);
  EXPECT_EQ(join(), 1) << "the watchdog ends it";
}

/// The commands' other way to a run.
class DdsCommands : public RunOverDds {
 protected:
  [[nodiscard]] Outcome over_dds(const std::string& command) const {
    return tandem(command + " --dds --domain " + std::to_string(dds::test::own_domain()));
  }
  void expect_same(const std::string& command, const std::string& part) const {
    const Outcome here = to_run(command), there = over_dds(command);
    EXPECT_EQ(there.status, here.status) << there.err;
    // Times of controllers have gone on meanwhile.
    const std::regex times("[0-9]+\\.[0-9]+ *");  // with the blanks that their width leaves
    EXPECT_EQ(std::regex_replace(there.out, times, "t"), std::regex_replace(here.out, times, "t"));
    EXPECT_EQ(there.err, here.err);
    EXPECT_NE((there.out + there.err).find(part), std::string::npos) << there.out << there.err;
  }
};

TEST_F(DdsCommands, AreAnsweredAsOverTheSocket) {
  begin_with("local");
  expect_same("ask '{\"do\": \"help\"}'", "controller.load");
  expect_same("ask '{\"do\": \"hlep\"}'", "did you mean 'help'?");
  expect_same("controller list", "hold        active    joint1, joint2");
  expect_same("controller start rest", "rest");
  expect_same("joint set jiont2 --mode idle", "did you mean 'joint2'?");
  expect_same("joint list --gains", "joint2");
  expect_same("joint reset joint1", "joint1: its drive has no fault");
  expect_same("joint reset jiont1", "did you mean 'joint1'?");
  expect_same("joint home joint1", "joint1: has no homing: its encoder is taken for absolute");
  expect_same("sensor list", "the robot has no sensors");
  EXPECT_NE(over_dds("joint show joint2").out.find("operation enabled"), std::string::npos);
  expect_same("fault reset", "nothing is latched");
  EXPECT_EQ(over_dds("clock rate 50").status, 0);
  EXPECT_NE(over_dds("clock pause").out.find("paused"), std::string::npos);
  expect_same("clock show", "50 x real time");
  EXPECT_EQ(over_dds("clock step 5").status, 0);
  EXPECT_EQ(over_dds("clock resume").status, 0);
  EXPECT_EQ(over_dds("inject kind=supply_sag board=board1 volts=10").status, 2) << "no such board";
  const std::string stop = over_dds("estop --trust-domain --category 0").out;
  EXPECT_TRUE(stop.starts_with("tandem_run (process ")) << stop;
  EXPECT_TRUE(stop.ends_with("): emergency stop, category 0\n")) << stop;
  until(R"("phase": "faulted")");
  const Outcome reset = over_dds("fault reset");
  EXPECT_EQ(reset.status, 0) << reset.err;
  EXPECT_NE(reset.out.find("every joint is enabled where it is"), std::string::npos) << reset.out;
  EXPECT_EQ(over_dds("ask '{\"do\": \"run.stop\"}'").status, 0);
  run_.join();
  EXPECT_EQ(status_, 0);
}

TEST_F(DdsCommands, SayWhatIsNotAllowedAndWhatWouldAllowIt) {
  begin_with("");
  EXPECT_EQ(over_dds("controller list").status, 0);
  for (const char* command : {"controller stop hold", "joint set joint1 --stiffness 1",
                              "clock pause", "fault reset", "ask '{\"do\": \"run.stop\"}'"}) {
    const Outcome refused = over_dds(command);
    EXPECT_EQ(refused.status, 2) << command;
    EXPECT_NE(refused.err.find("takes no commands over DDS"), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("[remote] command = \"local\""), std::string::npos) << refused.err;
  }
  EXPECT_EQ(to_run("controller stop hold").status, 0) << "the local operator may";
  EXPECT_EQ(over_dds("estop --trust-domain").status, 0);
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1);
}

/// A process that hangs holds up everything that waits for its admission; a stop must not.
TEST_F(DdsCommands, AStopAsksNobodyForAdmission) {
  begin_with("local");
  std::string runtime = "/tmp/tandem_admission_XXXXXX";
  ASSERT_NE(::mkdtemp(runtime.data()), nullptr);
  ASSERT_EQ(::mkdir((runtime + "/tandem").c_str(), 0700), 0);
  // Socket of a silent run, bound by a relative path, which the kernel's table shows: so the
  // commands of tests that run beside this one, which search all of it, do not ask it.
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::string("run-1.sock").copy(address.sun_path, sizeof address.sun_path - 1);
  const int silent = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0);
  const std::filesystem::path here = std::filesystem::current_path();
  std::filesystem::current_path(runtime + "/tandem");
  ASSERT_EQ(::bind(silent, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  std::filesystem::current_path(here);
  ASSERT_EQ(::listen(silent, 8), 0);
  const auto asked = [silent] {
    const int client = ::accept(silent, nullptr, nullptr);
    if (client >= 0) ::close(client);
    return client >= 0;
  };
  const std::string there = " --dds --domain " + std::to_string(dds::test::own_domain());
  const std::string environment = "TANDEM_SOCKETS=" + runtime + "/tandem";
  EXPECT_EQ(tandem("estop --trust-domain" + there, environment).status, 0);
  EXPECT_FALSE(asked());
  EXPECT_EQ(tandem("clock show" + there, environment).status, 0);
  EXPECT_TRUE(asked());
  ::close(silent);
  std::filesystem::remove_all(runtime);
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1);
}

/// Another process' services, in this one.
struct SecondRun {
  explicit SecondRun(dds::Participant& participant) {
    registry.add(
        {"estop",
         ControlEffect::kStops,
         "stops",
         {{.name = "category", .type = ControlKey::Type::kInteger, .doc = "0 to 2"}}},
        [this](const Json& request) -> Result<Json> {
          ++stops;
          if (refuses) return fail("its loop hangs", "press its emergency stop");
          return Json{{"category", fmt::format("category{}", request.value("category", 1))}};
        });
    auto opened = DdsServices::open(participant, registry, {}, admission);
    EXPECT_TRUE(opened) << opened.error().to_string();
    if (opened) services = std::move(*opened);
  }
  std::atomic<int> stops = 0;
  std::atomic<bool> refuses = false;
  ControlRegistry registry;
  DdsAdmission admission{true};
  std::unique_ptr<DdsServices> services;
};

// "2 processes serve tandem/ask (say which …)": nobody was stopped.
TEST_F(DdsCommands, AStopIsForAllOfSeveralRuns) {
  begin_with("");
  SecondRun second(*participant_);
  const Outcome stop = over_dds("estop --trust-domain --category 0");
  EXPECT_EQ(stop.status, 0) << stop.err;
  EXPECT_NE(stop.out.find("tandem_run (process "), std::string::npos) << stop.out;
  EXPECT_NE(stop.out.find("tester (process " + std::to_string(::getpid()) +
                          "): emergency stop, category 0\n"),
            std::string::npos)
      << stop.out;
  EXPECT_EQ(second.stops, 1);
  until(R"("phase": "faulted")");
  second.refuses = true;
  const Outcome partly = over_dds("estop --trust-domain");
  EXPECT_EQ(partly.status, 1) << "one has not confirmed";
  EXPECT_NE(partly.err.find("its loop hangs"), std::string::npos) << partly.err;
  EXPECT_EQ(end(), 1);
}

TEST_F(DdsCommands, AStopIsForAllOfSeveralNamespaces) {
  write_text(folder_ / "hold.toml",
             read_text(folder_ / "hold.toml") + "[dds]\nnamespace = \"left\"\n");
  begin_with("");
  SecondRun second(*participant_);
  const Outcome one = over_dds("estop --trust-domain --namespace ''");
  EXPECT_EQ(second.stops, 1) << one.err;
  EXPECT_EQ(one.out.find("left"), std::string::npos) << one.out;
  const Outcome stop = over_dds("estop --trust-domain");
  EXPECT_EQ(stop.status, 0) << stop.err;
  EXPECT_NE(stop.out.find("tandem_run in the namespace 'left' (process "), std::string::npos)
      << stop.out;
  EXPECT_EQ(second.stops, 2);
  until(R"("phase": "faulted")");
  EXPECT_EQ(end(), 1);
}

TEST_F(DdsCommands, AStopThatReachesNobodySaysWhatToDo) {
  const Outcome stop = over_dds("estop");
  EXPECT_EQ(stop.status, 1);
  EXPECT_NE(stop.err.find("press its emergency stop or cut its power"), std::string::npos)
      << stop.err;
  EXPECT_EQ(stop.err.find("start one"), std::string::npos) << stop.err;
}

TEST_F(DdsCommands, AreForOneOfSeveralRuns) {
  const Outcome none = over_dds("controller list");
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("no process serves tandem/ask in the DDS domain"), std::string::npos)
      << none.err;
  EXPECT_NE(none.err.find("--dds"), std::string::npos) << none.err;
  write_text(folder_ / "hold.toml",
             read_text(folder_ / "hold.toml") + "[dds]\nnamespace = \"left\"\n");
  begin_with("");
  EXPECT_EQ(over_dds("controller list").status, 0) << "the only one, whatever its namespace";
  // A second one: the services of a registry in this process.
  ControlRegistry registry;
  const DdsAdmission admission(true);
  const auto second = apps::DdsServices::open(*participant_, registry, {}, admission);
  ASSERT_TRUE(second) << second.error().to_string();
  const Outcome several = over_dds("controller list");
  EXPECT_EQ(several.status, 2);
  for (const char* part : {"2 processes serve tandem/ask", "--namespace 'left' is tandem_run",
                           "--namespace '' is tester"}) {
    EXPECT_NE(several.err.find(part), std::string::npos) << part << " in: " << several.err;
  }
  EXPECT_EQ(over_dds("controller list --namespace left").status, 0);
  EXPECT_EQ(over_dds("ask '{\"do\": \"status\"}' --namespace right").status, 2);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
