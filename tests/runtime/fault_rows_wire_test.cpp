// The rows of docs/faults.md about frames and buses.
#include "tests/runtime/fault_row.hpp"

namespace tandem::runtime {
namespace {

using namespace test;
using sim::Fault;

// --- frames ---

TEST(FaultRow, FeedbackLostOnce) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kFeedbackOfBoard0, 1));
  rig.step();
  EXPECT_EQ(rig.cycle->state().age_cycles()[0], 1U) << "the sample's age tells";
  EXPECT_EQ(rig.cycle->state().age_cycles()[2], 0U);
  for (int i = 0; i < 200; ++i) rig.step();
  EXPECT_EQ(rig.cycle->state().age_cycles()[0], 0U);
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, FeedbackLostTenTimes) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kFeedbackOfBoard0, 10));
  for (int i = 0; i < 10; ++i) rig.step();
  EXPECT_EQ(rig.cycle->state().age_cycles()[0], 10U);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, FeedbackLostForEver) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kFeedbackOfBoard0, 0));
  expect_row(rig.watch());
  expect_stopped(rig, "no complete TPDO for 10 cycles");
}

TEST(FaultRow, CommandLostOnce) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 1));
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 1);
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, CommandLostTenTimes) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 10));
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 10);
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, CommandLostForEver) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 0));
  expect_row(rig.watch());
  EXPECT_EQ(rig.axis(0).objects().error_code, 0xFF01);
  expect_stopped(rig, "0xFF01");
}

TEST(FaultRow, SyncLostOnce) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kSync, 1));
  rig.step();
  for (std::size_t j = 0; j < 6; ++j) EXPECT_EQ(rig.cycle->state().age_cycles()[j], 1U);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, SyncLostForEver) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kSync, 0));
  expect_row(rig.watch());
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(rig.axis(b).objects().error_code, 0x8700);
}

TEST(FaultRow, HeartbeatOfTheMasterLost) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kHeartbeat + 127, 0));
  expect_row(rig.watch());
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(rig.axis(b).objects().error_code, 0x8130);
}

TEST(FaultRow, HeartbeatOfABoardLost) {
  ArmRig rig;
  rig.run();
  rig.inject(lose(kHeartbeat + 1, 0));
  expect_row(rig.watch());
  expect_stopped(rig, "heartbeat lost");
}

TEST(FaultRow, FrameCorruptedOnce) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kFeedbackOfBoard0, 1);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.seed = 3;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 1);
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, FrameTooShort) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kCommandOfBoard0, 0);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.length = 4;
  rig.inject(fault);
  expect_row(rig.watch());
  EXPECT_EQ(rig.board(0).dictionary().value<std::uint32_t>(0x1003, 1), 0x8210U)
      << "not processed, for its length";
  expect_stopped(rig, "0xFF01");
}

TEST(FaultRow, FeedbackTooShort) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kFeedbackOfBoard0, 0);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.length = 4;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "no complete TPDO for 10 cycles");
}

TEST(FaultRow, FrameTwice) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kCommandOfBoard0, 100);
  fault.kind = FaultKind::kFrameDuplicate;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 100);
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, FramesReordered) {
  ArmRig rig;
  rig.run();
  Fault fault = lose(kFeedbackOfBoard0, 10);
  fault.kind = FaultKind::kFrameReorder;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 10);
  expect_running(rig);
  expect_row({});
}

// --- buses ---

TEST(FaultRow, BusDown) {
  ArmRig rig;
  rig.run();
  rig.inject(of(FaultKind::kBusDown));
  expect_row(rig.watch());
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(rig.axis(b).objects().error_code, 0x8700);
  EXPECT_EQ(rig.backend->phase(), hal::Phase::kFault);
}

TEST(FaultRow, BusDownForFiveCycles) {
  ArmRig rig;
  rig.run();
  Fault fault = of(FaultKind::kBusDown);
  fault.duration_ns = 5'000'000;
  rig.inject(fault);
  for (int i = 0; i < 5; ++i) rig.step();
  for (std::size_t j = 0; j < 6; ++j) EXPECT_EQ(rig.cycle->state().age_cycles()[j], 5U);
  for (int i = 0; i < 195; ++i) rig.step();
  for (std::size_t j = 0; j < 6; ++j) EXPECT_EQ(rig.cycle->state().age_cycles()[j], 0U);
  expect_running(rig);
  expect_row({});
}

TEST(FaultRow, BusOff) {
  ArmRig rig;
  rig.run();
  rig.backend->buses[0]->state_now = hal::can::BusState::kBusOff;
  expect_row(rig.watch());
  EXPECT_FALSE(rig.cycle->faults().empty());
}

TEST(FaultRow, TransmitQueueFull) {
  ArmRig rig;
  rig.run();
  rig.backend->buses[0]->queue = 1;  // SYNC, and no command
  expect_row(rig.watch());
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(rig.axis(b).objects().error_code, 0xFF01);
}

}  // namespace
}  // namespace tandem::runtime
