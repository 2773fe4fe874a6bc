// A server that says what no server of this robot says: nothing of it reaches the owner's loop.
#include <cmath>
#include <limits>

#include "tests/remote/link_rig.hpp"

namespace tandem::remote {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// An owner and its server, in whose name further samples are written.
struct OddServer : testing::Test {
  OddServer() {
    auto made = Server::open(*at_robot, robot, hal::initial_parameters(hal::test::fake_robot()),
                             identity_of(robot, "hash", test::kPeriod_ns), {});
    EXPECT_TRUE(made);
    server = std::move(*made);
    auto connected =
        RemoteBackend::connect(*at_owner, robot, identity_of(robot, "hash", test::kPeriod_ns),
                               {.name = "test", .server = server->number(), .interrupted = [this] {
                                  return owned.load();
                                }});
    EXPECT_TRUE(connected) << connected.error().to_string();
    owned = true;
    owner = std::move(*connected);
  }
  template <class T>
  void say(const char* topic, const T& sample) {
    auto writer = open_end<dds::Writer<T>>(*at_robot, topic);
    ASSERT_TRUE(writer);
    ASSERT_TRUE(test::eventually([&] { return writer->endpoint().matched() > 0; }));
    ASSERT_TRUE(writer->write(sample));
  }
  void show(hal::StateImage& state, hal::CommandImage& command,
            hal::StopCategory reaction = hal::StopCategory::kWarn,
            hal::FaultCause cause = hal::FaultCause::kDrive) {
    const auto bytes = [](auto& image) {
      const auto size = static_cast<std::uint32_t>(image.bytes().size());
      return dds_sequence_octet{size, size, reinterpret_cast<std::uint8_t*>(image.bytes().data()),
                                false};
    };
    tandem_msgs::LinkState sample{};
    sample.run = server->number();
    sample.cycle = ++cycle;
    sample.phase = static_cast<std::uint8_t>(hal::RunPhase::kRunning);
    sample.reaction = static_cast<std::uint8_t>(reaction);
    sample.state = bytes(state);
    sample.command = bytes(command);
    std::vector<std::uint8_t> causes(robot.joints.size(), static_cast<std::uint8_t>(cause));
    const auto joints = static_cast<std::uint32_t>(causes.size());
    sample.causes = {joints, joints, causes.data(), false};
    say(kStateTopic, sample);
  }
  /// What the loop gets in its next cycle.
  [[nodiscard]] Code next(hal::StateImage& state) {
    owner->exchange({.cycle = cycle});
    return owner->read({.cycle = cycle}, state);
  }

  const hal::Robot robot = hal::robot_of(hal::test::fake_robot());
  std::unique_ptr<dds::Participant> at_robot = test::participant("odd_robot");
  std::unique_ptr<dds::Participant> at_owner = test::participant("odd_owner");
  std::atomic<bool> owned{false};
  std::unique_ptr<Server> server;
  std::unique_ptr<RemoteBackend> owner;
  std::uint64_t cycle = 0;
};

TEST_F(OddServer, ShowsNoNumbersAndIsNotFollowed) {
  hal::StateImage good(robot.shape()), odd(robot.shape()), seen(robot.shape());
  hal::CommandImage command(robot.shape()), odd_command(robot.shape());
  good.position_rad()[1] = 0.5;
  show(good, command);
  ASSERT_TRUE(test::eventually([&] { return next(seen) == Code::kOk; }));
  EXPECT_EQ(seen.position_rad()[1], 0.5);

  odd.position_rad()[1] = kNaN;
  odd_command.torque_Nm()[0] = std::numeric_limits<double>::infinity();
  show(odd, command);
  EXPECT_EQ(next(seen), Code::kTimeout);
  show(good, odd_command);
  EXPECT_EQ(next(seen), Code::kTimeout);
  show(good, command, static_cast<hal::StopCategory>(200));  // there is none
  EXPECT_EQ(next(seen), Code::kTimeout);
  good.position_rad()[1] = 0.25;
  show(good, command);
  ASSERT_TRUE(test::eventually([&] { return next(seen) == Code::kOk; }));
  EXPECT_EQ(seen.position_rad()[1], 0.25);
}

TEST_F(OddServer, TellsACauseThatNoDriveHas) {
  using hal::FaultCause;
  hal::StateImage state(robot.shape()), seen(robot.shape());
  hal::CommandImage command(robot.shape());
  const auto told = [&](FaultCause cause) {
    show(state, command, hal::StopCategory::kWarn, cause);
    EXPECT_TRUE(test::eventually([&] { return next(seen) == Code::kOk; }));
    return owner->fault_cause(1);
  };
  EXPECT_EQ(told(FaultCause::kHeartbeatLost), FaultCause::kHeartbeatLost);
  EXPECT_EQ(told(FaultCause::kOverrun), FaultCause::kDrive);
  EXPECT_EQ(told(FaultCause::kNone), FaultCause::kDrive);
}

// Builds that number the stop categories in different ways had driven each other's robots.
TEST(OtherVersions, AreRefusedAndToldWhichIsOlder) {
  const hal::Robot robot = hal::robot_of(hal::test::fake_robot());
  const auto at_robot = test::participant("robot"), at_owner = test::participant("owner");
  const auto refusal = [&](std::uint32_t protocol) {
    LinkIdentity identity = identity_of(robot, "hash", test::kPeriod_ns);
    identity.protocol = protocol;
    const auto server = Server::open(
        *at_robot, robot, hal::initial_parameters(hal::test::fake_robot()), identity, {});
    EXPECT_TRUE(server);
    const auto owner =
        RemoteBackend::connect(*at_owner, robot, identity_of(robot, "hash", test::kPeriod_ns),
                               {.name = "test", .server = (*server)->number()});
    EXPECT_FALSE(owner.has_value());
    EXPECT_EQ((*server)->lease().owner(), 0U);
    return owner ? "" : owner.error().to_string();
  };
  EXPECT_EQ(refusal(3),
            "the server is of an older version of Tandem: the link's protocol is 3 there, 7 here ("
            "install the same version on both; the older one is the server's)");
  EXPECT_EQ(refusal(8),
            "the server is of a newer version of Tandem: the link's protocol is 8 there, 7 here ("
            "install the same version on both; the older one is this one)");
}

// The owner's thread that renews its lease waited so long: never, or without an end.
TEST_F(OddServer, GivesItsLeaseForNoTime) {
  for (const double timeout_s : {kNaN, -1.0, 0.0, std::numeric_limits<double>::infinity()}) {
    char name[] = "fake", other[] = "told";
    tandem_msgs::LinkServer sample{};
    sample.run = server->number();
    sample.protocol = kLinkProtocol;
    sample.robot = name;
    sample.description_hash = sample.owner_name = name;
    sample.status = other;
    sample.lease_timeout_s = timeout_s;
    sample.owner = server->lease().owner();
    say(kServerTopic, sample);
  }
  EXPECT_FALSE(owner->status_text().ends_with("told")) << owner->status_text();
  EXPECT_NE(owner->phase(), hal::Phase::kFault);
}

}  // namespace
}  // namespace tandem::remote
