// The HAL's conformance suite over the network proxy, in lockstep: a served robot of config/ with
// its loop's thread, and the suite as its owner.
#include <thread>

#include "hal/config/capabilities.hpp"
#include "hal/remote/remote_backend.hpp"
#include "hal/remote/server.hpp"
#include "hal/sim/sim_robot.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/hal/conformance.hpp"
#include "tests/runtime/test_controllers.hpp"
#include "tests/support/dds_domain.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::hal::test {
namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;

template <class T>
T take(Result<T> made) {
  if (!made) throw std::runtime_error(made.error().to_string());
  return std::move(*made);
}

/// Two that outlive every robot of this program.
dds::Participant& participant(bool serves) {
  static const auto domain = take(dds::Domain::open(dds::test::own_config()));
  static const auto server = take(dds::Participant::open(domain, "served"));
  static const auto client = take(dds::Participant::open(domain, "owner"));
  return serves ? *server : *client;
}

struct ServedUr5e {
  ServedUr5e()
      : loaded(tandem::test::load_test_robot("ur5e")),
        host(loaded.robot, loaded.kernels.get(), kPeriod_ns) {
    sim::SimRobotConfig config;
    config.posture = "ready";
    backend = take(sim::SimRobot::create(loaded.robot, loaded.kernels.get(), config));
    remote::ServerConfig link;
    link.lockstep = true;
    link.lease_timeout_s = 30.0;
    server = take(remote::Server::open(participant(true), hal::robot_of(loaded.robot),
                                       hal::initial_parameters(loaded.robot), identity(), link));
    if (!host.add("remote", owner, runtime::test::parameters(), false)) throw std::logic_error("");
    cycle = std::make_unique<runtime::RobotCycle>(
        runtime::CycleParts{.robot = loaded.robot,
                            .backend = *backend,
                            .controllers = host,
                            .clock = clock,
                            .owner = {server.get(), owner.get(), 0}},
        runtime::CycleConfig{.after_stop = runtime::AfterStop::kWait});
    thread = std::thread([this] { cycle->run(); });
  }
  ~ServedUr5e() {
    cycle->inbox().end_run();
    thread.join();
    server->close();
  }
  [[nodiscard]] remote::LinkIdentity identity() const {
    return remote::identity_of(hal::robot_of(loaded.robot), "hash", kPeriod_ns);
  }

  tandem::test::TestRobot loaded;
  runtime::ControllerHost host;
  std::unique_ptr<sim::SimRobot> backend;
  std::unique_ptr<remote::Server> server;
  std::shared_ptr<runtime::OwnerController> owner = std::make_shared<runtime::OwnerController>();
  rt::WallClock clock;
  std::unique_ptr<runtime::RobotCycle> cycle;
  std::thread thread;
};

ConformanceRobot make_remote_ur5e() {
  auto served = std::make_shared<ServedUr5e>();
  ConformanceRobot made;
  made.robot = served->loaded.robot;
  made.joint = static_cast<std::size_t>(made.robot.joint_index("shoulder_pan_joint"));
  made.torque_Nm = 5.0;
  made.voltage_V = 1.0;
  made.provoke_fault = [sim = served->backend.get()](std::size_t j) {
    sim::ScenarioFault unplugged;
    unplugged.kind = hal::FaultKind::kEncoderUnplug;
    unplugged.joint = static_cast<std::int32_t>(j);
    unplugged.duration_ns = 20'000'000;
    ASSERT_TRUE(sim->post(unplugged));
  };
  remote::ClientConfig client;
  client.name = "the conformance suite";
  client.lockstep = true;
  client.server = served->server->number();
  made.backend = take(remote::RemoteBackend::connect(participant(false), hal::robot_of(made.robot),
                                                     served->identity(), client));
  made.keep = served;
  return made;
}

INSTANTIATE_TEST_SUITE_P(Remote, BackendConformance,
                         testing::Values(ConformanceCase{"ur5e", make_remote_ur5e}),
                         [](const auto& made) { return made.param.name; });

}  // namespace
}  // namespace tandem::hal::test
