#include "canopen/node.hpp"

#include "tests/canopen/wire.hpp"

namespace tandem::canopen {
namespace {

/// Node 3 with one demand and one actual value.
struct NodeTest : testing::Test {
  std::int32_t target = 0;
  std::int32_t actual = 0x01020304;
  ObjectDictionary od{kNodeObjects + 2};
  std::unique_ptr<Node> node;
  Outbox out;

  void SetUp() override {
    ASSERT_TRUE(od.add(0x607A, 0, target, kWriteRpdo));
    ASSERT_TRUE(od.add(0x6064, 0, actual, kReadTpdo));
    node = std::make_unique<Node>(NodeConfig{.id = 3,
                                             .device_type = kDriveDeviceType,
                                             .product = kBoardProduct,
                                             .serial = 42,
                                             .name = "leg"},
                                  od);
  }
  NodeEvents on(const Frame& frame) { return node->receive(frame, out.sink()); }
  NodeEvents wait(std::int64_t ms) { return node->process(ms * canopen::kNsPerMs, out.sink()); }
  /// SDO download; the answer must be a confirmation.
  void configure(std::initializer_list<int> request) {
    on(wire(0x603, request));
    const auto frames = out.take();
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].data[0], 0x60) << testing::PrintToString(frames[0]);
  }
  void map_and_start() {
    configure({0x23, 0x00, 0x1A, 1, 0x20, 0x00, 0x64, 0x60});  // 1A00:1 = 60640020
    configure({0x2F, 0x00, 0x1A, 0, 1, 0, 0, 0});
    configure({0x2F, 0x00, 0x18, 2, 1, 0, 0, 0});
    configure({0x23, 0x00, 0x18, 1, 0x83, 0x01, 0, 0x40});     // 1800:1 = 40000183
    configure({0x23, 0x00, 0x16, 1, 0x20, 0x00, 0x7A, 0x60});  // 1600:1 = 607A0020
    configure({0x2F, 0x00, 0x16, 0, 1, 0, 0, 0});
    configure({0x2F, 0x00, 0x14, 2, 1, 0, 0, 0});
    configure({0x23, 0x00, 0x14, 1, 0x03, 0x02, 0, 0});  // 1400:1 = 203
    EXPECT_EQ(on(wire(0x000, {0x01, 0x03})), kEventOperational);
  }
};

TEST_F(NodeTest, BootsUpIntoPreOperational) {
  wait(0);
  EXPECT_EQ(out.take(), Frames{wire(0x703, {0x00})});
  EXPECT_EQ(node->state(), NmtState::kPreOperational);
}

TEST_F(NodeTest, ItsObjectsFitTheCapacityThatItNames) {
  EXPECT_LE(od.entries().size(), kNodeObjects + 2);
  EXPECT_NE(od.find(0x1A03, 32), nullptr) << "the last one that is added";
}

TEST_F(NodeTest, HearsAnRpdoWhereverItsMasterPutIt) {
  wait(0);
  out.take();
  EXPECT_FALSE(node->hears(0x305));
  map_and_start();
  on(wire(0x000, {0x80, 0x03}));
  configure({0x23, 0x00, 0x14, 1, 0x03, 0x02, 0, 0x80});  // 1400:1 = 80000203: not in use
  configure({0x23, 0x00, 0x14, 1, 0x05, 0x03, 0, 0});     // 305: as of another node
  on(wire(0x000, {0x01, 0x03}));
  EXPECT_TRUE(node->hears(0x305));
  EXPECT_FALSE(node->hears(0x205));
  on(wire(0x305, {0x0D, 0x0C, 0x0B, 0x0A}));
  EXPECT_EQ(on(wire(0x080, {})), kEventSync | kEventRpdo);
  EXPECT_EQ(target, 0x0A0B0C0D);
  on(wire(0x203, {0x00, 0x00, 0x00, 0x00}));  // where it was before
  on(wire(0x080, {}));
  EXPECT_EQ(target, 0x0A0B0C0D);
}

TEST_F(NodeTest, FollowsNmtForItselfAndForAll) {
  wait(0);
  EXPECT_EQ(on(wire(0x000, {0x01, 0x04})), 0) << "for another";
  EXPECT_EQ(node->state(), NmtState::kPreOperational);
  EXPECT_EQ(on(wire(0x000, {0x01, 0x00})), kEventOperational);
  EXPECT_EQ(on(wire(0x000, {0x80, 0x03})), kEventLeftOperational);
  EXPECT_EQ(on(wire(0x000, {0x02, 0x03})), 0);
  EXPECT_EQ(node->state(), NmtState::kStopped);
}

TEST_F(NodeTest, AnswersItsIdentity) {
  wait(0);
  (void)out.take();
  on(wire(0x603, {0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0}));
  EXPECT_EQ(out.take(), Frames{wire(0x583, {0x43, 0x18, 0x10, 0x01, 0x4D, 0x7A, 0, 0})});
  on(wire(0x603, {0x40, 0x18, 0x10, 0x04, 0, 0, 0, 0}));
  EXPECT_EQ(out.take(), Frames{wire(0x583, {0x43, 0x18, 0x10, 0x04, 42, 0, 0, 0})});
}

TEST_F(NodeTest, SaysNothingButHeartbeatsWhenStopped) {
  wait(0);
  (void)out.take();
  configure({0x2B, 0x17, 0x10, 0x00, 10, 0, 0, 0});
  on(wire(0x000, {0x02, 0x03}));
  on(wire(0x603, {0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0}));
  EXPECT_TRUE(out.take().empty());
  wait(10);
  EXPECT_EQ(out.take(), Frames{wire(0x703, {0x04})});
}

TEST_F(NodeTest, ExchangesPdosOnlyWhenOperational) {
  wait(0);
  (void)out.take();
  EXPECT_EQ(on(wire(0x080, {})), kEventSync);
  node->transmit_synchronous(out.sink());
  EXPECT_TRUE(out.take().empty());
  map_and_start();
  EXPECT_EQ(on(wire(0x203, {0x11, 0x22, 0x33, 0x44})), 0);
  EXPECT_EQ(target, 0);
  EXPECT_EQ(on(wire(0x080, {})), kEventSync | kEventRpdo);
  EXPECT_EQ(node->applied_rpdos(), 1);
  EXPECT_EQ(target, 0x44332211);
  node->transmit_synchronous(out.sink());
  EXPECT_EQ(out.take(), Frames{wire(0x183, {0x04, 0x03, 0x02, 0x01})});
  EXPECT_EQ(on(wire(0x080, {})), kEventSync);
  EXPECT_EQ(node->applied_rpdos(), 0);
}

TEST_F(NodeTest, ReportsAShortRpdoAsEmergency8210) {
  wait(0);
  (void)out.take();
  map_and_start();
  on(wire(0x203, {0x11}));
  EXPECT_EQ(out.take(), Frames{wire(0x083, {0x10, 0x82, 0x11, 0, 0, 0, 0, 0})});
}

TEST_F(NodeTest, ProducesHeartbeatsAtItsPeriod) {
  wait(0);
  (void)out.take();
  configure({0x2B, 0x17, 0x10, 0x00, 50, 0, 0, 0});
  std::vector<int> times;
  for (int ms = 1; ms <= 120; ++ms) {
    wait(1);
    for (const Frame& frame : out.take()) {
      EXPECT_EQ(frame, wire(0x703, {0x7F}));
      times.push_back(ms);
    }
  }
  EXPECT_EQ(times, (std::vector<int>{50, 100}));
}

TEST_F(NodeTest, LosesTheMastersHeartbeatAfterItsTimeAndFallsBack) {
  wait(0);
  (void)out.take();
  configure({0x23, 0x16, 0x10, 0x01, 150, 0, 0x7F, 0});  // node 127, 150 ms
  map_and_start();
  EXPECT_EQ(wait(1000), 0) << "monitoring starts with the first heartbeat";
  on(wire(0x77F, {0x05}));
  EXPECT_EQ(wait(149), 0);
  on(wire(0x77F, {0x05}));
  EXPECT_EQ(wait(149), 0);
  EXPECT_EQ(wait(1), kEventHeartbeatLost | kEventLeftOperational);
  EXPECT_EQ(out.take(), Frames{wire(0x083, {0x30, 0x81, 0x11, 0, 0, 0, 0, 0})});
  EXPECT_EQ(node->state(), NmtState::kPreOperational);
  EXPECT_EQ(wait(1000), 0) << "told once";
}

TEST_F(NodeTest, AnswersGuardRequestsWithAToggleUntilItProducesHeartbeats) {
  EXPECT_FALSE(node->answer_remote(0x703, out.sink())) << "not on the bus yet";
  wait(0);
  (void)out.take();
  for (const std::uint8_t answer : std::initializer_list<std::uint8_t>{0x7F, 0xFF, 0x7F}) {
    EXPECT_TRUE(node->answer_remote(0x703, out.sink()));
    EXPECT_EQ(out.take(), Frames{wire(0x703, {answer})});
  }
  EXPECT_FALSE(node->answer_remote(0x704, out.sink())) << "another node's";
  configure({0x2B, 0x17, 0x10, 0x00, 50, 0, 0, 0});
  EXPECT_FALSE(node->answer_remote(0x703, out.sink()));
}

TEST_F(NodeTest, LosesAMasterThatGuardsNoMore) {
  wait(0);
  (void)out.take();
  configure({0x2B, 0x0C, 0x10, 0x00, 50, 0, 0, 0});
  configure({0x2F, 0x0D, 0x10, 0x00, 3, 0, 0, 0});
  map_and_start();
  EXPECT_EQ(wait(1000), 0) << "monitoring starts with the first request";
  EXPECT_TRUE(node->answer_remote(0x703, out.sink()));
  EXPECT_EQ(wait(149), 0);
  EXPECT_TRUE(node->answer_remote(0x703, out.sink()));
  (void)out.take();
  EXPECT_EQ(wait(149), 0);
  EXPECT_EQ(wait(1), kEventHeartbeatLost | kEventLeftOperational);
  EXPECT_EQ(out.take(), Frames{wire(0x083, {0x30, 0x81, 0x11, 0, 0, 0, 0, 0})});
  EXPECT_TRUE(node->heartbeat_lost());
  EXPECT_EQ(wait(1000), 0) << "told once";
  EXPECT_TRUE(node->answer_remote(0x703, out.sink()));
  EXPECT_FALSE(node->heartbeat_lost());
}

TEST_F(NodeTest, StaysOperationalOnALostHeartbeatWhen1029SaysSo) {
  wait(0);
  (void)out.take();
  configure({0x23, 0x16, 0x10, 0x01, 150, 0, 0x7F, 0});
  configure({0x2F, 0x29, 0x10, 0x01, 1, 0, 0, 0});
  map_and_start();
  on(wire(0x77F, {0x05}));
  EXPECT_EQ(wait(150), kEventHeartbeatLost);
  EXPECT_EQ(node->state(), NmtState::kOperational);
}

TEST_F(NodeTest, RefusesOneProducerTwice) {
  wait(0);
  (void)out.take();
  configure({0x23, 0x16, 0x10, 0x01, 150, 0, 0x7F, 0});
  on(wire(0x603, {0x23, 0x16, 0x10, 0x02, 100, 0, 0x7F, 0}));
  EXPECT_EQ(out.take(), Frames{wire(0x583, {0x80, 0x16, 0x10, 0x02, 0x43, 0, 0x04, 0x06})});
}

TEST_F(NodeTest, KeepsTheErrorHistoryNewestFirst) {
  wait(0);
  (void)out.take();
  node->raise_error(ErrorCode::kFollowingError, error_register::kProfile, 1, out.sink());
  EXPECT_EQ(out.take(), Frames{wire(0x083, {0x11, 0x86, 0x21, 1, 0, 0, 0, 0})});
  node->raise_error(ErrorCode::kI2t, error_register::kCurrent, 0, out.sink());
  EXPECT_EQ(out.take(), Frames{wire(0x083, {0x50, 0x23, 0x23, 0, 0, 0, 0, 0})});
  EXPECT_EQ(od.value<std::uint8_t>(0x1001, 0), 0x23);
  EXPECT_EQ(od.value<std::uint8_t>(0x1003, 0), 2);
  EXPECT_EQ(od.value<std::uint32_t>(0x1003, 1), 0x00002350u);
  EXPECT_EQ(od.value<std::uint32_t>(0x1003, 2), 0x00018611u);
  node->clear_errors(out.sink());
  EXPECT_EQ(out.take(), Frames{wire(0x083, {0, 0, 0, 0, 0, 0, 0, 0})});
  node->clear_errors(out.sink());
  EXPECT_TRUE(out.take().empty()) << "told once";
  configure({0x2F, 0x03, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_EQ(od.value<std::uint32_t>(0x1003, 1), 0u);
}

TEST_F(NodeTest, HasNoDataInAnEmptyErrorHistory) {
  wait(0);
  (void)out.take();
  const Frame read = wire(0x603, {0x40, 0x03, 0x10, 0x01, 0, 0, 0, 0});
  on(read);
  EXPECT_EQ(out.take(), Frames{wire(0x583, {0x80, 0x03, 0x10, 0x01, 0x24, 0, 0, 0x08})});
  on(wire(0x603, {0x40, 0x03, 0x10, 0x00, 0, 0, 0, 0}));
  EXPECT_EQ(out.take(), Frames{wire(0x583, {0x4F, 0x03, 0x10, 0x00, 0, 0, 0, 0})});
  node->raise_error(ErrorCode::kI2t, error_register::kCurrent, 0, out.sink());
  (void)out.take();
  on(read);
  EXPECT_EQ(out.take(), Frames{wire(0x583, {0x43, 0x03, 0x10, 0x01, 0x50, 0x23, 0, 0})});
}

TEST_F(NodeTest, ResetForgetsTheConfigurationAndBootsUp) {
  wait(0);
  (void)out.take();
  map_and_start();
  EXPECT_EQ(on(wire(0x000, {0x81, 0x03})), kEventLeftOperational | kEventResetNode);
  EXPECT_EQ(out.take(), Frames{wire(0x703, {0x00})});
  EXPECT_EQ(node->state(), NmtState::kPreOperational);
  EXPECT_EQ(od.value<std::uint8_t>(0x1A00, 0), 0);
  EXPECT_EQ(od.value<std::uint32_t>(0x1800, 1), 0xC0000183u);
}

TEST_F(NodeTest, ArchiveRestoresABusyNode) {
  wait(0);
  (void)out.take();
  map_and_start();
  on(wire(0x203, {0x11, 0x22, 0x33, 0x44}));
  Archive saved;
  node->archive(saved);
  od.archive(saved);
  on(wire(0x000, {0x81, 0x03}));
  (void)out.take();
  Archive restore(saved.bytes());
  node->archive(restore);
  od.archive(restore);
  ASSERT_TRUE(restore.ok() && restore.at_end());
  EXPECT_EQ(on(wire(0x080, {})), kEventSync | kEventRpdo);
  EXPECT_EQ(target, 0x44332211);
}

}  // namespace
}  // namespace tandem::canopen
