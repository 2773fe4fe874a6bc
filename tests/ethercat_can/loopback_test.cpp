#include "hal/ethercat-can/loopback.hpp"

#include <array>
#include <cmath>

#include "base/archive.hpp"
#include "canopen/messages.hpp"
#include "hal/ethercat-can/can_backend.hpp"
#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;

std::vector<std::uint32_t> ids(std::span<const Frame> frames) {
  std::vector<std::uint32_t> out;
  for (const Frame& frame : frames) out.push_back(frame.id);
  return out;
}

TEST(Loopback, KeepsTheOrderAndTheDirection) {
  LoopbackBus bus;
  const std::array<Frame, 2> sync_and_command{Frame{.id = 0x80}, Frame{.id = 0x205}};
  EXPECT_EQ(bus.master().send(sync_and_command), 2u);
  const std::array<Frame, 1> answer{Frame{.id = 0x185}};
  EXPECT_EQ(bus.boards().send(answer), 1u);
  EXPECT_EQ(ids(bus.to_boards()), (std::vector<std::uint32_t>{0x80, 0x205}));
  std::array<Frame, 4> in;
  ASSERT_EQ(bus.master().receive(in), 1u);
  EXPECT_EQ(in[0].id, 0x185u);
  ASSERT_EQ(bus.boards().receive(in), 2u);
  EXPECT_EQ(in[1].id, 0x205u);
  EXPECT_EQ(bus.boards().receive(in), 0u);
  EXPECT_EQ(bus.passed(), 3u);
}

TEST(Loopback, DropsAndCountsBeyondItsCapacity) {
  LoopbackBus bus(3);
  std::array<Frame, 4> frames;
  EXPECT_EQ(bus.master().send(frames), 3u);
  EXPECT_EQ(bus.dropped(), 1u);
}

TEST(Loopback, ReusesTheRoomOfWhatWasTaken) {
  LoopbackBus bus(3);
  const std::array<Frame, 3> first{Frame{.id = 1}, Frame{.id = 2}, Frame{.id = 3}};
  const std::array<Frame, 2> second{Frame{.id = 4}, Frame{.id = 5}};
  std::array<Frame, 2> two;
  ASSERT_EQ(bus.master().send(first), 3u);
  ASSERT_EQ(bus.boards().receive(two), 2u);
  EXPECT_EQ(bus.master().send(second), 2u);
  EXPECT_EQ(ids(bus.to_boards()), (std::vector<std::uint32_t>{3, 4, 5}));
}

TEST(Loopback, ACutCableLosesWhatIsSent) {
  LoopbackBus bus;
  bus.set_connected(false);
  const std::array<Frame, 1> frame{Frame{.id = 0x80}};
  EXPECT_EQ(bus.master().send(frame), 0u);
  EXPECT_TRUE(bus.to_boards().empty());
  EXPECT_EQ(bus.dropped(), 1u);
}

TEST(Loopback, ArchivesTheFramesInFlight) {
  LoopbackBus bus;
  const std::array<Frame, 2> frames{Frame{.id = 0x80}, Frame{.id = 0x205, .length = 1}};
  (void)bus.master().send(frames);
  Archive saved;
  bus.archive(saved);
  bus.take_to_boards(bus.to_boards().size());
  Archive restore(saved.bytes());
  bus.archive(restore);
  ASSERT_TRUE(restore.ok() && restore.at_end());
  ASSERT_EQ(bus.to_boards().size(), 2u);
  EXPECT_EQ(bus.to_boards()[1], frames[1]);
}

/// Nobody ever answers, and no time passes.
struct NoAnswer final : FrameWait {
  std::int64_t now_ns() noexcept override { return 0; }
  void wait(std::int64_t, int) noexcept override {}
};

/// A line that is busy for 0.25 ms of each cycle.
struct BusyLine final : ForwardingBus {
  using ForwardingBus::ForwardingBus;
  std::int64_t take_wire_ns() noexcept override { return 250'000; }
};

TEST(CanBackend, MeasuresTheLoadOfALineButInLockstep) {
  LoopbackBus legs, arms;
  BusyLine line(arms.master());
  const std::array<Bus*, 2> buses{&legs.master(), &line};
  /// In lockstep the boards of both have answered.
  struct Answers final : FrameWait {
    explicit Answers(std::array<Bus*, 2> its) : boards(its) {}
    std::int64_t now_ns() noexcept override { return 0; }
    void wait(std::int64_t, int) noexcept override {
      const Frame time = canopen::make_time(0);
      for (Bus* one : boards) (void)one->send({&time, 1});
    }
    std::array<Bus*, 2> boards;
  } wait({&legs.boards(), &arms.boards()});
  RobotConfig robot = test::robot_config();
  robot.buses[1].kind = BusKind::kEthercat;
  robot.sensors[0].node_id = 1;
  const auto loads = [&](bool lockstep) {
    const auto backend = CanBackend::create(robot, buses, wait, {.lockstep = lockstep});
    EXPECT_TRUE(backend) << backend.error().to_string();
    for (std::uint64_t cycle = 0; cycle < 2; ++cycle) {
      (*backend)->exchange({.cycle = cycle, .time_ns = 0, .period_ns = 1'000'000});
    }
    return std::array{(*backend)->wire_load(0), (*backend)->wire_load(1)};
  };
  const auto real = loads(false);
  EXPECT_EQ(real[1].most, 0.25F);
  EXPECT_FLOAT_EQ(real[1].mean, 0.00025F) << "a thousandth of a second has passed";
  EXPECT_GT(real[0].most, 0.0F) << "SYNC, at least";
  const auto lockstep = loads(true);
  EXPECT_TRUE(std::isnan(lockstep[1].most) && std::isnan(lockstep[1].mean));
}

TEST(CanBackend, SaysThatRealBoardsCannotBeRewound) {
  LoopbackBus legs, arms;
  const std::array<Bus*, 2> buses{&legs.master(), &arms.master()};
  NoAnswer wait;
  const RobotConfig robot = test::robot_config();
  const auto backend = CanBackend::create(robot, buses, wait, {});
  ASSERT_TRUE(backend) << backend.error().to_string();
  Archive saved;
  EXPECT_FALSE((*backend)->archive(saved));
}

}  // namespace
}  // namespace tandem::hal::can
