// What goes wrong with a bus: each is a state with a cause, and is over when its cause is.
#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <array>

#include "tests/hil/slcan_adapter.hpp"
#include "tests/hil/socket_can_rig.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using canopen::make_frame;
using test::RawCan;
using test::SlcanAdapter;
using test::VirtualCan;

const Frame kSync{.id = 0x80};

/// Lets the bus see what has happened. @return whether it came to this state.
bool reaches(const Rig& rig, BusState state) {
  return test::eventually([&] {
    (void)rig.receive();
    return rig.bus().state() == state;
  });
}

bool says(const Rig& rig, const std::string& words) {
  const std::string text = rig.bus().status_text();
  return text.find(rig.bus().interface()) != std::string::npos &&
         text.find(words) != std::string::npos;
}

/// Cycles on a bus that is away cost nothing but a look in 100 ms, a few calls each: over three
/// such times, and over enough cycles on a machine that is slow.
void expect_no_flood(const Rig& rig) {
  const std::int64_t begin = clock_ns(CLOCK_MONOTONIC);
  const std::uint64_t calls = rig.bus().system_calls();
  const std::uint64_t refused = rig.bus().statistics().send_refused;
  std::uint64_t cycles = 0;
  while (clock_ns(CLOCK_MONOTONIC) < begin + 3 * SocketCanBus::kRetryNs || cycles <= 100U) {
    EXPECT_EQ(rig.send({kSync, kSync}), 0U);
    EXPECT_TRUE(rig.receive().empty());
    ++cycles;
  }
  const std::int64_t looks = (clock_ns(CLOCK_MONOTONIC) - begin) / SocketCanBus::kRetryNs + 1;
  EXPECT_LE(rig.bus().system_calls() - calls, static_cast<std::uint64_t>(6 * looks));
  EXPECT_EQ(rig.bus().statistics().send_refused - refused, 2 * cycles);
}

/// Frames pass in both directions.
void expect_works(const Rig& rig) {
  const RawCan other(rig.bus().interface());
  EXPECT_EQ(rig.bus().status_text(), "");
  EXPECT_EQ(rig.send({kSync}), 1U);
  canfd_frame seen;
  EXPECT_EQ(other.read(seen), CAN_MTU);
  EXPECT_EQ(seen.can_id, 0x80U);
  other.write(0x70A, {5});
  EXPECT_EQ(rig.wait(1).size(), 1U);
}

TEST(SocketCanState, InterfaceThatGoesDownComesUpAgain) {
  const VirtualCan can("hil0");
  const Rig rig("hil0", SocketSide::kMaster);
  can.set("down");
  ASSERT_TRUE(reaches(rig, BusState::kDown));
  EXPECT_TRUE(says(rig, "is down (sudo ip link set hil0 up"));
  expect_no_flood(rig);
  can.set("up");
  ASSERT_TRUE(reaches(rig, BusState::kActive));
  expect_works(rig);
  EXPECT_EQ(rig.bus().statistics().recoveries, 1U);
}

TEST(SocketCanState, SendingAloneSeesThatTheInterfaceIsDownAndBack) {
  const VirtualCan can("hil0");
  const Rig rig("hil0", SocketSide::kMaster);
  can.set("down");
  EXPECT_EQ(rig.send({kSync}), 0U);
  EXPECT_EQ(rig.bus().state(), BusState::kDown);
  can.set("up");
  EXPECT_TRUE(test::eventually([&] { return rig.send({kSync}) == 1; }));
  EXPECT_EQ(rig.bus().state(), BusState::kActive);
}

TEST(SocketCanState, RemovedInterfaceComesBackUnderItsName) {
  VirtualCan can("hil0");
  const Rig rig("hil0", SocketSide::kMaster);
  can.remove();
  ASSERT_TRUE(reaches(rig, BusState::kGone));
  EXPECT_TRUE(says(rig, "was removed"));
  expect_no_flood(rig);
  const VirtualCan between("hil1");  // takes the number that the interface had, if it can
  can.add();
  ASSERT_TRUE(reaches(rig, BusState::kActive));
  expect_works(rig);
  EXPECT_EQ(rig.bus().statistics().recoveries, 1U);
}

TEST(SocketCanState, InterfaceThatComesBackClassicIsNotUsedForFd) {
  VirtualCan can("hil0");
  const Rig rig("hil0", SocketSide::kMaster);
  can.remove();
  can.add(16);
  ASSERT_TRUE(reaches(rig, BusState::kDown));
  ASSERT_TRUE(test::eventually([&] {
    (void)rig.receive();
    return says(rig, "classic frames only");
  }));
  can.set("down");
  can.set("mtu 72 up");
  ASSERT_TRUE(reaches(rig, BusState::kActive));
  expect_works(rig);
}

TEST(SocketCanState, WhatWaitedSinceBeforeTheLossIsNotGivenAfterIt) {
  const VirtualCan can("hil0");
  const Rig rig("hil0", SocketSide::kMaster);
  can.set("down");
  EXPECT_EQ(rig.send({kSync}), 0U);
  can.set("up");
  const RawCan other("hil0");
  other.write(0x70A, {5});  // while the bus still believes that it is down
  ASSERT_TRUE(test::eventually([&] { return rig.send({kSync}) == 1; }));
  EXPECT_TRUE(rig.receive().empty());
}

TEST(SocketCanState, WaitingPassesOverABusThatIsAway) {
  const VirtualCan can("hil0");
  const Rig rig("hil0", SocketSide::kMaster);
  can.set("down");
  ASSERT_TRUE(reaches(rig, BusState::kDown));
  can.set("up");
  can.set("down");  // leaves an error at the socket that nobody has taken
  const std::array<SocketCanBus*, 1> buses{&rig.bus()};
  EXPECT_FALSE(wait_for_frames(buses, 20'000'000));
}

TEST(SocketCanState, ErrorFramesTellTheControllersState) {
  const Rig rig("can0", SocketSide::kMaster);
  const RawCan other("can0");
  const auto error_frame = [&](std::uint32_t classes, std::uint8_t controller) {
    other.write(CAN_ERR_FLAG | classes, {0, controller, 0, 0, 0, 0, 0, 0});
  };
  error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE);
  ASSERT_TRUE(reaches(rig, BusState::kErrorPassive));
  EXPECT_TRUE(says(rig, "is error-passive"));
  EXPECT_EQ(rig.send({kSync}), 1U) << "still works";
  error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE);
  ASSERT_TRUE(reaches(rig, BusState::kActive));

  error_frame(CAN_ERR_BUSOFF, 0);
  ASSERT_TRUE(reaches(rig, BusState::kBusOff));
  EXPECT_TRUE(says(rig, "is bus-off"));
  const std::uint64_t calls = rig.bus().system_calls();
  EXPECT_EQ(rig.send({kSync, kSync}), 0U);
  EXPECT_EQ(rig.bus().system_calls(), calls);
  EXPECT_EQ(rig.bus().statistics().send_refused, 2U);
  error_frame(CAN_ERR_RESTARTED, 0);
  ASSERT_TRUE(reaches(rig, BusState::kActive));
  EXPECT_EQ(rig.bus().statistics().error_frames, 4U);
  EXPECT_EQ(rig.bus().statistics().recoveries, 1U) << "error-passive was no loss";
  expect_works(rig);
}

TEST(SocketCanState, AFrameOfANodeEndsBusOff) {
  const Rig rig("can0", SocketSide::kMaster);
  const RawCan other("can0");
  other.write(CAN_ERR_FLAG | CAN_ERR_BUSOFF, std::vector<std::uint8_t>(8));
  ASSERT_TRUE(reaches(rig, BusState::kBusOff));
  other.write(0x70A, {5});
  EXPECT_EQ(rig.wait(1).size(), 1U);
  EXPECT_EQ(rig.bus().state(), BusState::kActive);
}

TEST(SocketCanState, AFloodOfErrorFramesDoesNotHoldTheCycle) {
  const Rig rig({.interface = "can0", .receive_queue = 1024});
  const RawCan other("can0");
  for (int i = 0; i < 600; ++i) {
    other.write(CAN_ERR_FLAG | CAN_ERR_PROT | CAN_ERR_BUSERROR, std::vector<std::uint8_t>(8));
  }
  std::array<Frame, 8> frames;
  EXPECT_EQ(rig.bus().receive(frames), 0U);
  EXPECT_LT(rig.bus().statistics().error_frames, 300U) << "the rest waits for the next cycle";
  EXPECT_EQ(rig.bus().state(), BusState::kActive) << "an error is no state";
}

/// A driver of the kernel's CAN device layer, with a transmit queue and a controller's states. The
/// test is the adapter.
class SocketCanSlcan : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string reason = adapter_.open(); !reason.empty()) GTEST_SKIP() << reason;
    rig_ = std::make_unique<Rig>(adapter_.interface(), SocketSide::kMaster, false);
  }

  SlcanAdapter adapter_;
  std::unique_ptr<Rig> rig_;
};

TEST_F(SocketCanSlcan, PassesFramesToTheAdapterAndBack) {
  EXPECT_EQ(rig_->send({make_frame(0x60A, std::array<std::uint8_t, 2>{0xAA, 0x0B})}), 1U);
  EXPECT_EQ(adapter_.read(10), "t60A2AA0B\r");
  adapter_.write("t70A105\r");
  const auto in = rig_->wait(1);
  ASSERT_EQ(in.size(), 1U);
  EXPECT_EQ(in[0], make_frame(0x70A, std::array<std::uint8_t, 1>{5}));
}

TEST_F(SocketCanSlcan, FollowsTheControllerToErrorPassiveAndBack) {
  adapter_.write("sp130140\r");
  ASSERT_TRUE(reaches(*rig_, BusState::kErrorPassive));
  EXPECT_TRUE(says(*rig_, "is error-passive"));
  adapter_.write("sa001000\r");
  ASSERT_TRUE(reaches(*rig_, BusState::kActive));
  EXPECT_EQ(rig_->bus().statistics().error_frames, 2U);
}

TEST_F(SocketCanSlcan, LeavesBusOffWhenItIsTakenDownAndUp) {
  adapter_.write("sb255001\r");
  ASSERT_TRUE(reaches(*rig_, BusState::kBusOff));
  EXPECT_EQ(rig_->send({kSync}), 0U);
  test::shell("ip link set " + adapter_.interface() + " down");
  ASSERT_TRUE(reaches(*rig_, BusState::kDown));
  test::shell("ip link set " + adapter_.interface() + " up");
  ASSERT_TRUE(reaches(*rig_, BusState::kActive));
  EXPECT_EQ(rig_->bus().statistics().recoveries, 1U);
  EXPECT_EQ(rig_->send({kSync}), 1U);
  EXPECT_EQ(adapter_.read(6), "t0800\r");
}

TEST_F(SocketCanSlcan, LosesAndCountsWhatTheTransmitQueueDoesNotTake) {
  const std::vector<Frame> burst(200, kSync);
  const std::size_t taken = rig_->send(burst);
  ASSERT_LT(taken, burst.size());
  const BusStatistics statistics = rig_->bus().statistics();
  EXPECT_EQ(statistics.sent, taken);
  EXPECT_EQ(statistics.send_refused, burst.size() - taken);
  EXPECT_EQ(statistics.queue_full, 1U) << "the rest was not tried";
  EXPECT_EQ(rig_->bus().state(), BusState::kOverloaded);
  EXPECT_TRUE(says(*rig_, "transmit queue is full"));
  EXPECT_EQ(adapter_.read(6 * taken).size(), 6 * taken) << "what was taken has gone out";
  ASSERT_TRUE(reaches(*rig_, BusState::kActive));
  EXPECT_EQ(rig_->send({kSync}), 1U);
}

TEST_F(SocketCanSlcan, GoesAndStaysAwayWithItsAdapter) {
  adapter_.unplug();
  ASSERT_TRUE(reaches(*rig_, BusState::kGone));
  EXPECT_TRUE(says(*rig_, "was removed"));
  expect_no_flood(*rig_);
}

}  // namespace
}  // namespace tandem::hal::can
