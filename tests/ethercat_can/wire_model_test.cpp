#include "hal/ethercat-can/wire_model.hpp"

#include <gtest/gtest.h>

#include "base/archive.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;

constexpr BitRates kClassic{.nominal = 1'000'000, .data = 1'000'000};

Frame frame_of(std::uint32_t id, std::size_t bytes = 8) {
  Frame frame;
  frame.id = id;
  frame.length = canopen::frame_length(bytes);
  if (bytes > 8) frame.flags = canopen::kFlagFd | canopen::kFlagBrs;
  frame.data.fill(0);
  for (std::size_t i = 0; i < bytes; ++i) frame.data[i] = 0x55;
  return frame;
}

/// Time on the wire with intermission.
std::int64_t takes_ns(const Frame& frame) { return duration_ns(exact_frame_bits(frame), kClassic); }

struct Seen {
  std::uint32_t id;
  std::int64_t complete_ns;
  bool operator==(const Seen&) const = default;
};

std::vector<Seen> run(WireModel& wire, std::int64_t until_ns) {
  std::vector<Seen> seen;
  WireModel::Delivery delivery;
  while (wire.next(until_ns, delivery)) {
    seen.push_back({delivery.frame.id, delivery.complete_ns});
  }
  return seen;
}

std::vector<std::uint32_t> ids(const std::vector<Seen>& seen) {
  std::vector<std::uint32_t> out;
  for (const Seen& one : seen) out.push_back(one.id);
  return out;
}

TEST(WireModel, TheLowestIdentifierGoesFirst) {
  WireModel wire(kClassic, 4);
  wire.push(0, frame_of(0x301), 0);
  wire.push(1, frame_of(0x182), 0);
  wire.push(2, frame_of(0x181), 0);
  wire.push(3, frame_of(0x080, 0), 0);
  EXPECT_EQ(ids(run(wire, 1'000'000)), (std::vector<std::uint32_t>{0x080, 0x181, 0x182, 0x301}));
  EXPECT_EQ(wire.waiting(), 0u);
}

TEST(WireModel, FramesFollowOneAnotherWithTheIntermissionBetween) {
  WireModel wire(kClassic, 2);
  const Frame first = frame_of(0x181);
  const Frame second = frame_of(0x201);
  wire.push(0, first, 10'000);
  wire.push(1, second, 10'000);
  const std::int64_t free_ns = 10'000 + takes_ns(first);
  EXPECT_EQ(run(wire, 1'000'000), (std::vector<Seen>{{0x181, free_ns - 3'000},
                                                     {0x201, free_ns + takes_ns(second) - 3'000}}));
}

TEST(WireModel, AClassicFrameTakesItsBitsAtItsRate) {
  // SYNC: 47 bits, and the stuff bits of its zeros.
  WireModel wire({.nominal = 500'000, .data = 500'000}, 1);
  const Frame sync = frame_of(0x080, 0);
  wire.push(0, sync, 0);
  const int bits = exact_frame_bits(sync).nominal;
  EXPECT_EQ(run(wire, 1'000'000), (std::vector<Seen>{{0x080, (bits - 3) * 2'000}}));
}

TEST(WireModel, NothingInterruptsAFrame) {
  WireModel wire(kClassic, 2);
  wire.push(0, frame_of(0x701), 0);
  wire.push(1, frame_of(0x080, 0), 1'000);
  EXPECT_EQ(ids(run(wire, 1'000'000)), (std::vector<std::uint32_t>{0x701, 0x080}));
}

TEST(WireModel, AnUrgentFrameOfTheMasterWaitsBehindItsOwnQueue) {
  WireModel wire(kClassic, 2);
  wire.push(0, frame_of(0x501), 0);
  wire.push(0, frame_of(0x080, 0), 0);
  wire.push(1, frame_of(0x181), 0);
  wire.push(1, frame_of(0x481), 0);
  EXPECT_EQ(ids(run(wire, 1'000'000)), (std::vector<std::uint32_t>{0x181, 0x481, 0x501, 0x080}));
}

TEST(WireModel, ABoardSendsTheLowestIdentifierOfItsMailboxesFirst) {
  WireModel wire(kClassic, 2);
  wire.push(1, frame_of(0x701), 0);
  wire.push(1, frame_of(0x281), 0);
  wire.push(1, frame_of(0x181, 1), 0);
  wire.push(1, frame_of(0x181, 2), 0);
  WireModel::Delivery delivery;
  std::vector<std::pair<std::uint32_t, int>> seen;
  while (wire.next(1'000'000, delivery)) {
    seen.emplace_back(delivery.frame.id, delivery.frame.length);
  }
  EXPECT_EQ(seen, (std::vector<std::pair<std::uint32_t, int>>{
                      {0x181, 1}, {0x181, 2}, {0x281, 8}, {0x701, 8}}));
}

TEST(WireModel, WhatIsNotCompleteKeepsTheWireAndComesLater) {
  WireModel wire(kClassic, 2);
  const Frame frame = frame_of(0x201);
  wire.push(0, frame, 0);
  const std::int64_t complete_ns = takes_ns(frame) - 3'000;
  EXPECT_TRUE(run(wire, complete_ns - 1).empty());
  EXPECT_EQ(wire.waiting(), 1u);
  wire.push(1, frame_of(0x080, 0), complete_ns - 1);
  EXPECT_EQ(ids(run(wire, complete_ns)), std::vector<std::uint32_t>{0x201});
  EXPECT_EQ(ids(run(wire, 1'000'000)), std::vector<std::uint32_t>{0x080});
}

TEST(WireModel, WhoIsReadyAtTheSameTimeTakesPartInTheArbitration) {
  WireModel wire(kClassic, 2);
  wire.push(0, frame_of(0x201), 1'000'000);
  EXPECT_TRUE(run(wire, 1'000'000).empty());
  wire.push(1, frame_of(0x181), 1'000'000);
  EXPECT_EQ(ids(run(wire, 2'000'000)), (std::vector<std::uint32_t>{0x181, 0x201}));
}

TEST(WireModel, LatencyIsBeforeTheArbitration) {
  WireModel wire(kClassic, 1, 20'000);
  const Frame frame = frame_of(0x181);
  wire.push(0, frame, 5'000);
  EXPECT_EQ(run(wire, 1'000'000), (std::vector<Seen>{{0x181, 25'000 + takes_ns(frame) - 3'000}}));
}

TEST(WireModel, DropsAndCountsWhatAQueueDoesNotHold) {
  WireModel wire(kClassic, 1, 0, 2);
  EXPECT_TRUE(wire.push(0, frame_of(0x181), 0));
  EXPECT_TRUE(wire.push(0, frame_of(0x182), 0));
  EXPECT_FALSE(wire.push(0, frame_of(0x183), 0));
  EXPECT_EQ(wire.dropped(), 1u);
  EXPECT_EQ(run(wire, 1'000'000).size(), 2u);
}

TEST(WireModel, ASnapshotGoesOnAsTheSameFrames) {
  WireModel wire(kClassic, 2);
  for (std::uint32_t i = 0; i < 5; ++i) wire.push(i % 2, frame_of(0x181 + i), 1'000 * i);
  EXPECT_EQ(run(wire, 200'000).size(), 1u);
  Archive out;
  wire.archive(out);
  WireModel other(kClassic, 2);
  Archive in(out.bytes());
  other.archive(in);
  EXPECT_TRUE(in.at_end());
  EXPECT_EQ(run(wire, 2'000'000), run(other, 2'000'000));
}

}  // namespace
}  // namespace tandem::hal::can
