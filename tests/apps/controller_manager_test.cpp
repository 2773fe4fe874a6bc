// The services "controller_manager/…" of a run, asked by Fast DDS and by Cyclone DDS, each by the
// mapping of its ROS 2 middleware.
#include <functional>

#include "dds/service_client.hpp"
#include "dds/service_layout.hpp"
#include "tests/apps/running.hpp"
#include "tests/dds/fastdds_caller.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::apps {
namespace {

namespace cm = dds::controller_manager_msgs;  // some names are tandem_msgs', too
using dds::test::Members;
using dds::test::Octets;
using dds::test::Reply;
using Texts = std::vector<std::string>;

const Octets kEmptyRequest{0, 1, 0, 0, 0};
constexpr std::int32_t kBestEffort = 1, kStrict = 2, kAuto = 3, kForceAuto = 4;

/// Every service, in the order of its index here.
enum Service : int {
  kListControllers,
  kListTypes,
  kLoad,
  kConfigure,
  kSwitch,
  kUnload,
  kCleanup,
  kReload,
  kListComponents,
  kListInterfaces,
  kSetState,
  kServices
};
const Texts kManagerServices{"/controller_manager/list_controllers",
                             "controller_manager_msgs/srv/ListControllers",
                             "/controller_manager/list_controller_types",
                             "controller_manager_msgs/srv/ListControllerTypes",
                             "/controller_manager/load_controller",
                             "controller_manager_msgs/srv/LoadController",
                             "/controller_manager/configure_controller",
                             "controller_manager_msgs/srv/ConfigureController",
                             "/controller_manager/switch_controller",
                             "controller_manager_msgs/srv/SwitchController",
                             "/controller_manager/unload_controller",
                             "controller_manager_msgs/srv/UnloadController",
                             "/controller_manager/cleanup_controller",
                             "controller_manager_msgs/srv/CleanupController",
                             "/controller_manager/reload_controller_libraries",
                             "controller_manager_msgs/srv/ReloadControllerLibraries",
                             "/controller_manager/list_hardware_components",
                             "controller_manager_msgs/srv/ListHardwareComponents",
                             "/controller_manager/list_hardware_interfaces",
                             "controller_manager_msgs/srv/ListHardwareInterfaces",
                             "/controller_manager/set_hardware_component_state",
                             "controller_manager_msgs/srv/SetHardwareComponentState"};

/// A run in this program's domain.
class ManagedRun : public Running {
 protected:
  /// @param remote  lines of [remote]; empty: nobody may change anything
  void begin_with(const std::string& remote) {
    if (!remote.empty())
      write_text(folder_ / "hold.toml", read_text(folder_ / "hold.toml") + "[remote]\n" + remote);
    begin("--on-fault wait --dds --domain " + std::to_string(dds::test::own_domain()));
  }
};

/// Asked as by rmw_fastrtps_cpp.
class ManagedByFastDds : public ManagedRun {
 protected:
  void SetUp() override {
    if (!dds::test::have_fastdds_caller()) GTEST_SKIP() << dds::test::kNoFastDds;
    if (!dds::answers_fast_dds()) GTEST_SKIP() << "built for another version of Cyclone DDS";
    Running::SetUp();
  }
  void connect() {
    caller_ = std::make_unique<dds::test::FastDdsCaller>(kManagerServices);
    for (int i = 0; i < kServices; ++i) ASSERT_TRUE(caller_->ready(i)) << i;
  }
  template <class Response>
  Reply<Response> ask(Service service, const Octets& request) {
    return Reply<Response>(caller_->call(service, request));
  }
  /// Services that take a name and say `ok`.
  template <class Response>
  bool named(Service service, const std::string& name) {
    return ask<Response>(service, Members().text(name)).yes("ok");
  }
  /// "yes: MESSAGE"
  std::string change(const Texts& start, const Texts& stop, std::int32_t strictness) {
    const auto reply = ask<cm::SwitchController_Response>(kSwitch, Members()
                                                                       .texts(start)
                                                                       .texts(stop)
                                                                       .number(strictness)
                                                                       .number(std::uint8_t{1})
                                                                       .number(std::int32_t{5})
                                                                       .number(std::uint32_t{0}));
    return (reply.yes("ok") ? "yes: " : "no: ") + reply.text("message");
  }
  /// "hold: active, …" of the controllers that have a library.
  std::string states() {
    const auto listed = ask<cm::ListControllers_Response>(kListControllers, kEmptyRequest);
    std::string all;
    for (std::size_t i = 0; i < listed.size("controller"); ++i) {
      const std::string at = "controller." + std::to_string(i);
      if (listed.text(at + ".type") == "remote") continue;
      all +=
          (all.empty() ? "" : ", ") + listed.text(at + ".name") + ": " + listed.text(at + ".state");
    }
    return all;
  }
  /// "yes 3 active"
  std::string set_state(const std::string& name, std::uint8_t id, const std::string& label) {
    const auto reply = ask<cm::SetHardwareComponentState_Response>(
        kSetState, Members().text(name).number(id).text(label));
    return std::string(reply.yes("ok") ? "yes " : "no ") +
           std::to_string(reply.at<std::uint64_t>("state.id")) + " " + reply.text("state.label");
  }

  std::unique_ptr<dds::test::FastDdsCaller> caller_;
};

TEST_F(ManagedByFastDds, ListsWhatThereIs) {
  begin_with("");
  connect();
  const auto listed = ask<cm::ListControllers_Response>(kListControllers, kEmptyRequest);
  EXPECT_EQ(listed.text("controller.0.name"), "hold");
  EXPECT_EQ(listed.text("controller.0.state"), "active");
  EXPECT_EQ(listed.text("controller.0.type"), "hold");
  EXPECT_EQ(listed.at<std::uint64_t>("controller.0.update_rate"), 1000U);
  EXPECT_FALSE(listed.yes("controller.0.is_async"));
  for (const char* list :
       {"controller.0.claimed_interfaces.", "controller.0.required_command_interfaces."}) {
    EXPECT_EQ(listed.text(std::string(list) + "0"), "joint1/position");
    EXPECT_EQ(listed.text(std::string(list) + "1"), "joint2/position");
  }
  EXPECT_EQ(listed.size("controller.0.required_state_interfaces"), 0U);

  const auto types = ask<cm::ListControllerTypes_Response>(kListTypes, kEmptyRequest);
  Texts names;
  for (std::size_t i = 0; i < types.size("types"); ++i)
    names.push_back(types.text("types." + std::to_string(i)));
  EXPECT_EQ(types.size("base_classes"), names.size());
  EXPECT_NE(std::ranges::find(names, "trajectory_follower"), names.end());

  const auto interfaces = ask<cm::ListHardwareInterfaces_Response>(kListInterfaces, kEmptyRequest);
  const auto state_of = [&](const std::string& list, const std::string& name) {
    for (std::size_t i = 0; i < interfaces.size(list); ++i) {
      const std::string at = list + "." + std::to_string(i);
      if (interfaces.text(at + ".name") != name) continue;
      EXPECT_EQ(interfaces.text(at + ".data_type"), "double");
      return std::string(interfaces.yes(at + ".is_available") ? "available" : "not available") +
             (interfaces.yes(at + ".is_claimed") ? ", claimed" : "");
    }
    return std::string("none");
  };
  EXPECT_EQ(state_of("command_interfaces", "joint1/position"), "available, claimed");
  EXPECT_EQ(state_of("command_interfaces", "joint1/velocity"), "available");
  EXPECT_EQ(state_of("command_interfaces", "joint2/effort"), "available");
  EXPECT_EQ(state_of("command_interfaces", "joint1/idle"), "none");
  EXPECT_EQ(state_of("state_interfaces", "joint2/position"), "available");
  EXPECT_EQ(state_of("state_interfaces", "joint2/effort"), "available");

  const auto components = ask<cm::ListHardwareComponents_Response>(kListComponents, kEmptyRequest);
  ASSERT_EQ(components.size("component"), 1U) << "a robot without sensors";
  EXPECT_EQ(components.text("component.0.type"), "system");
  EXPECT_EQ(components.text("component.0.plugin_name"), "tandem/sim");
  EXPECT_EQ(components.text("component.0.state.label"), "active");
  EXPECT_EQ(components.at<std::uint64_t>("component.0.rw_rate"), 1000U);
  EXPECT_EQ(components.size("component.0.command_interfaces"),
            interfaces.size("command_interfaces"));
  EXPECT_EQ(components.size("component.0.state_interfaces"), interfaces.size("state_interfaces"));
  const std::string robot = components.text("component.0.name");
  EXPECT_EQ(set_state(robot, 3, "active"), "yes 3 active");
  EXPECT_EQ(set_state(robot, 0, "active"), "yes 3 active") << "by its label";
  EXPECT_EQ(set_state(robot, 2, "inactive"), "no 3 active") << "it cannot be led there";
  EXPECT_EQ(set_state("nobody", 3, "active"), "no 0 unknown");
  EXPECT_EQ(end(), 0);
}

TEST_F(ManagedByFastDds, LoadsSwitchesAndUnloadsControllers) {
  begin_with("command = \"local\"\ntrust = \"domain\"\nload = true\n");
  connect();
  const std::string weigh = "gravity_compensation";
  EXPECT_FALSE(named<cm::ConfigureController_Response>(kConfigure, weigh)) << "it is not loaded";
  EXPECT_TRUE(named<cm::LoadController_Response>(kLoad, weigh));
  EXPECT_FALSE(named<cm::LoadController_Response>(kLoad, weigh)) << "its name is taken";
  EXPECT_TRUE(named<cm::ConfigureController_Response>(kConfigure, weigh)) << "it is since its load";
  EXPECT_FALSE(named<cm::ConfigureController_Response>(kConfigure, "hold")) << "it is active";
  EXPECT_FALSE(named<cm::CleanupController_Response>(kCleanup, weigh));
  EXPECT_FALSE(
      ask<cm::ReloadControllerLibraries_Response>(kReload, Members().number(std::uint8_t{1}))
          .yes("ok"))
      << "some are loaded";
  EXPECT_EQ(states(), "hold: active, " + weigh + ": inactive");

  EXPECT_NE(change({weigh}, {}, kStrict).find("no: "), std::string::npos) << "of the same joints";
  EXPECT_NE(change({weigh}, {"hold", "nobody"}, 0).find("nobody"), std::string::npos)
      << "all or none without a strictness, too";
  EXPECT_NE(change({weigh}, {"hold"}, 7).find("no: "), std::string::npos) << "no such strictness";
  EXPECT_NE(change({weigh}, {"hold"}, -1).find("no: "), std::string::npos);
  EXPECT_NE(change({"nobody"}, {}, kBestEffort).find("no: "), std::string::npos);
  EXPECT_EQ(states(), "hold: active, " + weigh + ": inactive");

  const std::string partly = change({weigh, "nobody"}, {weigh, "nobody"}, kBestEffort);
  EXPECT_NE(partly.find("yes: left out: "), std::string::npos) << partly;
  EXPECT_NE(partly.find("nobody is not loaded"), std::string::npos) << partly;
  EXPECT_EQ(change({"hold"}, {}, kBestEffort), "yes: left out: hold is active");
  EXPECT_EQ(change({weigh}, {"hold"}, kStrict), "yes: active: " + weigh);
  EXPECT_EQ(states(), "hold: inactive, " + weigh + ": active");
  EXPECT_EQ(change({"hold"}, {}, kForceAuto), "yes: active: hold");
  EXPECT_EQ(change({weigh}, {"hold"}, kAuto), "yes: active: " + weigh);
  EXPECT_FALSE(named<cm::UnloadController_Response>(kUnload, weigh)) << "it is active";
  EXPECT_EQ(change({}, {weigh}, kStrict), "yes: active:");
  EXPECT_TRUE(named<cm::UnloadController_Response>(kUnload, weigh));
  EXPECT_FALSE(named<cm::UnloadController_Response>(kUnload, weigh));
  EXPECT_TRUE(named<cm::UnloadController_Response>(kUnload, "hold"));
  EXPECT_TRUE(
      ask<cm::ReloadControllerLibraries_Response>(kReload, Members().number(std::uint8_t{0}))
          .yes("ok"))
      << "none is loaded";
  EXPECT_EQ(states(), "");
  EXPECT_EQ(end(), 0);
}

TEST_F(ManagedByFastDds, RefusesWrongNamesAndLongLists) {
  begin_with("command = \"local\"\ntrust = \"domain\"\nload = true\n");
  connect();
  for (const std::string& name : {std::string(), std::string("../hold"), std::string("/tmp/x.so"),
                                  std::string("a\xff"), std::string(100'000, 'x')}) {
    const std::string shown = name.substr(0, 20);
    EXPECT_FALSE(named<cm::LoadController_Response>(kLoad, name)) << shown;
    EXPECT_FALSE(named<cm::UnloadController_Response>(kUnload, name)) << shown;
    EXPECT_FALSE(named<cm::ConfigureController_Response>(kConfigure, name)) << shown;
    EXPECT_FALSE(named<cm::CleanupController_Response>(kCleanup, name)) << shown;
    EXPECT_EQ(set_state(name, 3, "active"), "no 0 unknown") << shown;
    EXPECT_NE(change({name}, {}, kStrict).find("no: "), std::string::npos) << shown;
    EXPECT_NE(change({}, {name}, kBestEffort).find("no: "), std::string::npos) << shown;
  }
  const Texts same(10'000, "hold");
  Texts others;
  for (int i = 0; i < 10'000; ++i) others.push_back("controller_" + std::to_string(i));
  EXPECT_NE(change({}, same, kStrict).find("no: "), std::string::npos) << "named twice";
  EXPECT_NE(change(others, {}, kStrict).find("no: "), std::string::npos);
  EXPECT_NE(change(others, {}, kForceAuto).find("no: "), std::string::npos);
  EXPECT_NE(change(others, others, kBestEffort).find("no: "), std::string::npos);
  EXPECT_EQ(states(), "hold: active");
  others.push_back("hold");
  const std::string partly = change({}, others, kBestEffort);
  EXPECT_NE(partly.find("yes: left out: controller_0 is not loaded"), std::string::npos)
      << partly.substr(0, 200);
  EXPECT_NE(partly.find("and 9992 others"), std::string::npos) << partly.substr(0, 500);
  EXPECT_EQ(change({}, same, kBestEffort), "yes: left out: hold is not active");
  EXPECT_EQ(states(), "hold: inactive");
  EXPECT_EQ(end(), 0);
}

TEST_F(ManagedByFastDds, ChangesNothingWithoutPermission) {
  begin_with("");
  connect();
  const std::string refused = change({}, {"hold"}, kStrict);
  EXPECT_NE(refused.find("no: "), std::string::npos) << refused;
  EXPECT_NE(refused.find("takes no commands over DDS"), std::string::npos) << refused;
  EXPECT_FALSE(named<cm::LoadController_Response>(kLoad, "jog"));
  EXPECT_FALSE(named<cm::UnloadController_Response>(kUnload, "hold"));
  EXPECT_EQ(states(), "hold: active");
  EXPECT_EQ(end(), 0);
}

TEST_F(ManagedByFastDds, LoadsNoCodeUnlessAskedFor) {
  begin_with("command = \"local\"\ntrust = \"domain\"\n");
  connect();
  EXPECT_FALSE(named<cm::LoadController_Response>(kLoad, "gravity_compensation"));
  EXPECT_EQ(states(), "hold: active");
  EXPECT_EQ(change({}, {"hold"}, kStrict), "yes: active:") << "but it switches";
  EXPECT_EQ(end(), 0);
}

/// Asked as by rmw_cyclonedds_cpp.
class ManagedByCyclone : public ManagedRun {
 protected:
  void SetUp() override {
    Running::SetUp();
    auto domain = dds::Domain::open(dds::test::own_config());
    ASSERT_TRUE(domain) << domain.error().to_string();
    auto joined = dds::Participant::open(std::move(*domain), "tester");
    ASSERT_TRUE(joined) << joined.error().to_string();
    participant_ = std::move(*joined);
  }
  template <class Response, class Request>
  void call(const std::string& name, const Request& request,
            const std::function<void(const Response&)>& use) {
    auto client =
        dds::ServiceClient<Request, Response>::create(*participant_, "controller_manager/" + name);
    ASSERT_TRUE(client) << client.error().to_string();
    const Status done = client->call(request, std::chrono::seconds(30), use);
    EXPECT_TRUE(done) << done.error().to_string();
  }
  template <class Response, class Request>
  bool named(const std::string& service, std::string name) {
    bool ok = false;
    Request request{};
    request.name = name.data();
    call<Response>(service, request, [&ok](const Response& reply) { ok = reply.ok; });
    return ok;
  }
  std::string change(std::string start, std::string stop, std::int32_t strictness) {
    char* starts[]{start.data()};
    char* stops[]{stop.data()};
    cm::SwitchController_Request request{};
    request.activate_controllers = {1, start.empty() ? 0U : 1U, starts, false};
    request.deactivate_controllers = {1, stop.empty() ? 0U : 1U, stops, false};
    request.strictness = strictness;
    std::string answer;
    call<cm::SwitchController_Response>(
        "switch_controller", request, [&answer](const cm::SwitchController_Response& reply) {
          answer = (reply.ok ? "yes: " : "no: ") + std::string(reply.message);
        });
    return answer;
  }

  std::unique_ptr<dds::Participant> participant_;
};

TEST_F(ManagedByCyclone, AnswersEveryService) {
  begin_with("command = \"local\"\ntrust = \"domain\"\nload = true\n");
  const std::string weigh = "gravity_compensation";
  const auto load =
      &ManagedByCyclone::named<cm::LoadController_Response, cm::LoadController_Request>;
  const auto unload =
      &ManagedByCyclone::named<cm::UnloadController_Response, cm::UnloadController_Request>;
  EXPECT_TRUE((this->*load)("load_controller", weigh));
  EXPECT_FALSE((this->*load)("load_controller", "nobody"));
  EXPECT_TRUE((named<cm::ConfigureController_Response, cm::ConfigureController_Request>(
      "configure_controller", weigh)));
  EXPECT_FALSE((named<cm::CleanupController_Response, cm::CleanupController_Request>(
      "cleanup_controller", weigh)));
  EXPECT_EQ(change(weigh, "hold", kStrict), "yes: active: " + weigh);
  call<cm::ListControllers_Response>(
      "list_controllers", cm::ListControllers_Request{},
      [&](const cm::ListControllers_Response& reply) {
        ASSERT_GE(reply.controller._length, 2U);
        const auto& last = reply.controller._buffer[reply.controller._length - 1];
        EXPECT_STREQ(reply.controller._buffer[0].state, "inactive");
        EXPECT_EQ(reply.controller._buffer[0].claimed_interfaces._length, 0U);
        EXPECT_EQ(reply.controller._buffer[0].required_command_interfaces._length, 2U);
        EXPECT_EQ(last.name, weigh);
        EXPECT_EQ(last.type, weigh);
        EXPECT_STREQ(last.state, "active");
      });
  EXPECT_EQ(change("hold", weigh, kBestEffort), "yes: active: hold");
  EXPECT_TRUE((this->*unload)("unload_controller", weigh));
  EXPECT_FALSE((this->*unload)("unload_controller", "hold")) << "it is active";
  call<cm::ListControllerTypes_Response>(
      "list_controller_types", cm::ListControllerTypes_Request{},
      [](const cm::ListControllerTypes_Response& reply) { EXPECT_GT(reply.types._length, 5U); });
  std::string robot;
  call<cm::ListHardwareComponents_Response>(
      "list_hardware_components", cm::ListHardwareComponents_Request{},
      [&robot](const cm::ListHardwareComponents_Response& reply) {
        ASSERT_EQ(reply.component._length, 1U);
        robot = reply.component._buffer[0].name;
      });
  call<cm::ListHardwareInterfaces_Response>("list_hardware_interfaces",
                                            cm::ListHardwareInterfaces_Request{},
                                            [](const cm::ListHardwareInterfaces_Response& reply) {
                                              EXPECT_EQ(reply.state_interfaces._length, 18U);
                                              EXPECT_GE(reply.command_interfaces._length, 6U);
                                            });
  call<cm::ReloadControllerLibraries_Response>(
      "reload_controller_libraries", cm::ReloadControllerLibraries_Request{},
      [](const cm::ReloadControllerLibraries_Response& reply) { EXPECT_FALSE(reply.ok); });
  std::string label = "active";
  cm::SetHardwareComponentState_Request wish{};
  wish.name = robot.data();
  wish.target_state = {.id = 3, .label = label.data()};
  const auto same_state = [](const cm::SetHardwareComponentState_Response& reply) {
    EXPECT_TRUE(reply.ok);
    EXPECT_EQ(reply.state.id, 3);
    EXPECT_STREQ(reply.state.label, "active");
  };
  call<cm::SetHardwareComponentState_Response>("set_hardware_component_state", wish, same_state);
  EXPECT_EQ(end(), 0);
}

/// The same over the control socket.
TEST_F(ManagedRun, SwitchesByHandAsFarAsItGoes) {
  begin_with("");
  ASSERT_EQ(to_run("controller load gravity_compensation --name weigh").status, 0);
  const Outcome partly =
      to_run("controller switch --start weigh --stop nobody --strictness best_effort");
  EXPECT_EQ(partly.status, 0) << partly.err;
  EXPECT_NE((partly.out + partly.err).find("weigh has a joint of hold"), std::string::npos)
      << partly.out << partly.err;
  EXPECT_EQ(to_run("controller switch --start weigh --strictness force").status, 0);
  const std::string list = to_run("controller list").out;
  EXPECT_NE(list.find("weigh       active"), std::string::npos) << list;
  EXPECT_NE(to_run("controller switch --start hold --strictness so_so").err.find("best_effort"),
            std::string::npos);
  EXPECT_NE(to_run("ask '{\"do\": \"controller.available\"}'").out.find("\"hold\""),
            std::string::npos);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
