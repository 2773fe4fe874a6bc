// Another master on the bus is heard before anything is sent.
#include "hal/ethercat-can/foreign_master.hpp"

#include <gtest/gtest.h>

#include <array>

#include "canopen/messages.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "hal/ethercat-can/line/loopback_link.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;

std::string refusal(std::initializer_list<Frame> frames) {
  LoopbackBus bus;
  EXPECT_EQ(bus.master().send(std::vector<Frame>(frames)), frames.size());
  const Status alone = expect_no_master(bus.boards(), "can3");
  return alone ? "" : alone.error().message;
}

TEST(ForeignMaster, IsKnownByWhatOnlyAMasterSends) {
  EXPECT_EQ(refusal({Frame{.id = 0x080}}),
            "another master is at work on can3: it sends SYNC (080)");
  EXPECT_EQ(refusal({Frame{.id = 0x185}, canopen::make_nmt(canopen::NmtCommand::kResetNode, 0)}),
            "another master is at work on can3: it sends NMT commands (000)");
  EXPECT_EQ(refusal({canopen::make_heartbeat(kMasterNodeId, canopen::NmtState::kOperational)}),
            "another master is at work on can3: it sends a master's heartbeat (77F)");
}

TEST(ForeignMaster, IsNoneOfTheNodesOrTheirTools) {
  EXPECT_EQ(refusal({}), "");
  EXPECT_EQ(refusal({Frame{.id = 0x081}, Frame{.id = 0x100}, Frame{.id = 0x185}, Frame{.id = 0x585},
                     Frame{.id = 0x605}, Frame{.id = 0x701}}),
            "");
}

TEST(ForeignMaster, IsHeardAmongManyFrames) {
  LoopbackBus bus(4000);
  const std::vector<Frame> many(3000, Frame{.id = 0x185});
  EXPECT_EQ(bus.master().send(many), many.size());
  EXPECT_EQ(bus.master().send(std::array{Frame{.id = 0x080}}), 1U);
  EXPECT_FALSE(expect_no_master(bus.boards(), "can0"));
}

TEST(ForeignMaster, OnEtherCatIsKnownByAnyFrame) {
  ecat::LoopbackLink cable;
  EXPECT_TRUE(expect_silence(cable.master(), "eth1"));
  ecat::FrameBuffer frame;
  ethercat::FrameWriter writer;
  writer.begin(frame.bytes, {2, 0, 0, 0, 0, 1});
  (void)writer.add(ethercat::Command::kLrw, 1, 0, 12);
  frame.size = writer.finish();
  EXPECT_EQ(cable.slaves().send(std::array{frame}), 1U);
  const Status alone = expect_silence(cable.master(), "eth1");
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().message, "another master is at work on eth1: EtherCAT frames pass");
}

TEST(ForeignMaster, IsListenedForByItsPeriodAndHeartbeat) {
  RobotConfig robot = hal::test::fake_robot();
  robot.boards.assign(2, {});
  EXPECT_EQ(listening_ns(robot, 1'000'000), 100'000'000);
  EXPECT_EQ(listening_ns(robot, 200'000'000), 400'000'000);
  robot.sensors.at(0).heartbeat_ms = 300;
  EXPECT_EQ(listening_ns(robot, 1'000'000), 600'000'000);
  robot.boards.at(0).heartbeat_ms = 20'000;
  EXPECT_EQ(listening_ns(robot, 1'000'000), 2'000'000'000);
}

}  // namespace
}  // namespace tandem::hal::can
