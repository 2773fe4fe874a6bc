// The rows of docs/faults.md about frames and buses.
#include "tests/runtime/fault_row.hpp"

namespace tandem::runtime {
namespace {

using namespace test;
using sim::ScenarioFault;

// --- frames ---

TEST_P(FaultRow, FeedbackLostOnce) {
  RowRig rig(GetParam());
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

TEST_P(FaultRow, FeedbackLostTenTimes) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kFeedbackOfBoard0, 10));
  for (int i = 0; i < 10; ++i) rig.step();
  EXPECT_EQ(rig.cycle->state().age_cycles()[0], 10U);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST_P(FaultRow, FeedbackLostForEver) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kFeedbackOfBoard0, 0));
  expect_row(rig.watch());
  expect_stopped(rig, "no complete TPDO for 10 cycles");
}

TEST_P(FaultRow, CommandLostOnce) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 1));
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 1);
  expect_running(rig);
  expect_row({});
}

TEST_P(FaultRow, CommandLostTenTimes) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 10));
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 10);
  expect_running(rig);
  expect_row({});
}

TEST_P(FaultRow, CommandLostForEver) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kCommandOfBoard0, 0));
  expect_row(rig.watch());
  EXPECT_EQ(rig.axis(0).objects().error_code, 0xFF01);
  expect_stopped(rig, "0xFF01");
}

TEST_P(FaultRow, SyncLostOnce) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kSync, 1));
  rig.step();
  expect_age_on_bus0(rig, 1);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_running(rig);
  expect_row({});
}

TEST_P(FaultRow, SyncLostForEver) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kSync, 0));
  expect_row(rig.watch());
  expect_error_on_bus0(rig, 0x8700);
}

TEST_P(FaultRow, HeartbeatOfTheMasterLost) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kHeartbeat + 127, 0));
  expect_row(rig.watch());
  expect_error_on_bus0(rig, 0x8130);
}

TEST_P(FaultRow, HeartbeatOfABoardLost) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(lose(kHeartbeat + 1, 0));
  expect_row(rig.watch());
  expect_stopped(rig, "heartbeat lost");
}

TEST_P(FaultRow, FrameCorruptedOnce) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = lose(kFeedbackOfBoard0, 1);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.seed = 3;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 1);
  expect_running(rig);
  expect_row({});
}

TEST_P(FaultRow, FrameTooShort) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = lose(kCommandOfBoard0, 0);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.length = 4;
  rig.inject(fault);
  expect_row(rig.watch());
  EXPECT_EQ(rig.board(0).dictionary().value<std::uint32_t>(0x1003, 1), 0x8210U)
      << "not processed, for its length";
  expect_stopped(rig, "0xFF01");
}

TEST_P(FaultRow, FeedbackTooShort) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = lose(kFeedbackOfBoard0, 0);
  fault.kind = FaultKind::kFrameCorrupt;
  fault.length = 4;
  rig.inject(fault);
  expect_row(rig.watch());
  expect_stopped(rig, "no complete TPDO for 10 cycles");
}

TEST_P(FaultRow, FrameTwice) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = lose(kCommandOfBoard0, 100);
  fault.kind = FaultKind::kFrameDuplicate;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 100);
  expect_running(rig);
  expect_row({});
}

TEST_P(FaultRow, FramesReordered) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = lose(kFeedbackOfBoard0, 10);
  fault.kind = FaultKind::kFrameReorder;
  rig.inject(fault);
  for (int i = 0; i < 200; ++i) rig.step();
  expect_struck(rig, 10);
  expect_running(rig);
  expect_row({});
}

// --- buses ---

TEST_P(FaultRow, BusDown) {
  RowRig rig(GetParam());
  rig.run();
  rig.inject(of(FaultKind::kBusDown));
  expect_row(rig.watch());
  expect_error_on_bus0(rig, 0x8700);
  EXPECT_EQ(rig.backend->phase(), hal::Phase::kFault);
}

TEST_P(FaultRow, BusDownForFiveCycles) {
  RowRig rig(GetParam());
  rig.run();
  ScenarioFault fault = of(FaultKind::kBusDown);
  fault.duration_ns = 5'000'000;
  rig.inject(fault);
  for (int i = 0; i < 5; ++i) rig.step();
  expect_age_on_bus0(rig, 5);
  for (int i = 0; i < 195; ++i) rig.step();
  expect_age_on_bus0(rig, 0);
  expect_running(rig);
  expect_row({});
}

TEST_P(FaultRow, BusOff) {
  RowRig rig(GetParam());
  rig.run();
  rig.backend->buses[0]->state_now = hal::can::BusState::kBusOff;
  expect_row(rig.watch());
  EXPECT_FALSE(rig.cycle->faults().empty());
}

TEST_P(FaultRow, TransmitQueueFull) {
  RowRig rig(GetParam());
  rig.run();
  rig.backend->buses[0]->queue = 1;  // SYNC, and no command
  expect_row(rig.watch());
  expect_error_on_bus0(rig, 0xFF01);
}

}  // namespace
}  // namespace tandem::runtime
