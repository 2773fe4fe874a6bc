// The survey of a line: what it finds, and that it moves nothing.
#include <gtest/gtest.h>

#include <poll.h>
#include <atomic>
#include <thread>

#include "hal/ethercat-can/line/in_process_link.hpp"
#include "hal/ethercat-can/line/line_survey.hpp"
#include "hal/ethercat-can/line/packet_link.hpp"
#include "rt/clock.hpp"
#include "tests/ethercat/master_rig.hpp"
#include "tests/ethercat/own_network.hpp"
#include "tests/ethercat/spoilt_memory.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::test {
namespace {

using hal::ecat::FrameBuffer;
using hal::ecat::InProcessLink;
using hal::ecat::LineSurvey;
using hal::ecat::PacketLink;
using hal::ecat::survey_line;
using hal::ecat::SurveyTiming;
namespace reg = ethercat::reg;

/// Surveys the rig's slaves in process, in their own time.
LineSurvey survey(LineRig& rig, InProcessLink& link, const SurveyTiming& timing = {}) {
  return survey_line(link, timing, [&](std::int64_t at_most_ns) {
    rig.step(at_most_ns);
    link.set_time(rig.now_ns);
    return rig.now_ns;
  });
}

LineSurvey survey(LineRig& rig) {
  InProcessLink link(*rig.line);
  return survey(rig, link);
}

TEST(Survey, FindsTheSlavesWithTheirIdentitiesDelaysAndClocks) {
  LineRig rig(MasterRig::setups(5));
  const LineSurvey found = survey(rig);
  EXPECT_EQ(found.found, 5u);
  EXPECT_EQ(found.reference, 0u);
  EXPECT_EQ(found.repeated, 0u);
  ASSERT_EQ(found.slaves.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto& slave = found.slaves[i];
    EXPECT_TRUE(slave.identified);
    EXPECT_EQ(slave.identity.vendor, ethercat::sii::kNobodysVendor);
    EXPECT_EQ(slave.identity.product, 0x11u);
    EXPECT_EQ(slave.identity.revision, 0x22u);
    EXPECT_EQ(slave.samples, i == 0 ? 0u : 200u);
    EXPECT_NEAR(slave.delay_ns, 300.0 * static_cast<double>(i), 20.0) << "stamps jitter";
    if (i == 0) continue;
    EXPECT_GT(slave.difference_ns, 0) << "the rig's clocks drift and jitter";
    EXPECT_LE(slave.difference_ns, 100);
    EXPECT_GT(slave.jitter_ns, 0.0);
    EXPECT_LE(slave.jitter_ns, static_cast<double>(slave.difference_ns));
  }
  for (auto& slave : rig.slaves) {
    EXPECT_EQ(slave->controlword, 0);
    EXPECT_EQ(slave->slave->state(), ethercat::AlState::kInit);
  }
  EXPECT_EQ(rig.value<std::uint16_t>(2, reg::kStation), 0) << "no address is given";
}

TEST(Survey, ShowsTheJitterOfAWorseClock) {
  auto setups = MasterRig::setups(3);
  setups[2].clock.jitter_ns = 400;
  LineRig rig(setups);
  const LineSurvey found = survey(rig);
  ASSERT_EQ(found.slaves.size(), 3u);
  EXPECT_GT(found.slaves[2].jitter_ns, 5.0 * found.slaves[1].jitter_ns);
  EXPECT_GT(found.slaves[2].difference_ns, 100);
}

TEST(Survey, CountsFewerSlavesBehindACutCable) {
  LineRig rig(MasterRig::setups(4));
  rig.line->set_cable(2, false);
  EXPECT_EQ(survey(rig).found, 2u);
  rig.line->set_cable(0, false);
  const LineSurvey none = survey(rig);
  EXPECT_EQ(none.found, 0u);
  EXPECT_TRUE(none.slaves.empty());
}

TEST(Survey, TakesTheFirstSlaveWithAClockForTheReference) {
  auto setups = MasterRig::setups(3);
  setups[0].has_dc = false;
  LineRig rig(setups);
  const LineSurvey found = survey(rig);
  EXPECT_EQ(found.reference, 1u);
  EXPECT_EQ(found.slaves[0].samples, 0u);
  EXPECT_EQ(found.slaves[2].samples, 200u);
  for (auto& setup : setups) setup.has_dc = false;
  LineRig without(setups);
  EXPECT_EQ(survey(without).reference, 3u) << "none";
}

TEST(Survey, FindsAMemoryWhoseCheckSumIsWrong) {
  LineRig rig(MasterRig::setups(3));
  for (const auto& slave : survey(rig).slaves) EXPECT_TRUE(slave.settings_right);
  SpoiltMemory spoilt(*rig.line);
  InProcessLink link(spoilt);
  const LineSurvey found = survey(rig, link);
  ASSERT_EQ(found.slaves.size(), 3u);
  for (const auto& slave : found.slaves) {
    EXPECT_TRUE(slave.identified);
    EXPECT_FALSE(slave.settings_right);
  }
}

TEST(Survey, SendsNothingWhileFramesPass) {
  LineRig rig(2);
  Tamper tamper(*rig.line);
  InProcessLink link(tamper);
  FrameBuffer frame;
  ethercat::FrameWriter writer;
  writer.begin(frame.bytes, link.address());  // even of a program that shares the interface
  (void)writer.add(ethercat::Command::kBrd, 1, 0, 1);
  frame.size = writer.finish();
  const std::array frames{frame};
  bool sent = false;
  const auto found = survey_line(link, {}, [&](std::int64_t at_most_ns) {
    rig.step(at_most_ns);
    if (!std::exchange(sent, rig.now_ns > 10 * kMs) && rig.now_ns > 10 * kMs) link.send(frames);
    return rig.now_ns;
  });
  EXPECT_EQ(found.strangers, 1u);
  EXPECT_EQ(found.found, 0u);
  EXPECT_EQ(link.statistics().sent, 1u) << "the other one's";
}

TEST(Survey, LeavesTheClocksOfSlavesThatAreNotInInit) {
  LineRig rig(2);
  rig.set_mailboxes(1);
  ASSERT_EQ(rig.request(1, 2).first, 2);
  const LineSurvey found = survey(rig);
  EXPECT_EQ(found.states, 3) << "INIT and PREOP";
  EXPECT_TRUE(found.slaves[1].identified);
  EXPECT_EQ(found.slaves[1].samples, 0u);
  EXPECT_EQ(rig.value<std::uint64_t>(1, reg::kTimeOffset), 0u);
  EXPECT_EQ(rig.value<std::uint16_t>(1, reg::kAlStatus), 2);
}

TEST(Survey, AsksAgainForWhatWasLost) {
  LineRig rig(MasterRig::setups(3));
  InProcessLink link(*rig.line);
  link.set_fate(hal::ecat::FrameFate::kLoseAfter, 2);
  const LineSurvey found = survey(rig, link);
  EXPECT_EQ(found.found, 3u);
  EXPECT_EQ(found.repeated, 2u);
  EXPECT_EQ(found.slaves[2].samples, 200u);
}

TEST(Survey, OverACableFindsTheSameSlaves) {
  const int status = in_own_network([] {
    auto near = PacketLink::open(kMasterEnd);
    auto far = PacketLink::open(kSlaveEnd);
    ASSERT_TRUE(near && far);
    LineRig rig(MasterRig::setups(4));
    rt::WallClock clock;
    std::atomic<bool> over = false;
    std::thread line([&] {
      std::vector<FrameBuffer> frames(8);
      while (!over) {
        pollfd ready{.fd = (*far)->descriptor(), .events = POLLIN, .revents = 0};
        (void)::poll(&ready, 1, 1);
        const std::size_t count = (*far)->receive(frames);
        for (std::size_t i = 0; i < count; ++i) {
          rig.line->pass(frames[i].frame(), clock.now_ns());
        }
        (void)(*far)->send(std::span(frames).first(count));
        rig.line->process(clock.now_ns());
      }
    });
    const LineSurvey found = survey_line(**near, {.cycles = 20}, [&](std::int64_t at_most_ns) {
      pollfd ready{.fd = (*near)->descriptor(), .events = POLLIN, .revents = 0};
      (void)::poll(&ready, 1, static_cast<int>((at_most_ns + kMs - 1) / kMs));
      return clock.now_ns();
    });
    over = true;
    line.join();
    EXPECT_EQ(found.strangers, 0u);
    EXPECT_EQ(found.found, 4u);
    ASSERT_EQ(found.slaves.size(), 4u);
    EXPECT_EQ(found.slaves[3].identity.product, 0x11u);
    EXPECT_NEAR(found.slaves[3].delay_ns, 900.0, 20.0);
    EXPECT_GT(found.slaves[3].samples, 0u);
  });
  if (status == kNoNetwork) GTEST_SKIP() << needs_root("a network of its own");
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace tandem::test
