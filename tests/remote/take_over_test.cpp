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

TEST(BumplessTransfer, OverTheLinkMakesNoStepEitherWay) {
  Record record(hal::test::fake_robot(), 60'000);
  ServerConfig config;
  config.max_age_cycles = 50'000;  // of a busy machine
  config.lease_timeout_s = 30.0;
  Served served(config, paced(), &record);
  served.begin();
  for (int time = 0; time < 2; ++time) {  // the second from where the first left it
    Owner owner({}, {.running_cycles = 400});
    owner.cycle->run();
    EXPECT_TRUE(owner.cycle->faults().empty());
    EXPECT_GE(owner.cycle->running_cycles() + owner.cycle->loop().skipped, 390U);
    EXPECT_GT(owner.backend->turn_around().count(), 0U);
    EXPECT_TRUE(eventually([&] { return served.server->lease().owner() == 0; }));
  }
  served.end();
  EXPECT_TRUE(served.cycle->faults().empty());
  EXPECT_EQ(served.server->lease().given(), 2U);
  // 0.2 rad at 1 Hz: 1.26 mrad in a cycle at most; a late command makes up for what it missed.
  const double step = largest_step(record.cycles());
  RecordProperty("largest_step_rad", std::to_string(step));
  EXPECT_GT(step, 0.0005);
  const double limit = served.cycle->limits().limits()[0].max_velocity_rad_s * 1e-3;
  EXPECT_LE(step, limit * (1.0 + 1e-9));
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

}  // namespace
}  // namespace tandem::remote
