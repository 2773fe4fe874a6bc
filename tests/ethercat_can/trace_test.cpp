// What real drives sent, as public reports have it: the master's answers to it are literal. The
// frames are facts; their times are not known.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "hal/ethercat-can/axis_master.hpp"
#include "hal/ethercat-can/node_master.hpp"
#include "hal/ethercat-can/sdo_sequence.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;

Frame made(std::uint32_t id, std::initializer_list<int> bytes) {
  Frame frame{.id = id, .length = static_cast<std::uint8_t>(bytes.size())};
  std::ranges::transform(bytes, frame.data.begin(),
                         [](int byte) { return static_cast<std::uint8_t>(byte); });
  return frame;
}

SdoStep check(std::uint16_t index, std::uint8_t sub, std::uint32_t value, SdoUse use) {
  SdoStep step = write_step(index, sub, value);
  step.use = use;
  return step;
}

/// The master's end of one node; the drive's frames come from the trace.
struct Replay {
  Replay(int id, std::vector<SdoStep> steps)
      : node(id, 50, 6'000'000'000, NodeWatch::kHeartbeat, std::move(steps)) {
    node.restart(0);
  }
  /// A millisecond passes. @return what the master sends in it
  std::vector<Frame> ms(std::int64_t count = 1) {
    sink.clear();
    for (std::int64_t i = 0; i < count; ++i) node.process(now_ns += 1'000'000, 1'000'000, sink);
    return {sink.frames().begin(), sink.frames().end()};
  }
  void sdo(std::uint32_t id, std::initializer_list<int> bytes) {
    node.on_sdo(made(id, bytes), sink);
  }

  NodeMaster node;
  std::array<Frame, 16> storage{};
  canopen::FrameSink sink{storage};
  std::int64_t now_ns = 0;
};

/// ros2_canopen #36, an Ingenia drive on node 2: three and a half seconds from the reset to the
/// boot-up, emergencies after it, and every answer once more.
TEST(Trace, ALateBootWithEmergenciesAndDoubledAnswers) {
  Replay replay(2, {check(0x1000, 0, 0x00020192, SdoUse::kCheckProfile),
                    check(0x1018, 1, 0x0000029C, SdoUse::kCheck)});
  EXPECT_EQ(replay.ms(), std::vector<Frame>{made(0x000, {0x81, 0x02})});
  EXPECT_TRUE(replay.ms(3500).empty()) << "it is not asked before it is there";
  replay.node.on_heartbeat(canopen::NmtState::kBootUp, replay.now_ns);  // 702#00
  EXPECT_EQ(replay.ms(), std::vector<Frame>{made(0x602, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0})});
  replay.sdo(0x582, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  EXPECT_EQ(replay.ms(), std::vector<Frame>{made(0x602, {0x40, 0x18, 0x10, 1, 0, 0, 0, 0})});
  replay.sdo(0x582, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});  // again
  EXPECT_TRUE(replay.ms().empty());
  EXPECT_EQ(replay.node.stage(), NodeStage::kConfigure);
  replay.sdo(0x582, {0x43, 0x18, 0x10, 0x01, 0x9C, 0x02, 0x00, 0x00});
  (void)replay.ms();
  EXPECT_EQ(replay.node.stage(), NodeStage::kReady);
}

/// ros2_canopen #299, an iHSV60 on node 1: it has no 6502 and says so.
TEST(Trace, ADriveWithoutSupportedModes) {
  Replay replay(1, {check(0x6502, 0, 0x80, SdoUse::kCheckBits)});
  replay.node.on_heartbeat(canopen::NmtState::kBootUp, 0);
  EXPECT_EQ(replay.ms(), std::vector<Frame>{made(0x601, {0x40, 0x02, 0x65, 0, 0, 0, 0, 0})});
  replay.sdo(0x581, {0x80, 0x02, 0x65, 0x00, 0x00, 0x00, 0x02, 0x06});
  (void)replay.ms();
  EXPECT_EQ(replay.node.stage(), NodeStage::kReady);
}

/// CANopenNode #486, node 3: a block transfer's answers, shifted by a byte each time, flood the
/// client that has given up on them.
TEST(Trace, AFloodOfStrayAnswers) {
  Replay replay(3, {check(0x1000, 0, 0x00020192, SdoUse::kCheckProfile)});
  replay.node.on_heartbeat(canopen::NmtState::kBootUp, 0);
  EXPECT_EQ(replay.ms(), std::vector<Frame>{made(0x603, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0})});
  replay.sdo(0x583, {0x60, 0x00, 0x70, 0x01, 0x00, 0x00, 0x00, 0x00});
  replay.sdo(0x583, {0x20, 0x00, 0x00, 0x00, 0x00, 0xC0, 0x00, 0x00});
  replay.sdo(0x583, {0x00, 0x00, 0x00, 0x00, 0x00, 0x20, 0x00, 0x00});
  replay.sdo(0x583, {0x00, 0x20, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00});
  replay.sdo(0x583, {0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x20});
  replay.sdo(0x583, {0x30, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00});
  replay.sdo(0x583, {0x30, 0x00, 0x00, 0x00, 0x30, 0x00, 0x00, 0x00});
  replay.sdo(0x583, {0x80, 0x00, 0x70, 0x01, 0x01, 0x00, 0x04, 0x05});
  EXPECT_TRUE(replay.ms().empty());
  EXPECT_EQ(replay.node.stage(), NodeStage::kConfigure) << "none of these is its answer";
  replay.sdo(0x583, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
  (void)replay.ms();
  EXPECT_EQ(replay.node.stage(), NodeStage::kReady);
}

/// machinekit #589, an EPOS: the statuswords of its way up, and the controlword after each.
TEST(Trace, TheStatuswordsOfADriveThatIsEnabled) {
  AxisMaster axis({.counts_per_rad = 1000.0}, {}, 0.0, 0.0);
  axis.set_target(AxisMaster::TargetState::kEnable, 0);
  std::int64_t now_ns = 0;
  for (const auto& [statusword, controlword] :
       {std::pair{0x0740, 0x06}, {0x0721, 0x07}, {0x0723, 0x0F}, {0x0737, 0x0F}}) {
    const auto value = static_cast<std::uint16_t>(statusword);
    std::memcpy(axis.sample_variable(WireField::kStatusword), &value, sizeof value);
    axis.received(true, now_ns += 1'000'000);
    EXPECT_FALSE(axis.command(nullptr, 0, now_ns));
    EXPECT_EQ(axis.raw().controlword, controlword) << std::hex << statusword;
  }
  EXPECT_TRUE(axis.enabled());
}

}  // namespace
}  // namespace tandem::hal::can
