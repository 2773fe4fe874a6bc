// An owner in real time: it takes the robot over and gives it back without a bump, and what
// happens when one end goes.
#include <cmath>

#include "tests/remote/link_rig.hpp"

namespace tandem::remote {
namespace {

using namespace test;

runtime::CycleConfig paced() {
  runtime::CycleConfig config;
  config.loop.rate = 1.0;
  return config;
}

/// The largest change of joint 0's reference from one cycle to the next.
double largest_step(std::span<const Record::Cycle> cycles) {
  double most = 0.0;
  for (std::size_t i = 1; i < cycles.size(); ++i) {
    if (cycles[i - 1].phase != RunPhase::kRunning || cycles[i].phase != RunPhase::kRunning)
      continue;
    most = std::max(most, std::abs(cycles[i].command.position_rad()[0] -
                                   cycles[i - 1].command.position_rad()[0]));
  }
  return most;
}

/// The reference stands 0.3 rad above the joint, and the owner moves from where the joint is: that
/// far is the step of a robot that simply does what its new owner says. The limits would let it.
TEST(BumplessTransfer, OverTheLinkMakesNoStepEitherWay) {
  constexpr double kSag_rad = 0.3;
  hal::RobotConfig robot = hal::test::fake_robot();
  for (hal::JointConfig& joint : robot.joints) joint.max_velocity_rad_s = 1000.0;
  Record record(robot, 60'000);
  ServerConfig config;
  config.max_age_cycles = 50'000;  // of a busy machine
  config.lease_timeout_s = 30.0;
  Served served(config, paced(), &record, robot);
  served.backend.sag_rad = kSag_rad;
  served.begin();
  for (int time = 0; time < 2; ++time) {  // the second from where the first left it
    Owner owner({}, {.running_cycles = 400}, robot, 0.02);
    owner.cycle->run();
    EXPECT_TRUE(owner.cycle->faults().empty());
    EXPECT_GE(owner.cycle->running_cycles() + owner.cycle->loop().skipped, 390U);
    EXPECT_GT(owner.backend->turn_around().count(), 0U);
    EXPECT_TRUE(eventually([&] { return served.server->lease().owner() == 0; }));
  }
  served.end();
  EXPECT_TRUE(served.cycle->faults().empty());
  EXPECT_EQ(served.server->lease().given(), 2U);
  const double step = largest_step(record.cycles());
  RecordProperty("largest_step_rad", std::to_string(step));
  // Minimum jerk over 100 cycles is 15/8 of its mean speed at its fastest. The owner's own 0.13
  // mrad in a cycle comes on top, and more when a late command makes up for what it missed.
  const double fastest = 15.0 / 8.0 * kSag_rad / 100.0;
  EXPECT_GT(step, 0.9 * fastest) << "there was something to lead over";
  EXPECT_LT(step, fastest + 0.02);
}

TEST(Server, ThatEndsItsRunEndsItsOwnersInAFault) {
  auto served = std::make_unique<Served>(ServerConfig{}, paced());
  served->begin();
  Owner owner({}, {});
  std::thread loop([&owner] { owner.cycle->run(); });
  EXPECT_TRUE(
      eventually([&] { return owner.cycle->progress().phase.load() == RunPhase::kRunning; }));
  served->end();
  loop.join();
  ASSERT_FALSE(owner.cycle->faults().empty());
  EXPECT_EQ(owner.cycle->faults()[0].text, "the server's run is over");
}

TEST(LockstepLink, AnOwnerThatAnswersNothingLosesTheRobotInTime) {
  ServerConfig config;
  config.lockstep = true;
  config.lease_timeout_s = 30.0;
  config.lockstep_timeout_s = 1.0;
  config.on_lost = hal::StopCategory::kCategory1;
  Served served(config);
  served.begin();
  ClientConfig client;
  client.lockstep = true;
  Owner owner(client, {});
  while (owner.cycle->progress().running_cycles.load() < 10) ASSERT_TRUE(owner.cycle->step());
  // Its process lives and renews the lease, but its loop does not go on.
  EXPECT_TRUE(eventually([&] { return served.phase() == RunPhase::kFaulted; }));
  ASSERT_EQ(served.cycle->faults().size(), 1U);
  EXPECT_EQ(served.cycle->faults()[0].text,
            "the remote owner gave no command for this cycle in time");
}

TEST(LockstepLink, AServerThatWaitsForAnOwnerCanBeEnded) {
  ServerConfig config;
  config.lockstep = true;
  config.lease_timeout_s = 30.0;
  Served served(config);
  served.begin();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // it waits by then, or not yet
  served.end();
  EXPECT_EQ(served.phase(), RunPhase::kDone);
  EXPECT_EQ(served.cycle->running_cycles(), 0U);
}

TEST(LockstepLink, AServerThatWaitsForACommandCanBeStopped) {
  ServerConfig config;
  config.lockstep = true;
  config.lease_timeout_s = 30.0;
  Served served(config);
  served.begin();
  ClientConfig client;
  client.lockstep = true;
  Owner owner(client, {});
  while (owner.cycle->progress().running_cycles.load() < 10) ASSERT_TRUE(owner.cycle->step());
  served.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  EXPECT_TRUE(eventually([&] { return served.phase() == RunPhase::kFaulted; }));
}

// While its reset was on its way the server still showed the stop before it: the owner took that
// for the one that it wanted, and sent none.
TEST(LockstepLink, AnOwnersStopWinsOverItsResetInEachOfItsCycles) {
  for (int into = 0; into < 6; ++into) {
    SCOPED_TRACE(into);
    ServerConfig config;
    config.lockstep = true;
    Served served(config);
    served.begin();
    ClientConfig client;
    client.lockstep = true;
    Owner owner(client, {.after_stop = runtime::AfterStop::kWait});
    const auto steps = [&](int count) {
      for (int i = 0; i < count; ++i) (void)owner.cycle->step();
    };
    while (owner.cycle->progress().running_cycles.load() < 10) ASSERT_TRUE(owner.cycle->step());
    owner.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
    steps(20);
    ASSERT_EQ(served.phase(), RunPhase::kFaulted);
    owner.cycle->inbox().reset_faults();
    steps(1 + into);
    owner.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
    steps(200);
    EXPECT_EQ(owner.cycle->phase(), RunPhase::kFaulted);
    EXPECT_EQ(served.phase(), RunPhase::kFaulted);
    EXPECT_GE(served.cycle->progress().latched.load(), 1U);
  }
}

}  // namespace
}  // namespace tandem::remote
