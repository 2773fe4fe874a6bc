// Who has the robot, and what the server does with commands that it should not follow.
#include <limits>

#include "controllers/min_jerk.hpp"
#include "tests/remote/link_rig.hpp"

namespace tandem::remote {
namespace {

using namespace test;

TEST(Lease, HasOneOwnerAtATime) {
  Lease lease;
  EXPECT_TRUE(lease.acquire(7, "seven", 100));
  EXPECT_TRUE(lease.acquire(7, "seven", 150));
  EXPECT_EQ(lease.heard_ns(), 150);
  EXPECT_FALSE(lease.acquire(8, "eight", 200));
  EXPECT_EQ(lease.name(), "seven");
  EXPECT_FALSE(lease.release(8));
  EXPECT_EQ(lease.owner(), 7U);
  EXPECT_TRUE(lease.release(7));
  EXPECT_EQ(lease.owner(), 0U);
  EXPECT_TRUE(lease.acquire(8, "eight", 300));
  EXPECT_EQ(lease.given(), 2U);
}

/// A process that was stopped does not blame those whom it did not hear meanwhile.
TEST(Silence, CountsTheTimeInWhichTheListenerWasAwake) {
  constexpr std::int64_t kMost = 250;
  Silence silence;
  std::int64_t now = 1000;
  EXPECT_EQ(silence.of(1000, now, kMost), 0);
  for (; now < 1500; ++now) EXPECT_EQ(silence.of(1000, now, kMost), now - 1000);
  EXPECT_EQ(silence.of(1000, now, kMost), 500);
  now += 100'000;  // it stood
  EXPECT_EQ(silence.of(1000, now, kMost), 500 + kMost);
  EXPECT_EQ(silence.of(now, now + 1, kMost), 0) << "heard";
  EXPECT_EQ(silence.of(now, now + 101, kMost), 100);
}

TEST(TripleBuffer, GivesWhatWasPublishedLast) {
  TripleBuffer<int> box(0);
  EXPECT_FALSE(box.refresh());
  for (const int value : {1, 2, 3}) {
    box.back() = value;
    box.publish();
  }
  EXPECT_TRUE(box.refresh());
  EXPECT_EQ(box.front(), 3);
  EXPECT_FALSE(box.refresh());
  EXPECT_EQ(box.front(), 3);
}

/// A served robot in real time, and a client that says to it what it likes.
class LinkChecks : public testing::Test {
 protected:
  static runtime::CycleConfig real_time() {
    runtime::CycleConfig config;
    config.loop.rate = 1.0;
    return config;
  }
  static ServerConfig config() {
    ServerConfig config;
    config.lease_timeout_s = 30.0;  // but where a test wants it otherwise
    config.max_age_cycles = 50'000;
    return config;
  }

  explicit LinkChecks(const ServerConfig& of = config()) : served(of, real_time()) {}

  void SetUp() override {
    participant_ = participant("talker");
    using dds::Reader, dds::Writer;
    told_.emplace(*open_end<Reader<tandem_msgs::LinkServer>>(*participant_, kServerTopic));
    requests_.emplace(*open_end<Writer<tandem_msgs::LinkRequest>>(*participant_, kRequestTopic));
    commands_.emplace(*open_end<Writer<tandem_msgs::LinkCommand>>(*participant_, kCommandTopic));
    image_.assign(served.cycle->command());  // as it is before the first cycle
    begin();
    ASSERT_TRUE(eventually([this] { return look() != 0; }));
    ASSERT_TRUE(eventually([this] {
      return served.phase() == RunPhase::kRunning && commands_->endpoint().matched() == 1 &&
             requests_->endpoint().matched() == 1;
    }));
    for (std::int8_t& mode : image_.mode()) mode = 1;
    acquire(kClient);
    ASSERT_TRUE(eventually([this] { return served.server->lease().owner() == kClient; }));
  }

  virtual void begin() { served.begin(); }
  /// The server's run; 0: not heard yet.
  std::uint64_t look() {
    told_->take([this](const tandem_msgs::LinkServer& sample, const auto&) { run_ = sample.run; });
    return run_;
  }
  void acquire(std::uint64_t client, std::uint32_t protocol = kLinkProtocol,
               LeaseAction action = LeaseAction::kAcquire) {
    std::string name = "talker";
    tandem_msgs::LinkRequest sample{};
    sample.run = run_;
    sample.client = client;
    sample.protocol = protocol;
    sample.action = static_cast<std::uint8_t>(action);
    sample.name = name.data();
    requests_->write(sample);
  }
  /// A command that is right.
  tandem_msgs::LinkCommand sample() {
    tandem_msgs::LinkCommand out{};
    out.run = run_;
    out.client = kClient;
    out.sequence_number = ++sequence_;
    out.cycle = served.cycle->progress().cycles.load() - 1;
    out.state_ns = out.sent_ns = clock_ns(CLOCK_MONOTONIC);
    out.live = true;
    out.stop = static_cast<std::uint8_t>(hal::StopCategory::kWarn);
    out.command._buffer = reinterpret_cast<std::uint8_t*>(image_.bytes().data());
    out.command._length = out.command._maximum = static_cast<std::uint32_t>(image_.bytes().size());
    return out;
  }
  /// Writes it, and expects what becomes of it.
  void expect(Verdict verdict, const tandem_msgs::LinkCommand& command) {
    const std::uint64_t before = served.server->count(verdict);
    ASSERT_TRUE(commands_->write(command));
    EXPECT_TRUE(eventually([&] { return served.server->count(verdict) == before + 1; }))
        << to_string(verdict);
  }

  static constexpr std::uint64_t kClient = 4711;
  Served served;
  std::unique_ptr<dds::Participant> participant_;
  std::optional<dds::Reader<tandem_msgs::LinkServer>> told_;
  std::optional<dds::Writer<tandem_msgs::LinkRequest>> requests_;
  std::optional<dds::Writer<tandem_msgs::LinkCommand>> commands_;
  hal::CommandImage image_{served.robot.shape()};
  std::uint64_t run_ = 0, sequence_ = 0;
};

TEST_F(LinkChecks, ACommandOfItsOwnerIsTakenAndNobodyElses) {
  expect(Verdict::kTaken, sample());
  auto other = sample();
  other.client = 4712;
  expect(Verdict::kNoLease, other);
  auto earlier = sample();
  ++earlier.run;
  expect(Verdict::kNoLease, earlier);
}

TEST_F(LinkChecks, AClientOfAnotherVersionGetsNoLease) {
  acquire(kClient, kLinkProtocol, LeaseAction::kRelease);
  ASSERT_TRUE(eventually([this] { return served.server->lease().owner() == 0; }));
  acquire(4712, kLinkProtocol + 1);
  acquire(4713);
  EXPECT_TRUE(eventually([this] { return served.server->lease().owner() == 4713; }));
}

/// Everything that the owner writes can be read by everybody in the domain, his number, too.
TEST_F(LinkChecks, WhoKnowsTheOwnersNumberIsNotTheOwner) {
  expect(Verdict::kTaken, sample());
  const auto impostor = participant("impostor");
  auto commands = *open_end<dds::Writer<tandem_msgs::LinkCommand>>(*impostor, kCommandTopic);
  auto requests = *open_end<dds::Writer<tandem_msgs::LinkRequest>>(*impostor, kRequestTopic);
  ASSERT_TRUE(eventually(
      [&] { return commands.endpoint().matched() == 1 && requests.endpoint().matched() == 1; }));
  const std::uint64_t refused = served.server->count(Verdict::kNoLease);
  const auto command = sample();
  ASSERT_TRUE(commands.write(command));
  EXPECT_TRUE(eventually([&] { return served.server->count(Verdict::kNoLease) == refused + 1; }));
  std::string text = "impostor";
  tandem_msgs::LinkRequest request{};
  request.run = run_;
  request.protocol = kLinkProtocol;
  request.client = kClient;
  request.name = text.data();
  for (const LeaseAction action : {LeaseAction::kAcquire, LeaseAction::kRelease}) {
    request.action = static_cast<std::uint8_t>(action);
    ASSERT_TRUE(requests.write(request));
  }
  dds_wait_for_acks(requests.endpoint().get(), DDS_SECS(5));
  ASSERT_TRUE(commands.write(sample()));
  EXPECT_TRUE(eventually([&] { return served.server->count(Verdict::kNoLease) == refused + 2; }));
  EXPECT_EQ(served.server->lease().owner(), kClient);
  EXPECT_EQ(served.server->lease().name(), "talker");
  expect(Verdict::kTaken, sample());  // and its sequence number was not used up
}

TEST_F(LinkChecks, ADuplicateAndOneThatWasOvertakenAreNotTaken) {
  const auto first = sample();
  const auto second = sample();
  expect(Verdict::kTaken, second);
  expect(Verdict::kOutOfOrder, second);
  expect(Verdict::kOutOfOrder, first);
}

TEST_F(LinkChecks, ACommandForACycleThatHasNotBeenIsNotTaken) {
  auto future = sample();
  future.cycle += 1'000'000'000;
  expect(Verdict::kStale, future);
}

TEST_F(LinkChecks, WhatIsNotFiniteOrOfAnotherSizeIsNotTaken) {
  image_.torque_Nm()[0] = std::numeric_limits<double>::quiet_NaN();
  expect(Verdict::kMalformed, sample());
  image_.torque_Nm()[0] = std::numeric_limits<double>::infinity();
  expect(Verdict::kMalformed, sample());
  image_.torque_Nm()[0] = 0.0;
  image_.mode()[0] = 17;
  expect(Verdict::kMalformed, sample());
  image_.mode()[0] = 1;
  auto small = sample();
  small.command._length -= 8;
  expect(Verdict::kMalformed, small);
  double gain = 1.0;
  auto gains = sample();
  gains.gains._buffer = &gain;
  gains.gains._length = gains.gains._maximum = 1;
  expect(Verdict::kMalformed, gains);
  expect(Verdict::kTaken, sample());
  EXPECT_TRUE(served.cycle->faults().empty());
}

TEST_F(LinkChecks, GainsOfZeroAndMoreAreTaken) {
  const hal::ParameterImage now = hal::initial_parameters(served.robot);
  std::vector<double> gains;
  for (std::size_t j = 0; j < now.joints(); ++j) {
    for (std::size_t loop = 0; loop < hal::kPidLoops; ++loop) {
      const hal::PidGains& one = now.gains(j, static_cast<hal::PidLoop>(loop));
      gains.insert(gains.end(), {one.kp, one.ki, one.kd});
    }
  }
  const auto with_first = [&](double gain) {
    gains[0] = gain;
    auto command = sample();
    command.gains._buffer = gains.data();
    command.gains._length = command.gains._maximum = static_cast<std::uint32_t>(gains.size());
    return command;
  };
  expect(Verdict::kTaken, with_first(0.5));
  expect(Verdict::kTaken, with_first(0.0));
  expect(Verdict::kMalformed, with_first(-0.5));
  expect(Verdict::kMalformed, with_first(std::numeric_limits<double>::quiet_NaN()));
}

TEST_F(LinkChecks, AFloodIsCountedAndLeavesTheLoopAlone) {
  auto flood = sample();
  flood.client = 1;
  for (int i = 0; i < 20'000; ++i) commands_->write(flood);
  EXPECT_TRUE(eventually([&] { return served.server->count(Verdict::kNoLease) > 100; }));
  expect(Verdict::kTaken, sample());
  EXPECT_EQ(served.phase(), RunPhase::kRunning);
  EXPECT_TRUE(served.cycle->faults().empty());
}

TEST_F(LinkChecks, AStopIsCarriedOutEvenWithACommandThatIsNotTaken) {
  auto stop = sample();
  stop.stops = 1;
  stop.stop = static_cast<std::uint8_t>(hal::StopCategory::kCategory1);
  stop.command._length = 0;
  expect(Verdict::kMalformed, stop);
  EXPECT_TRUE(eventually([this] { return served.phase() == RunPhase::kFaulted; }));
  ASSERT_EQ(served.cycle->faults().size(), 1U);
  EXPECT_EQ(served.cycle->faults()[0].text, "the remote owner asked for a stop");
  // Reset by an owner who had not seen the stop: the stop wins, whichever sample came first.
  auto early = sample();
  early.cycle = served.cycle->progress().stopped_before.load() - 1;
  early.stops = 1;
  early.resets = 1;
  ASSERT_TRUE(commands_->write(early));
  EXPECT_TRUE(eventually([this] { return served.cycle->progress().failed_resets.load() == 1; }));
  EXPECT_EQ(served.phase(), RunPhase::kFaulted);
  auto reset = sample();
  reset.stops = 1;
  reset.resets = 2;
  expect(Verdict::kTaken, reset);
  EXPECT_TRUE(eventually([this] { return served.phase() == RunPhase::kRunning; }));
}

/// Its commands may be 20 cycles old, its lease lasts a second.
class LinkLoss : public LinkChecks {
 protected:
  static ServerConfig impatient(hal::StopCategory on_lost) {
    ServerConfig config;
    config.max_age_cycles = 20;
    config.lease_timeout_s = 30.0;
    config.on_lost = on_lost;
    return config;
  }
  explicit LinkLoss(hal::StopCategory on_lost = hal::StopCategory::kCategory1)
      : LinkChecks(impatient(on_lost)) {}

  /// Commands until they are followed, and then no more.
  void lead() {
    ASSERT_TRUE(eventually([this] {
      if (served.host->shown().active != 0 || served.server->losses() > 0) return true;
      commands_->write(sample());
      return false;
    }));
  }
};

TEST_F(LinkLoss, CommandsThatStopLeadToTheDeclaredStop) {
  lead();
  EXPECT_TRUE(eventually([this] { return served.phase() == RunPhase::kFaulted; }));
  ASSERT_FALSE(served.cycle->faults().empty());
  EXPECT_EQ(served.cycle->faults()[0].text,
            "the remote owner's commands stopped, or came too late");
  EXPECT_EQ(served.server->lease().owner(), 0U);
}

class LinkLossHeld : public LinkLoss {
 protected:
  LinkLossHeld() : LinkLoss(hal::StopCategory::kWarn) {}
};

TEST_F(LinkLossHeld, HoldsEveryJointAndTakesTheNextOwner) {
  lead();
  ASSERT_TRUE(eventually([this] { return !served.cycle->faults().empty(); }));
  EXPECT_EQ(served.phase(), RunPhase::kRunning);
  EXPECT_TRUE(eventually([this] { return served.host->shown().active == 0; }));
  acquire(5000);
  EXPECT_TRUE(eventually([this] { return served.server->lease().owner() == 5000U; }));
}

/// The loop is stepped by the test: what is counted is cycles, on a machine of any speed.
class LinkInCycles : public LinkLoss {
 protected:
  explicit LinkInCycles(hal::StopCategory on_lost = hal::StopCategory::kCategory1)
      : LinkLoss(on_lost) {}

  void begin() override {
    for (int i = 0; i < 1000 && served.phase() != RunPhase::kRunning; ++i) step();
  }
  void step() { ASSERT_TRUE(served.cycle->step()); }
  /// One cycle with a command for it.
  void step_with(double position_rad) {
    image_.position_rad()[0] = position_rad;
    expect(Verdict::kTaken, sample());
    step();
  }
  /// From 0.1 rad to 0.2 rad within 200 cycles, from rest to rest.
  void lead_on() {
    for (int i = 1; i <= 200; ++i) step_with(0.1 + 0.1 * min_jerk(i / 200.0).s);
  }
  [[nodiscard]] double reference_rad() const { return served.cycle->command().position_rad()[0]; }
};
class OwnerIsLost : public LinkInCycles, public testing::WithParamInterface<hal::StopCategory> {
 protected:
  OwnerIsLost() : LinkInCycles(GetParam()) {}
};
INSTANTIATE_TEST_SUITE_P(Category, OwnerIsLost,
                         testing::Values(hal::StopCategory::kWarn, hal::StopCategory::kCategory1,
                                         hal::StopCategory::kCategory0));

TEST_P(OwnerIsLost, WhenItsCommandsAreTooOldAndThenItIsAsDeclared) {
  lead_on();
  ASSERT_NEAR(reference_rad(), 0.2, 1e-9) << "it is followed";
  int lost = 0;
  for (int i = 1; i <= 100 && lost == 0; ++i) {
    step();
    if (!served.cycle->faults().empty()) lost = i;
  }
  EXPECT_EQ(lost, 20) << "max_age_cycles, from the first cycle without a command";
  EXPECT_EQ(served.cycle->faults().at(0).text,
            "the remote owner's commands stopped, or came too late");
  EXPECT_EQ(served.server->lease().owner(), 0U);
  EXPECT_EQ(served.server->losses(), 1U);
  const bool holds = GetParam() == hal::StopCategory::kWarn;
  EXPECT_EQ(served.backend.latched, GetParam());
  EXPECT_EQ(served.phase(), holds ? RunPhase::kRunning : RunPhase::kFaulted);
  for (int i = 0; i < 200; ++i) step();
  EXPECT_EQ(served.cycle->faults().size(), 1U);
  if (holds) {
    EXPECT_NEAR(reference_rad(), 0.2, 1e-9) << "it stays";
  }
}

/// The loop stands while they come: it takes one command a cycle, the newest, whatever their
/// number.
TEST_F(LinkInCycles, AFloodOfTheOwnersIsItsNewestCommand) {
  lead_on();
  constexpr std::uint64_t kFlood = 20'000;
  const auto told = [this] {
    std::uint64_t sum = 0;
    for (std::size_t v = 0; v < kVerdicts; ++v)
      sum += served.server->count(static_cast<Verdict>(v));
    return sum;
  };
  const std::uint64_t before = told();
  image_.position_rad()[0] = 0.1;
  for (std::uint64_t i = 0; i < kFlood; ++i) commands_->write(sample());
  EXPECT_TRUE(eventually([&] { return told() > before; }));
  step_with(0.20002);
  EXPECT_NEAR(reference_rad(), 0.20002, 1e-9) << "none of those before it";
  EXPECT_LE(told() - before, kFlood + 1);
  EXPECT_TRUE(served.cycle->faults().empty());
  step_with(0.20004);
  EXPECT_NEAR(reference_rad(), 0.20004, 1e-9);
}

/// It reacts to the end that the server has announced. That is not the end's cause.
TEST_F(LinkInCycles, AStopInTheShutDownIsNoFault) {
  step_with(0.1);
  served.backend.shut_down_cycles = 100;
  served.cycle->inbox().end_run();
  step();
  ASSERT_EQ(served.phase(), RunPhase::kShutDown);
  const auto ask = [this](hal::StopCategory category, std::uint32_t stops) {
    auto stop = sample();
    stop.stops = stops;
    stop.stop = static_cast<std::uint8_t>(category);
    expect(Verdict::kTaken, stop);
    step();
  };
  ask(hal::StopCategory::kCategory1, 1);
  EXPECT_TRUE(served.cycle->faults().empty());
  ask(hal::StopCategory::kCategory0, 2);
  EXPECT_EQ(served.cycle->faults().size(), 1U) << "this is more than the shut-down does";
}

TEST(Connect, TellsWhoHasTheRobotAndWhatDiffers) {
  Served served({}, {.loop = {.rate = 1.0}});
  served.begin();
  const auto first = participant("first");
  const auto second = participant("second");
  ClientConfig config;
  config.name = "the first one";
  auto owner = Owner::connect(*first, config, served.robot);
  ASSERT_TRUE(owner) << owner.error().to_string();
  config.name = "the second one";
  const auto late = Owner::connect(*second, config, served.robot);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().message, "the robot is owned by the first one");
  hal::RobotConfig other = served.robot;
  other.joints[1].name = "wrist";
  const auto wrong = Owner::connect(*second, config, other);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("joint 1 is '" + served.robot.joints[1].name +
                                       "' there and 'wrist' here"),
            std::string::npos)
      << wrong.error().message;
  config.lockstep = true;
  const auto locked = Owner::connect(*second, config, served.robot);
  ASSERT_FALSE(locked);
  EXPECT_EQ(locked.error().message, "the server does not run in lockstep");
  owner->reset();  // gives it back
  config.lockstep = false;
  const auto next = Owner::connect(*second, config, served.robot);
  EXPECT_TRUE(next) << next.error().to_string();
}

/// Numbers and effects of commands would mean different things at the two ends.
TEST(Connect, TellsWhenTheTwoEndsHaveDifferentPlayOuts) {
  for (const std::uint64_t there : {0, 100}) {
    ServerConfig server;
    if (there > 0) server.playout = {.delay_cycles = there - 1, .brake_cycles = 50};
    Served served(server, {.loop = {.rate = 1.0}});
    served.begin();
    const auto client = participant("client");
    ClientConfig config;
    config.own_pace = there == 0;
    config.robot_end.playout_cycles = there == 0 ? 70 : 0;
    const auto refused = Owner::connect(*client, config, served.robot);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message,
              there == 0 ? "the server's link is not this one: there is no [teleoperation] there, "
                           "and [teleoperation] with effects 70 cycles after a command's number "
                           "here"
                         : "the server's link is not this one: there is [teleoperation] with "
                           "effects 100 cycles after a command's number there, and no "
                           "[teleoperation] here");
    EXPECT_TRUE(eventually([&] { return served.server->lease().owner() == 0; }));
    config.robot_end.playout_cycles = there;
    const auto same = Owner::connect(*client, config, served.robot);
    EXPECT_TRUE(same) << same.error().to_string();
  }
}

/// The prediction would be that of another robot; or two ends, or none, would lead a joint.
TEST(Connect, TellsWhenTheTwoEndsHaveDifferentControllersAtTheRobot) {
  ServerConfig server;
  server.robot_controllers = {{"hold", "\"hold\""}, {"hold.link_damping_Nms_rad", "12"}};
  Served served(server, {.loop = {.rate = 1.0}});
  served.begin();
  const auto client = participant("client");
  ClientConfig config;
  const auto message = [&] {
    const auto made = Owner::connect(*client, config, served.robot);
    return made ? std::string() : made.error().message;
  };
  const std::string begin = "the server's link is not this one: teleoperation.robot_controller.";
  EXPECT_EQ(message(), begin + "hold is \"hold\" there and not given here");
  config.robot_end.controllers = server.robot_controllers;
  config.robot_end.controllers["hold.link_damping_Nms_rad"] = "8";
  EXPECT_EQ(message(), begin + "hold.link_damping_Nms_rad is 12 there and 8 here");
  config.robot_end.controllers = server.robot_controllers;
  config.robot_end.controllers["legs"] = "\"squat\"";
  EXPECT_EQ(message(), begin + "legs is not given there and \"squat\" here");
  EXPECT_EQ(served.server->lease().given(), 0U) << "nobody asked for the robot";
  config.robot_end.controllers.erase("legs");
  EXPECT_EQ(message(), "");
}

/// A paused server sends no state; what its end is it says all the same.
TEST(Connect, ComparesTheEndsOfAServerWhoseTimeIsPaused) {
  ServerConfig server;
  server.playout = {.delay_cycles = 99, .brake_cycles = 50};
  Served served(server, {.loop = {.rate = 1.0, .start_paused = true}});
  served.begin();
  const auto client = participant("client");
  const auto refused = Owner::connect(*client, {}, served.robot);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("effects 100 cycles"), std::string::npos)
      << refused.error().message;
}

TEST(Connect, RefusesToChooseBetweenServersUnlessOneIsNamed) {
  Served served({}, {.loop = {.rate = 1.0}});
  Served other({}, {.loop = {.rate = 1.0}});
  served.begin();
  other.begin();
  const auto owner = participant("owner");
  ClientConfig config;
  const auto none = Owner::connect(*owner, config, served.robot);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "several servers were found");
  EXPECT_EQ(served.server->lease().given() + other.server->lease().given(), 0U);
  config.server = other.server->number();
  const auto named = Owner::connect(*owner, config, served.robot);
  ASSERT_TRUE(named) << named.error().to_string();
  EXPECT_EQ(other.server->lease().given(), 1U);
}

TEST(Connect, WithoutAServerSaysSoInTime) {
  const auto alone = participant("alone");
  ClientConfig config;
  config.connect_timeout_s = 0.3;
  const auto none = Owner::connect(*alone, config, hal::test::fake_robot());
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "no server was found within 0.3 s");
  config.connect_timeout_s = 60;
  config.interrupted = [] { return true; };
  const auto stopped = Owner::connect(*alone, config, hal::test::fake_robot());
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().message, "interrupted before it had the robot");
}

}  // namespace
}  // namespace tandem::remote
