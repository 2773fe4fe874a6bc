#include "hal/sim/fault_injection.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "base/archive.hpp"

namespace tandem::sim {
namespace {

using canopen::Frame;
using hal::FaultKind;

Frame frame(std::uint32_t id, std::uint8_t first) {
  const std::uint8_t bytes[4] = {first, 0, 0, 0};
  return canopen::make_frame(id, bytes);
}

/// One bus with one fault; what comes out of a step, as first bytes.
struct Line {
  explicit Line(const ScenarioFault& fault, std::uint64_t seed = 1) : faults(seed) {
    EXPECT_TRUE(faults.add(fault));
  }
  std::vector<Frame> step(const std::vector<Frame>& in,
                          FrameDirection way = FrameDirection::kToMaster) {
    faults.begin_step(time_ns, -1);
    time_ns += 1'000'000;
    std::vector<Frame> got;
    Frame late;
    while (faults.next_due(way, 0, late)) got.push_back(late);
    for (const Frame& one : in) {
      std::array<Frame, FaultInjection::kMostFramesOut> room;
      canopen::FrameSink out(room);
      faults.pass(way, 0, one, out);
      got.insert(got.end(), out.frames().begin(), out.frames().end());
    }
    return got;
  }
  std::vector<int> bytes(const std::vector<Frame>& in) {
    std::vector<int> first;
    for (const Frame& one : step(in)) first.push_back(one.data[0]);
    return first;
  }

  FaultInjection faults;
  std::int64_t time_ns = 0;
};

ScenarioFault of(FaultKind kind) {
  ScenarioFault fault;
  fault.kind = kind;
  return fault;
}

using Ints = std::vector<int>;

TEST(FaultInjection, DropsWhatIsSelectedUntilItsCountIsReached) {
  ScenarioFault fault = of(FaultKind::kFrameDrop);
  fault.node_id = 1;
  fault.count = 2;
  Line line(fault);
  EXPECT_EQ(line.bytes({frame(0x181, 1), frame(0x182, 2), frame(0x281, 3)}), (Ints{2}));
  EXPECT_EQ(line.bytes({frame(0x181, 4)}), (Ints{4}));
}

TEST(FaultInjection, SelectsByCobIdMaskDirectionAndTime) {
  ScenarioFault fault = of(FaultKind::kFrameDrop);
  fault.cob_id = 0x180;
  fault.cob_mask = 0x780;
  fault.direction = FrameDirection::kToMaster;
  fault.start_ns = 1'000'000;
  fault.duration_ns = 2'000'000;
  Line line(fault);
  EXPECT_EQ(line.step({frame(0x181, 1)}).size(), 1U) << "not yet";
  EXPECT_EQ(line.step({frame(0x181, 1), frame(0x281, 2)}).size(), 1U);
  EXPECT_EQ(line.step({frame(0x181, 1)}, FrameDirection::kToBoards).size(), 1U) << "the other way";
  EXPECT_EQ(line.step({frame(0x181, 1)}).size(), 1U) << "over";
}

TEST(FaultInjection, DelaysByItsSteps) {
  ScenarioFault fault = of(FaultKind::kFrameDelay);
  fault.steps = 2;
  fault.count = 1;
  Line line(fault);
  EXPECT_EQ(line.bytes({frame(0x181, 1)}), Ints{});
  EXPECT_EQ(line.bytes({frame(0x181, 2)}), (Ints{2}));
  EXPECT_EQ(line.bytes({frame(0x181, 3)}), (Ints{1, 3}));
}

TEST(FaultInjection, DuplicatesAndReorders) {
  Line twice(of(FaultKind::kFrameDuplicate));
  EXPECT_EQ(twice.bytes({frame(0x181, 1)}), (Ints{1, 1}));
  ScenarioFault fault = of(FaultKind::kFrameReorder);
  fault.cob_id = 0x181;
  fault.cob_mask = 0x7FF;
  Line line(fault);
  EXPECT_EQ(line.bytes({frame(0x181, 1), frame(0x282, 9)}), (Ints{9}));
  EXPECT_EQ(line.bytes({frame(0x181, 2)}), (Ints{2, 1})) << "they change places";
}

TEST(FaultInjection, AFrameThatWaitsForItsSuccessorComesWhenTheFaultEnds) {
  ScenarioFault fault = of(FaultKind::kFrameReorder);
  fault.duration_ns = 1'000'000;
  Line line(fault);
  EXPECT_EQ(line.bytes({frame(0x181, 1)}), Ints{});
  EXPECT_EQ(line.bytes({}), (Ints{1}));
}

TEST(FaultInjection, FlipsBitsOrShortens) {
  ScenarioFault fault = of(FaultKind::kFrameCorrupt);
  Line line(fault);
  const Frame sent = frame(0x181, 0x55);
  const Frame got = line.step({sent}).at(0);
  int flipped = 0;
  for (std::size_t i = 0; i < 8; ++i)
    flipped += std::popcount<std::uint8_t>(got.data[i] ^ sent.data[i]);
  EXPECT_EQ(flipped, 1);
  EXPECT_EQ(got.length, sent.length);
  fault.length = 2;
  Line shorter(fault);
  EXPECT_EQ(shorter.step({sent}).at(0).length, 2);
}

TEST(FaultInjection, ChanceIsTheSeedsAlone) {
  ScenarioFault fault = of(FaultKind::kFrameDrop);
  fault.probability = 0.3;
  const auto lost = [&](std::uint64_t seed) {
    Line line(fault, seed);
    std::vector<std::size_t> left;
    for (int i = 0; i < 2000; ++i) left.push_back(line.step({frame(0x181, 1)}).size());
    return left;
  };
  const auto first = lost(1);
  EXPECT_EQ(first, lost(1));
  EXPECT_NE(first, lost(2));
  const auto passed = std::count(first.begin(), first.end(), 1U);
  EXPECT_NEAR(static_cast<double>(passed) / 2000.0, 0.7, 0.05);
}

TEST(FaultInjection, ABusThatIsDownPassesNothing) {
  ScenarioFault fault = of(FaultKind::kBusDown);
  fault.bus = 0;
  fault.duration_ns = 1'000'000;
  Line line(fault);
  EXPECT_TRUE(line.step({frame(0x181, 1), frame(0x80, 1)}).empty());
  EXPECT_EQ(line.step({frame(0x181, 1)}).size(), 1U);
}

// The 65th one of a run was confirmed and left out.
TEST(FaultInjection, APushThatIsOverMakesRoom) {
  FaultInjection faults(1);
  ScenarioFault push;
  push.kind = FaultKind::kPush;
  push.duration_ns = 1'000'000;
  for (std::int64_t i = 0; i < 200; ++i) {
    push.start_ns = i * 3'000'000;
    ASSERT_TRUE(faults.add(push)) << i;
    int begun = 0, over = 0;
    for (std::int64_t step = 0; step < 3; ++step) {
      faults.begin_step(push.start_ns + step * 1'000'000, 0);
      for (; faults.next_begun() != nullptr; ++begun) {
      }
      for (; faults.next_over() != nullptr; ++over) {
      }
    }
    ASSERT_EQ(begun, 1) << i;
    ASSERT_EQ(over, 1) << i;
  }
  EXPECT_EQ(faults.room(), FaultInjection::kMostFaults);
  push.duration_ns = -1;
  for (std::size_t i = 0; i < FaultInjection::kMostFaults; ++i) ASSERT_TRUE(faults.add(push));
  EXPECT_EQ(faults.room(), 0U);
  EXPECT_FALSE(faults.add(push));
}

TEST(FaultInjection, TellsOfEachFaultOnceEvenOfTheShortest) {
  Line line(of(FaultKind::kBoardReset));
  EXPECT_EQ(line.faults.next_begun(), nullptr);
  line.faults.begin_step(0, -1);
  line.faults.begin_step(1, -1);
  ASSERT_NE(line.faults.next_begun(), nullptr);
  EXPECT_EQ(line.faults.next_begun(), nullptr);
}

TEST(FaultInjection, AFaultShorterThanAStepActsOnOneStep) {
  ScenarioFault fault = of(FaultKind::kFrameDrop);
  fault.start_ns = 500'000;
  fault.duration_ns = 1;
  Line line(fault);
  EXPECT_EQ(line.bytes({frame(0x181, 1)}), (Ints{1}));
  EXPECT_EQ(line.bytes({frame(0x181, 2)}), Ints{});
  EXPECT_EQ(line.bytes({frame(0x181, 3)}), (Ints{3}));
  EXPECT_EQ(line.bytes({frame(0x181, 4)}), (Ints{4}));
}

TEST(FaultInjection, WaitsUntilAllIsEnabled) {
  ScenarioFault fault = of(FaultKind::kFrameDrop);
  fault.from = FaultFrom::kEnabled;
  fault.start_ns = 10;
  FaultInjection faults(1);
  ASSERT_TRUE(faults.add(fault));
  faults.begin_step(1'000'000, -1);
  EXPECT_EQ(faults.slots()[0].active, 0);
  faults.begin_step(2'000'000, 1'999'995);
  EXPECT_EQ(faults.slots()[0].active, 0);
  faults.begin_step(3'000'000, 1'999'995);
  EXPECT_EQ(faults.slots()[0].active, 1);
}

TEST(FaultInjection, MoreThanThereIsRoomForAreRefused) {
  FaultInjection faults(1);
  for (std::size_t i = 0; i < FaultInjection::kMostFaults; ++i) {
    EXPECT_TRUE(faults.add(of(FaultKind::kFrameDrop)));
  }
  EXPECT_FALSE(faults.add(of(FaultKind::kFrameDrop)));
}

TEST(FaultInjection, ASnapshotHoldsWhatWaitsAndWhatIsRandom) {
  ScenarioFault fault = of(FaultKind::kFrameDelay);
  fault.steps = 3;
  fault.probability = 0.5;
  Line line(fault);
  for (std::uint8_t i = 0; i < 10; ++i) line.step({frame(0x181, i)});
  Archive saved;
  line.faults.archive(saved);
  const auto on = [&] {
    std::vector<Frame> all;
    for (std::uint8_t i = 10; i < 40; ++i) {
      const auto got = line.step({frame(0x181, i)});
      all.insert(all.end(), got.begin(), got.end());
    }
    return all;
  };
  const auto first = on();
  Archive restore(saved.bytes());
  line.faults.archive(restore);
  ASSERT_TRUE(restore.ok() && restore.at_end());
  EXPECT_EQ(on(), first);
}

}  // namespace
}  // namespace tandem::sim
