// The emulated slaves' clocks: time stamps, delays, regulation, SYNC0.
#include <gtest/gtest.h>

#include <cstdlib>

#include "firmware_emu/slaves/dc_clock.hpp"
#include "tests/ethercat/line_rig.hpp"

namespace tandem::test {
namespace {

using ethercat::Command;
using ethercat::register_address;
using firmware::esc::DcClock;
namespace reg = ethercat::reg;

TEST(DcClock, DriftsByItsPartsPerMillion) {
  const DcClock fast({.drift_ppm = 100.0, .started_ns = 5});
  EXPECT_EQ(fast.local(1'000'000'000), 1'000'100'005);
  const DcClock slow({.drift_ppm = -100.0});
  EXPECT_EQ(slow.local(3'600'000'000'000), 3'599'640'000'000);
}

TEST(DcClock, JitterStaysWithinItsSizeAndFollowsItsSeed) {
  DcClock first({.jitter_ns = 50, .seed = 7});
  DcClock same({.jitter_ns = 50, .seed = 7});
  DcClock other({.jitter_ns = 50, .seed = 8});
  bool differs = false;
  std::int64_t most = 0;
  for (std::int64_t now = 0; now < 1000; ++now) {
    const std::int64_t stamp = first.stamp(now);
    EXPECT_EQ(stamp, same.stamp(now));
    differs |= stamp != other.stamp(now);
    most = std::max(most, std::abs(stamp - now));
  }
  EXPECT_TRUE(differs);
  EXPECT_GT(most, 40);
  EXPECT_LE(most, 50);
}

TEST(Dc, ALatchStampsBothPortsByTheWayOfTheFrame) {
  LineRig rig(3);
  rig.now_ns = 1'000'000;
  rig.pass(Command::kBwr, register_address(0, reg::kReceiveTime), Bytes(4, 0));
  const auto port = [&](std::size_t slave, std::uint16_t number) {
    return rig.value<std::uint32_t>(slave,
                                    static_cast<std::uint16_t>(reg::kReceiveTime + 4 * number));
  };
  EXPECT_EQ(port(0, 0), 1'000'300u);
  EXPECT_EQ(port(0, 1) - port(0, 0), 4u * 300);
  EXPECT_EQ(port(1, 1) - port(1, 0), 2u * 300);
  EXPECT_EQ(port(2, 1), 0u) << "nothing is behind the last one";
  EXPECT_EQ(rig.value<std::int64_t>(0, reg::kReceiveTimeLocal), 1'000'300);
}

TEST(Dc, ADriftingClockFollowsTheReference) {
  auto setup = rig_setup();
  auto drifting = setup;
  drifting.clock = {.drift_ppm = 80.0, .jitter_ns = 10, .started_ns = 700, .seed = 3};
  LineRig rig(std::vector{setup, drifting});
  rig.write(0, reg::kStation, {1, 0});
  rig.write(1, reg::kTimeDelay, LineRig::bytes<std::uint32_t>(300));
  std::int64_t first = 0;
  std::int64_t worst_late = 0;
  for (int cycle = 0; cycle < 2000; ++cycle) {
    rig.step();
    const auto answer =
        rig.pass(Command::kFrmw, register_address(1, reg::kSystemTime), Bytes(8, 0));
    EXPECT_EQ(answer.counter, 2);
    const auto raw = rig.value<std::uint32_t>(1, reg::kTimeDifference);
    const std::int64_t size = raw & 0x7FFFFFFF;
    if (cycle == 0) first = size;
    if (cycle >= 1000) worst_late = std::max(worst_late, size);
  }
  EXPECT_GT(first, 600);
  EXPECT_LT(worst_late, 60);
}

TEST(Dc, ASlaveWithoutClockHasNoneOfItsRegisters) {
  auto setup = rig_setup();
  setup.has_dc = false;
  LineRig rig(1, setup);
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kFeatures), 0);
  EXPECT_EQ(rig.read(0, reg::kSystemTime, 8).counter, 0);
  EXPECT_EQ(rig.write(0, reg::kReceiveTime, Bytes(4, 0)), 0);
}

TEST(Dc, Sync0BeginsAtItsStartAndComesEveryCycle) {
  LineRig rig(1);
  auto& controller = rig.slaves[0]->slave->controller();
  rig.write(0, reg::kSync0Cycle, LineRig::bytes<std::uint32_t>(kMs));
  rig.write(0, reg::kSyncStart, LineRig::bytes<std::uint64_t>(5 * kMs));
  rig.write(0, reg::kSyncActivation, {3});
  rig.step(4 * kMs);
  EXPECT_EQ(controller.sync0_pulses(), 0u);
  rig.step(kMs);
  EXPECT_EQ(controller.sync0_pulses(), 1u);
  rig.step(10 * kMs);
  EXPECT_EQ(controller.sync0_pulses(), 11u);
  rig.write(0, reg::kSyncActivation, {0});
  rig.write(0, reg::kSyncActivation, {3});
  rig.step(kMs);
  EXPECT_EQ(controller.sync0_pulses(), 0u) << "a start in the past is missed";
}

}  // namespace
}  // namespace tandem::test
