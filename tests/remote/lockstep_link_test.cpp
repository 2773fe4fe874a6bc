// In lockstep a run over the link is the run in one process, bit for bit.
#include <algorithm>
#include <cstring>

#include "tests/remote/link_rig.hpp"

namespace tandem::remote {
namespace {

using namespace test;

constexpr std::uint64_t kRunning = 300, kSettling = 40;

void in_process(Record& record, std::uint32_t delay, std::uint64_t running = kRunning,
                double sag_rad = 0.0) {
  runtime::test::JointRun run;
  run.backend.sag_rad = sag_rad;
  run.truth = &run.backend.truth;
  run.observer = &record;
  run.add_sine();
  run.begin({.running_cycles = running, .settle_cycles = kSettling, .delay_cycles = delay});
  run.cycle->run();
  EXPECT_TRUE(run.cycle->faults().empty());
}

void over_the_link(Record& record, std::uint32_t delay, std::uint64_t running = kRunning,
                   double sag_rad = 0.0) {
  Served served({.lockstep = true, .ends_with_owner = true, .lease_timeout_s = 30.0},
                {.settle_cycles = kSettling}, &record);
  served.backend.sag_rad = sag_rad;
  served.begin();
  ClientConfig config;
  config.lockstep = true;
  Owner owner(config, {.running_cycles = running, .delay_cycles = delay});
  owner.cycle->run();
  served.join();
  EXPECT_TRUE(owner.cycle->faults().empty());
  EXPECT_TRUE(served.cycle->faults().empty());
  EXPECT_EQ(owner.cycle->running_cycles(), running);
  EXPECT_EQ(owner.cycle->loop().bus.count(), owner.cycle->loop().cycles)
      << "its wait for the server is no work";
}

bool same(const hal::Image& a, const hal::Image& b) {
  return std::ranges::equal(a.bytes(), b.bytes());
}

/// The first field that differs.
std::string difference_of(const hal::Image& a, const hal::Image& b) {
  for (const hal::Field& field : a.layout().fields()) {
    const std::size_t size = field.count * hal::size_of(field.type);
    if (std::memcmp(a.bytes().data() + field.offset, b.bytes().data() + field.offset, size) != 0) {
      return field.name;
    }
  }
  return {};
}

void expect_same(const Record& a, const Record& b, std::uint64_t running = kRunning) {
  ASSERT_EQ(a.cycles().size(), b.cycles().size());
  ASSERT_GT(a.cycles().size(), running + kSettling);
  for (std::size_t i = 0; i < a.cycles().size(); ++i) {
    const Record::Cycle& one = a.cycles()[i];
    const Record::Cycle& other = b.cycles()[i];
    ASSERT_EQ(one.phase, other.phase) << "cycle " << i;
    ASSERT_EQ(difference_of(one.state, other.state), "") << "cycle " << i;
    ASSERT_EQ(difference_of(one.command, other.command), "") << "cycle " << i;
    ASSERT_EQ(difference_of(one.truth, other.truth), "") << "cycle " << i;
  }
}

TEST(LockstepLink, IsTheRunInOneProcessBitForBit) {
  Record here(hal::test::fake_robot()), there(hal::test::fake_robot());
  in_process(here, 0);
  over_the_link(there, 0);
  expect_same(here, there);
}

TEST(LockstepLink, WithADelayIsTheDelayedRunInOneProcess) {
  Record here(hal::test::fake_robot()), there(hal::test::fake_robot());
  Record undelayed(hal::test::fake_robot());
  in_process(here, 3);
  over_the_link(there, 3);
  expect_same(here, there);
  in_process(undelayed, 0);
  EXPECT_FALSE(same(here.cycles().back().state, undelayed.cycles().back().state));
}

TEST(LockstepLink, IsTheSameWhereJointsSagAndTheRunEndsWhileTheyGoOver) {
  for (const std::uint32_t delay : {0U, 3U}) {
    for (const std::uint64_t running : {1U, 2U, 5U, 30U, 90U, 150U}) {
      SCOPED_TRACE(std::to_string(running) + " cycles, delay " + std::to_string(delay));
      Record here(hal::test::fake_robot()), there(hal::test::fake_robot());
      in_process(here, delay, running, 0.02);
      over_the_link(there, delay, running, 0.02);
      expect_same(here, there, running);
    }
  }
}

TEST(LockstepLink, AnOwnersGainsAreTheServedRobots) {
  Served served({.lockstep = true,
                 .ends_with_owner = true,
                 .lease_timeout_s = 30.0,
                 .lockstep_timeout_s = 20.0,
                 .on_lost = hal::StopCategory::kCategory1});
  served.begin();
  ClientConfig config;
  config.lockstep = true;
  Owner owner(config, {.running_cycles = 20});
  hal::ParameterImage& gains = owner.host->gains();
  const hal::PidGains soft{.kp = 0.5, .ki = 0.0, .kd = 12.5};
  ASSERT_NE(gains.gains(1, hal::PidLoop::kPosition), soft);
  gains.set_gains(1, hal::PidLoop::kPosition, soft);
  owner.cycle->run();
  served.join();
  EXPECT_TRUE(owner.cycle->faults().empty());
  for (std::size_t j = 0; j < gains.joints(); ++j) {
    for (std::size_t i = 0; i < hal::kPidLoops; ++i) {
      const auto loop = static_cast<hal::PidLoop>(i);
      EXPECT_EQ(served.host->gains().gains(j, loop), gains.gains(j, loop)) << j << ", loop " << i;
    }
  }
}

}  // namespace
}  // namespace tandem::remote
