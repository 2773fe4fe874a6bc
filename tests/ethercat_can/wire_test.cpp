// The worked examples of docs/wire.md, taken from the bus.
#include <algorithm>

#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using test::kPi;
using test::Rig;
using Bytes = std::vector<int>;

Bytes bytes_of(const Frame& frame) { return {frame.payload().begin(), frame.payload().end()}; }

/// Data of the first frame with this COB-ID among those that wait for the boards; empty: none.
Bytes on_the_bus(Rig& rig, std::uint32_t id) {
  for (const Frame& frame : rig.legs.to_boards()) {
    if (frame.id == id) return bytes_of(frame);
  }
  return {};
}

TEST(Wire, CommandsAreTheDocumentsBytes) {
  Rig rig;
  rig.bring_up();
  (void)rig.read();
  rig.command.position_rad()[0] = -kPi / 2;
  rig.command.torque_Nm()[0] = -12.5;
  rig.command.stiffness_Nm_rad()[0] = 0.0;
  rig.command.damping_Nms_rad()[0] = 0.0;
  rig.command.position_rad()[1] = kPi / 180.0;
  rig.command.interaction()[1] = static_cast<std::uint8_t>(InteractionMode::kCompliant);
  rig.command.stiffness_Nm_rad()[1] = 300.0;
  (void)rig.write();
  EXPECT_EQ(on_the_bus(rig, 0x20A),
            (Bytes{0x0F, 0x00, 0x08, 0xD8, 0xDC, 0xFF, 0xFF, 0x00, 0x00, 0x00, 0x00,
                   0x06, 0xFF, 0x0F, 0x00, 0xFF, 0x64, 0x00, 0x00, 0x00, 0x00, 0x00,
                   0x00, 0x00, 0x00, 0x00, 0xE1, 0x00, 0x00, 0x00, 0x00, 0x00}));
  EXPECT_EQ(on_the_bus(rig, 0x30A),
            (Bytes{0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
                   0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x96, 0x43, 0x00, 0x00, 0xA0, 0x40}));
}

TEST(Wire, SensorFramesAreTheDocumentsBytes) {
  Rig rig;
  rig.bring_up();
  rig.sensor_present = false;
  Frame frame;
  frame.id = 0x1A8;
  frame.length = 24;
  frame.flags = canopen::kFlagFd;
  const Bytes literal{0, 0, 0x80, 0x3F, 0, 0, 0, 0x40, 0, 0, 0x96, 0x43};
  std::ranges::copy(literal, frame.data.begin());
  (void)rig.arms.boards().send({&frame, 1});
  (void)rig.read();
  const auto values = rig.state.sensor_values(0);
  EXPECT_EQ((std::vector<double>{values.begin(), values.end()}),
            (std::vector<double>{1.0, 2.0, 300.0, 0.0, 0.0, 0.0}));
}

TEST(Wire, APdoThatABoardDoesNotSendIsNoSample) {
  Rig rig;
  rig.bring_up();
  rig.present[0] = false;
  Frame frame;
  frame.id = 0x48A;  // TPDO 4 of node 10, which has fewer
  frame.length = 64;
  frame.flags = canopen::kFlagFd;
  frame.data.fill(0x11);
  const double before = rig.state.position_rad()[0];
  (void)rig.legs.boards().send({&frame, 1});
  EXPECT_EQ(rig.read(), Code::kTimeout);
  EXPECT_EQ(rig.state.age_cycles()[0], 1u);
  EXPECT_EQ(rig.state.position_rad()[0], before);
}

TEST(Wire, BringUpSendsTheDocumentsSequence) {
  Rig rig;
  std::vector<Bytes> requests;
  while (rig.master->phase() == Phase::kBringUp && rig.cycle < 5000) {
    (void)rig.read();
    if (const Bytes request = on_the_bus(rig, 0x60A); !request.empty()) {
      requests.push_back(request);
    }
  }
  const std::vector<Bytes> identity{{0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0},
                                    {0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0},
                                    {0x40, 0x18, 0x10, 0x02, 0, 0, 0, 0},
                                    {0x40, 0x18, 0x10, 0x03, 0, 0, 0, 0}};
  const std::vector<Bytes> mapping{{0x23, 0x00, 0x14, 0x01, 0x0A, 0x02, 0x00, 0x80},
                                   {0x2F, 0x00, 0x16, 0x00, 0x00, 0, 0, 0},
                                   {0x23, 0x00, 0x16, 0x01, 0x10, 0x00, 0x40, 0x60},
                                   {0x23, 0x00, 0x16, 0x02, 0x08, 0x00, 0x60, 0x60}};
  const std::vector<Bytes> in_use{{0x2F, 0x00, 0x16, 0x00, 0x0B, 0, 0, 0},
                                  {0x2F, 0x00, 0x14, 0x02, 0x01, 0, 0, 0},
                                  {0x23, 0x00, 0x14, 0x01, 0x0A, 0x02, 0x00, 0x00}};
  ASSERT_GT(requests.size(), 20u);
  EXPECT_TRUE(std::ranges::equal(identity, std::span(requests).first(4)));
  EXPECT_TRUE(std::ranges::equal(mapping, std::span(requests).subspan(4, 4)));
  EXPECT_TRUE(std::ranges::equal(in_use, std::span(requests).subspan(4 + 2 + 11, 3)));
}

TEST(Wire, EveryCycleBeginsWithASync) {
  Rig rig;
  const CycleTime time{};
  rig.master->cycle_begin(time);
  ASSERT_FALSE(rig.legs.to_boards().empty());
  EXPECT_EQ(rig.legs.to_boards()[0].id, 0x080u);
  EXPECT_EQ(rig.legs.to_boards()[0].length, 0);
  EXPECT_EQ(rig.legs.to_boards()[1].id, 0x77Fu);
  EXPECT_EQ(bytes_of(rig.legs.to_boards()[1]), Bytes{0x05});
}

}  // namespace
}  // namespace tandem::hal::can
