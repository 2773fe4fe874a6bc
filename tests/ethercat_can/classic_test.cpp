// Classic CAN: a command and a sample of one axis take two frames each. And the round trips.
#include <algorithm>
#include <array>

#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using test::classic_config;
using test::kPi;
using test::Rig;
using Bytes = std::vector<int>;

Bytes sent_bytes(Rig& rig, std::uint32_t id) {
  for (const Frame& frame : rig.legs.to_boards()) {
    if (frame.id == id) return {frame.payload().begin(), frame.payload().end()};
  }
  return {};
}

/// A TPDO of node 10 as its board would send it.
void send(Rig& rig, std::uint32_t id, std::vector<std::uint8_t> bytes) {
  const Frame frame = canopen::make_frame(id, bytes);
  ASSERT_EQ(rig.legs.boards().send({&frame, 1}), 1u);
}
const std::vector<std::uint8_t> kFirst{0x37, 0x12, 0xD8, 0xDC, 0xFF, 0xFF, 0x06, 0xFF};
const std::vector<std::uint8_t> kSecond{0x64, 0x00, 0x00, 0x00, 0x10, 0x27, 0x00, 0x00};

TEST(Classic, BoardsComeUpAndFollow) {
  Rig rig(classic_config());
  rig.bring_up();
  rig.command.position_rad()[2] = 0.5;
  rig.steps(2);
  EXPECT_EQ(rig.axis(2).objects().target_position, 2865) << "0.5 rad of 36000 counts";
  EXPECT_EQ(rig.state.age_cycles()[2], 0u);
  EXPECT_EQ(rig.state.sensor_values(0)[4], 5.5);
}

TEST(Classic, CommandsAreTheDocumentsBytes) {
  Rig rig(classic_config());
  rig.bring_up();
  (void)rig.read();
  rig.command.position_rad()[0] = -kPi / 2;
  rig.command.velocity_rad_s()[0] = kPi / 180.0;
  rig.command.torque_Nm()[0] = -12.5;
  rig.command.stiffness_Nm_rad()[0] = 300.0;
  (void)rig.write();
  EXPECT_EQ(sent_bytes(rig, 0x20A), (Bytes{0x0F, 0x00, 0xD8, 0xDC, 0xFF, 0xFF, 0x06, 0xFF}));
  const Bytes second = sent_bytes(rig, 0x30A);
  ASSERT_EQ(second.size(), 6u);
  EXPECT_EQ(Bytes(second.begin(), second.begin() + 5), (Bytes{0x64, 0x00, 0x00, 0x00, 0x08}));
  EXPECT_EQ(sent_bytes(rig, 0x40A), (Bytes{0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x96, 0x43}));
}

TEST(Classic, FeedbackIsTheDocumentsBytes) {
  Rig rig(classic_config());
  rig.bring_up();
  rig.present[0] = false;
  send(rig, 0x18A, kFirst);
  send(rig, 0x28A, kSecond);
  (void)rig.read();
  EXPECT_EQ(rig.state.age_cycles()[0], 0u);
  EXPECT_NEAR(rig.state.position_rad()[0], -kPi / 2, 1e-12);
  EXPECT_NEAR(rig.state.torque_Nm()[0], -12.5, 1e-12);
  EXPECT_NEAR(rig.state.velocity_rad_s()[0], kPi / 180.0, 1e-12);
  EXPECT_NEAR(rig.state.motor_position_rad()[0], kPi / 18.0, 1e-12);
}

TEST(Classic, HalfASampleIsNotTaken) {
  Rig rig(classic_config());
  rig.bring_up();
  rig.present[0] = false;
  for (const std::uint32_t id : {0x18AU, 0x28AU}) {
    send(rig, id, id == 0x18A ? kFirst : kSecond);
    (void)rig.read();
    EXPECT_EQ(rig.state.position_rad()[0], 0.0) << std::hex << id;
    EXPECT_EQ(rig.state.velocity_rad_s()[0], 0.0) << std::hex << id;
  }
  EXPECT_EQ(rig.state.age_cycles()[0], 2u) << "two halves of two cycles are no sample";
}

TEST(Classic, TheLateHalfOfTheLastSampleDoesNotJoinThisOne) {
  Rig rig(classic_config());
  rig.bring_up();
  rig.present[0] = false;
  std::vector<std::uint8_t> late = kSecond;
  late[0] = 0x11;
  send(rig, 0x28A, late);
  send(rig, 0x18A, kFirst);
  (void)rig.read();
  EXPECT_EQ(rig.state.age_cycles()[0], 1u);
  send(rig, 0x28A, late);
  send(rig, 0x18A, kFirst);
  send(rig, 0x28A, kSecond);
  (void)rig.read();
  EXPECT_EQ(rig.state.age_cycles()[0], 0u);
  EXPECT_NEAR(rig.state.velocity_rad_s()[0], kPi / 180.0, 1e-12) << "not the late one's";
}

TEST(RoundTrip, OfBoardsOnTimeIsOneCycle) {
  Rig rig;
  rig.bring_up();
  rig.steps(400);
  const std::vector<RoundTrip> trips = rig.master->round_trips();
  ASSERT_EQ(trips.size(), 3u);
  EXPECT_EQ(trips[1].node, "board_1");
  EXPECT_EQ(trips[1].bus, "legs");
  EXPECT_EQ(trips[1].id, 11);
  EXPECT_GE(trips[1].cycles[1], 100u) << "slow_pdo_every = 4";
  EXPECT_EQ(std::ranges::count_if(trips[1].cycles, [](auto n) { return n > 0; }), 1);
  EXPECT_EQ(trips[1].time.count(), 0u) << "the loopback bus knows no times";
}

TEST(RoundTrip, OfABoardThatHearsLessIsLonger) {
  Rig rig(classic_config());
  rig.bring_up();
  rig.steps(20);
  const auto before = rig.master->round_trips()[0].cycles;
  // It answers with the counter of three SYNCs ago.
  (void)rig.write();
  const Bytes command = sent_bytes(rig, 0x30A);
  ASSERT_EQ(command.size(), 6u);
  (void)rig.step();
  (void)rig.step();
  send(rig, 0x48A, {0, 0, 0, 0, 0, static_cast<std::uint8_t>(command[5])});
  (void)rig.read();
  const auto after = rig.master->round_trips()[0].cycles;
  EXPECT_EQ(after[3], before[3] + 1);
  const NodeFigures figures = rig.master->node_figures()[0];
  EXPECT_EQ(figures.id, 10);
  EXPECT_EQ(figures.late, 1u);
  EXPECT_EQ(figures.answer.max, 0) << "the loopback bus knows no times";
}

/// A bus on which every answer comes 300 us after SYNC.
struct TimedBus final : ForwardingBus {
  static constexpr std::int64_t kAnswer_ns = 300'000;
  explicit TimedBus(Bus& to) : ForwardingBus(to) {}

  std::size_t send(std::span<const Frame> frames) noexcept TANDEM_RT override {
    now_ns += 400'000;
    return ForwardingBus::send(frames);
  }
  std::size_t receive(std::span<Frame> frames) noexcept TANDEM_RT override {
    const std::size_t count = ForwardingBus::receive(frames);
    stamps.fill(now_ns + kAnswer_ns);
    return count;
  }
  [[nodiscard]] std::span<const std::int64_t> received_ns() const noexcept TANDEM_RT override {
    return stamps;
  }
  [[nodiscard]] std::int64_t sent_ns() const noexcept TANDEM_RT override { return now_ns; }

  std::int64_t now_ns = 0;
  std::array<std::int64_t, 64> stamps{};
};

TEST(RoundTrip, TellsTheTimeFromSyncToTheWholeSampleOfEveryNode) {
  for (const RobotConfig& robot : {test::robot_config(), classic_config()}) {
    Rig rig(robot);
    TimedBus legs(rig.legs.master()), arms(rig.arms.master());
    const std::array<Bus*, 2> ends{&legs, &arms};
    rig.master = std::move(*DriveMaster::create(rig.robot, ends));
    rig.bring_up();
    rig.steps(50);
    const std::vector<NodeFigures> all = rig.master->node_figures();
    ASSERT_EQ(all.size(), 4u) << "the sensor, too";
    for (const NodeFigures& node : all) {
      EXPECT_EQ(node.answer.p50, TimedBus::kAnswer_ns) << node.node;
      EXPECT_EQ(node.answer.max, TimedBus::kAnswer_ns) << node.node;
      EXPECT_EQ(node.missed, 0u) << node.node;
      EXPECT_EQ(node.bus, node.node == "foot" ? 1u : 0u);
    }
  }
}

}  // namespace
}  // namespace tandem::hal::can
