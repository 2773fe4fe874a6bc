// The socket on a real CAN stack: opening, frames both ways, filters, time-stamps, waiting.
#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <set>
#include <thread>

#include "canopen/objects.hpp"
#include "tests/hil/socket_can_rig.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using canopen::make_frame;
using test::RawCan;
using test::VirtualCan;

constexpr auto kMs = std::int64_t{1'000'000};

/// The error's text; every one names the interface and the next step.
std::string refusal(const SocketCanOptions& options) {
  const auto bus = SocketCanBus::open(options);
  if (bus) return "was opened";
  EXPECT_NE(bus.error().message.find(options.interface), std::string::npos);
  EXPECT_FALSE(bus.error().hint.empty());
  return bus.error().to_string();
}

TEST(SocketCanOpen, SaysWhatIsWrongWithTheInterface) {
  EXPECT_NE(refusal({.interface = "can77"}).find("no such interface"), std::string::npos);
  EXPECT_NE(refusal({.interface = "lo"}).find("no CAN interface"), std::string::npos);
  EXPECT_NE(refusal({.interface = "a_name_too_long_"}).find("15 characters"), std::string::npos);
}

TEST(SocketCanOpen, WantsTheInterfaceUpAndWideEnough) {
  const VirtualCan can("hil0", 16);
  const std::string narrow = refusal({.interface = "hil0"});
  EXPECT_NE(narrow.find("classic frames only"), std::string::npos) << narrow;
  EXPECT_NE(narrow.find("hil0 mtu 72"), std::string::npos) << narrow;
  EXPECT_TRUE(SocketCanBus::open({.interface = "hil0", .fd = false}));
  can.set("down");
  const std::string down = refusal({.interface = "hil0", .fd = false});
  EXPECT_NE(down.find("is down (sudo ip link set hil0 up"), std::string::npos) << down;
}

TEST(SocketCan, WritesTheBytesOfAClassicFrame) {
  const Rig rig("can0", SocketSide::kMaster);
  const RawCan witness("can0");
  EXPECT_EQ(rig.send({make_frame(0x605, std::array<std::uint8_t, 2>{0xAA, 0xBB})}), 1U);
  canfd_frame seen;
  ASSERT_EQ(witness.read(seen), CAN_MTU);
  EXPECT_EQ(seen.can_id, 0x605U);
  EXPECT_EQ(seen.len, 2);
  EXPECT_EQ(seen.data[0], 0xAA);
  EXPECT_EQ(seen.data[1], 0xBB);
}

TEST(SocketCan, WritesAndReadsSixtyFourBytesWithRateSwitch) {
  const Rig rig("can0", SocketSide::kMaster);
  const RawCan other("can0");
  std::vector<std::uint8_t> data(64);
  for (std::size_t i = 0; i < 64; ++i) data[i] = static_cast<std::uint8_t>(255 - i);
  EXPECT_EQ(rig.send({make_frame(0x20A, data)}), 1U);
  canfd_frame seen;
  ASSERT_EQ(other.read(seen), CANFD_MTU);
  EXPECT_EQ(seen.can_id, 0x20AU);
  EXPECT_EQ(seen.flags & CANFD_BRS, CANFD_BRS);
  EXPECT_TRUE(std::equal(data.begin(), data.end(), seen.data, seen.data + seen.len));
  other.write(0x18A, data, true, CANFD_BRS);
  const auto in = rig.wait(1);
  ASSERT_EQ(in.size(), 1U);
  EXPECT_EQ(in[0], make_frame(0x18A, data));
}

TEST(SocketCan, SendsAndTakesMoreThanOneBatch) {
  const Rig master("can0", SocketSide::kMaster);
  const Rig boards("can0", SocketSide::kBoards);
  std::vector<Frame> frames;
  for (std::uint8_t i = 0; i < 150; ++i) {
    frames.push_back(make_frame(0x201, std::array<std::uint8_t, 1>{i}));
  }
  EXPECT_EQ(master.send(frames), 150U);
  EXPECT_EQ(boards.wait(150), frames) << "all, in order";
  EXPECT_EQ(master.bus().statistics().sent, 150U);
  EXPECT_EQ(boards.bus().statistics().received, 150U);
  EXPECT_TRUE(master.receive().empty()) << "nobody hears himself";
}

TEST(SocketCan, RefusesAndCountsAFrameThatCannotBeSentAndSendsTheRest) {
  const Rig master("can0", SocketSide::kMaster, false);
  const RawCan witness("can0");
  EXPECT_EQ(master.send({Frame{.id = 0x800}, make_frame(0x201, std::array<std::uint8_t, 9>{}),
                         Frame{.id = 0x80}}),
            1U);
  EXPECT_EQ(master.bus().statistics().send_refused, 2U);
  canfd_frame seen;
  ASSERT_EQ(witness.read(seen), CAN_MTU);
  EXPECT_EQ(seen.can_id, 0x80U);
}

/// The identifiers, of all there are, that this side hears.
std::set<std::uint32_t> heard(SocketSide side) {
  const Rig rig("can0", side);
  const RawCan other("can0");
  std::set<std::uint32_t> ids;
  for (std::uint32_t id = 0; id <= 0x7FF; ++id) {
    other.write(id, {});
    if (id % 64 != 63) continue;
    for (const Frame& frame : rig.receive()) ids.insert(frame.id);
  }
  return ids;
}

TEST(SocketCan, KernelLetsThroughWhatTheOtherSideSends) {
  const auto function_is = [](std::uint32_t id, std::initializer_list<std::uint32_t> functions) {
    return std::ranges::find(functions, id & 0x780) != functions.end();
  };
  std::set<std::uint32_t> of_nodes{0x100, canopen::cob::kPastAnswer};
  std::set<std::uint32_t> of_masters{0x000, 0x080, canopen::cob::kPastOrder};
  std::set<std::uint32_t> all;
  for (std::uint32_t id = 0; id <= 0x7FF; ++id) {
    all.insert(id);
    if (function_is(id, {0x180, 0x280, 0x380, 0x480, 0x580, 0x700})) of_nodes.insert(id);
    if (id > 0x080 && id < 0x100) of_nodes.insert(id);
    // every heartbeat: a board's 1016 may name any node
    if (function_is(id, {0x200, 0x300, 0x400, 0x500, 0x600, 0x700})) of_masters.insert(id);
  }
  EXPECT_EQ(heard(SocketSide::kMaster), of_nodes);
  EXPECT_EQ(heard(SocketSide::kBoards), of_masters);
  EXPECT_EQ(heard(SocketSide::kWitness), all);
  EXPECT_EQ(heard(SocketSide::kSender), std::set<std::uint32_t>{});
}

TEST(SocketCan, GivesRemoteRequestsToBoardsAloneAndNoLongIdentifiers) {
  const Rig master("can0", SocketSide::kMaster);
  const Rig boards("can0", SocketSide::kBoards);
  const Rig witness("can0", SocketSide::kWitness);
  const RawCan other("can0");
  other.write(0x181 | CAN_EFF_FLAG, {1});
  other.write(0x181 | CAN_RTR_FLAG, {});
  other.write(0x201 | CAN_RTR_FLAG, {});
  other.write(0x705 | CAN_RTR_FLAG, {});
  other.write(0x182, {2});
  const std::vector<Frame> expected{make_frame(0x182, std::array<std::uint8_t, 1>{2})};
  EXPECT_EQ(witness.wait(1), expected);
  EXPECT_EQ(master.wait(1), expected);
  EXPECT_EQ(boards.wait(2), (std::vector<Frame>{{.id = 0x181, .flags = canopen::kFlagRtr},
                                                {.id = 0x705, .flags = canopen::kFlagRtr}}))
      << "a TPDO is asked for, and a node is guarded";
  EXPECT_EQ(witness.bus().statistics().ignored, 4U);
  EXPECT_EQ(master.bus().statistics().ignored, 0U) << "the kernel kept them back";
}

TEST(SocketCan, StampsFramesOnTheLoopsClock) {
  const Rig master("can0", SocketSide::kMaster);
  const Rig boards("can0", SocketSide::kBoards);
  const std::int64_t before = clock_ns(CLOCK_MONOTONIC);
  master.send({Frame{.id = 0x80}, Frame{.id = 0x201}});
  ASSERT_EQ(boards.wait(2).size(), 2U);
  const std::int64_t after = clock_ns(CLOCK_MONOTONIC);
  const auto stamps = boards.bus().received_ns();
  ASSERT_EQ(stamps.size(), 2U);
  EXPECT_LE(before, master.bus().sent_ns());
  // The two clocks are read one after the other: they may disagree by the time between.
  EXPECT_LE(master.bus().sent_ns() - 5 * kMs, stamps[0]);
  EXPECT_LE(stamps[0], stamps[1]);
  EXPECT_LE(stamps[1], after + 5 * kMs);
  EXPECT_TRUE(boards.receive().empty());
  EXPECT_TRUE(boards.bus().received_ns().empty());
}

TEST(SocketCan, CountsWhatCameFasterThanItWasTaken) {
  const Rig small({.interface = "can0", .side = SocketSide::kWitness, .receive_queue = 8});
  const RawCan other("can0");
  for (int i = 0; i < 200; ++i) other.write(0x181, {1, 2, 3, 4, 5, 6, 7, 8});
  const std::size_t first = small.receive().size();
  EXPECT_LT(first, 200U);
  other.write(0x181, {});  // the kernel reports what was lost with the next frame
  EXPECT_EQ(small.wait(1).size(), 1U);
  EXPECT_EQ(small.bus().statistics().receive_lost, 200 - first);
  EXPECT_EQ(small.bus().state(), BusState::kOverloaded);
  EXPECT_NE(small.bus().status_text().find("received frames were lost"), std::string::npos);
  EXPECT_TRUE(test::eventually([&] {
    (void)small.receive();
    return small.bus().state() == BusState::kActive;
  }));
  EXPECT_EQ(small.bus().status_text(), "");
}

TEST(SocketCanWait, WakesForAFrameAtAnyOfItsBuses) {
  const Rig one("can0", SocketSide::kMaster);
  const Rig other("can1", SocketSide::kMaster);
  const std::array<SocketCanBus*, 2> buses{&one.bus(), &other.bus()};
  EXPECT_FALSE(wait_for_frames(buses, 5 * kMs));
  EXPECT_FALSE(wait_for_frames(buses, 0)) << "the time is over: does not wait";
  const RawCan node("can1");
  node.write(0x70A, {0});
  EXPECT_TRUE(wait_for_frames(buses, 60'000 * kMs));
  EXPECT_EQ(other.receive().size(), 1U);
}

TEST(SocketCanWait, EndsWithASignal) {
  struct sigaction action {};
  action.sa_handler = [](int) {};
  struct sigaction before {};
  ASSERT_EQ(::sigaction(SIGUSR1, &action, &before), 0);
  const Rig rig("can0", SocketSide::kMaster);
  const std::array<SocketCanBus*, 1> buses{&rig.bus()};
  std::atomic<bool> ended = false;
  std::thread signals([&ended, waiter = ::pthread_self()] {
    while (!ended) {  // one that comes before the wait does not end it
      ::pthread_kill(waiter, SIGUSR1);
      ::usleep(10'000);
    }
  });
  const std::int64_t deadline = clock_ns(CLOCK_MONOTONIC) + 60'000 * kMs;
  EXPECT_FALSE(wait_for_frames(buses, 60'000 * kMs));
  EXPECT_LT(clock_ns(CLOCK_MONOTONIC), deadline);
  ended = true;
  signals.join();
  ::sigaction(SIGUSR1, &before, nullptr);
}

}  // namespace
}  // namespace tandem::hal::can
