// The swing with its board and sensors on an EtherCAT line, in process.
#include "base/archive.hpp"
#include "canopen/messages.hpp"
#include "hal/ethercat-can/line/in_process_link.hpp"
#include "hal/ethercat-can/line/loopback_link.hpp"
#include "tests/ethercat/line_rig.hpp"
#include "tests/ethercat/spoilt_memory.hpp"
#include "tests/sim/swing_loop.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::sim {
namespace {

using tandem::test::line_swing_robot;
using tandem::test::SwingLoop;

TEST(Line, TheSameRunGivesTheSameBytesAndASnapshotGoesOn) {
  const auto run = [](SwingLoop& loop) {
    loop.bring_up();
    loop.run(200);
    return loop.bytes();
  };
  SwingLoop first(line_swing_robot());
  SwingLoop second(line_swing_robot());
  const auto at_200 = run(first);
  EXPECT_TRUE(at_200 == run(second));
  first.run(100);
  second.run(37);  // somewhere else, and back
  Archive in(at_200);
  EXPECT_TRUE(second.sim_robot->archive(in));
  in(second.state, second.command, second.time);
  EXPECT_TRUE(in.at_end());
  second.run(100);
  EXPECT_TRUE(first.bytes() == second.bytes());
}

/// A snapshot in the middle of the start goes on, too.
TEST(Line, ASnapshotOfTheStartGoesOn) {
  SwingLoop first(line_swing_robot());
  SwingLoop second(line_swing_robot());
  for (const int cycles : {7, 60, 200}) {
    first.run(cycles);
    const auto there = first.bytes();
    Archive in(there);
    EXPECT_TRUE(second.sim_robot->archive(in));
    in(second.state, second.command, second.time);
    EXPECT_TRUE(there == second.bytes()) << cycles;
  }
  first.bring_up();
  second.bring_up();
  EXPECT_TRUE(first.bytes() == second.bytes());
}

/// The boards' firmware hears the same commands in the same cycles, and is asked for the same.
TEST(Line, MovesAsTheSameBoardDoesOnCan) {
  hal::RobotConfig quiet = line_swing_robot();
  quiet.joints[0].torque_noise_Nm = 0.0;
  hal::RobotConfig can = tandem::test::swing_robot(2);
  can.joints[0].torque_noise_Nm = 0.0;
  SwingLoop line(quiet);
  SwingLoop bus(can);
  const auto path = [](SwingLoop& loop) {
    loop.bring_up();
    loop.run(1500);  // at rest, off the hoist
    const double from = loop.state.position_rad()[0];
    std::vector<double> positions;
    for (int i = 0; i < 400; ++i) {
      loop.command.position_rad()[0] = from - 0.1 * std::sin(0.01 * i);
      loop.step();
      positions.push_back(loop.state.position_rad()[0] - from);
    }
    return positions;
  };
  const std::vector<double> on_line = path(line);
  const std::vector<double> on_can = path(bus);
  double worst = 0.0;
  for (std::size_t i = 0; i < on_can.size(); ++i) {
    worst = std::max(worst, std::abs(on_line[i] - on_can[i]));
  }
  EXPECT_LT(worst, 1e-4) << "a cycle later it would be 1e-3";
  EXPECT_EQ(line.state.age_cycles()[0], 0U);
}

/// The wall clock of a test; the slaves' clocks drift from it.
class TestClock final : public hal::can::FrameWait {
 public:
  [[nodiscard]] std::int64_t now_ns() noexcept override { return now; }
  void wait(std::int64_t, int) noexcept override {}
  std::int64_t now = 1'000'000;
};

/// Where in a period the frames pass the first slave, after so many cycles.
std::int64_t phase_ns(bool follows, int cycles) {
  constexpr std::int64_t kPeriod = 1'000'000;
  const hal::RobotConfig robot = line_swing_robot();
  auto emulated = EmulatedRobot::create(robot, tandem::test::swing_kernels(2), {.posture = "up"});
  EXPECT_TRUE(emulated.has_value());
  hal::ecat::LoopbackLink cable;
  TestClock clock;
  LineBoards boards(**emulated, 0, cable.slaves(), {.period_ns = kPeriod, .clock = &clock});
  auto line = hal::can::LineBus::create(robot, 0, cable.master(), {.period_ns = kPeriod});
  EXPECT_TRUE(line.has_value());
  const std::array<hal::can::Bus*, 1> ends{line->get()};
  auto master = hal::can::DriveMaster::create(robot, ends);
  EXPECT_TRUE(master.has_value());
  hal::StateImage state(robot.shape());
  std::array<canopen::Frame, 64> frames;
  for (int i = 0; i < cycles; ++i) {
    (*master)->cycle_begin(
        {.cycle = static_cast<std::uint64_t>(i), .time_ns = i * kPeriod, .period_ns = kPeriod});
    hal::can::Bus& bus = (*emulated)->bus(0).master();
    (void)bus.send(std::span(frames).first(boards.receive(frames)));
    EXPECT_EQ((*emulated)->step(i * kPeriod), Code::kOk);
    (void)boards.send(std::span(frames).first(bus.receive(frames)));
    boards.end_step();
    (void)(*master)->receive(state);
    clock.now += kPeriod + (follows ? (*line)->clock_shift_ns() : 0);
  }
  EXPECT_EQ((*master)->phase(), hal::Phase::kOperational) << (*master)->status_text();
  // Both ends of the wire see the same frames.
  const std::int64_t boards_ns = boards.take_wire_ns();
  EXPECT_GT(boards_ns, cycles * 5'000);
  EXPECT_NEAR(static_cast<double>(boards_ns), static_cast<double>((*line)->take_wire_ns()), 2e5);
  EXPECT_EQ(boards.take_wire_ns(), 0) << "since it was asked last";
  return static_cast<std::int64_t>((*line)->line().cycle().reference_ns %
                                   static_cast<std::uint64_t>(kPeriod));
}

TEST(Line, TheLoopKeepsItsPlaceBetweenTwoPulsesOfSync0) {
  const auto wanted = static_cast<std::int64_t>(hal::can::LineBus::kAfterSync0 * 1e6);
  EXPECT_LT(std::abs(phase_ns(true, 1500) - wanted), 500);
  EXPECT_LT(std::abs(phase_ns(true, 4000) - wanted), 500);
  EXPECT_GT(std::abs(phase_ns(false, 4000) - wanted), 5'000) << "else it proves nothing";
}

/// Whom the slaves' own memory makes unusable is told at once, not when every reset was in vain.
TEST(Line, ASlaveWhoseMemoryIsSpoiltIsNamedAtOnce) {
  constexpr std::int64_t kPeriod = 1'000'000;
  const hal::RobotConfig robot = line_swing_robot();
  tandem::test::LineRig slaves(3);
  tandem::test::SpoiltMemory spoilt(*slaves.line);
  hal::ecat::InProcessLink link(spoilt);
  auto line = hal::can::LineBus::create(robot, 0, link, {.period_ns = kPeriod});
  ASSERT_TRUE(line.has_value());
  const std::array<hal::can::Bus*, 1> ends{line->get()};
  auto master = hal::can::DriveMaster::create(robot, ends);
  ASSERT_TRUE(master.has_value());
  hal::StateImage state(robot.shape());
  int cycles = 0;
  for (; cycles < 20'000 && (*master)->phase() == hal::Phase::kBringUp; ++cycles) {
    (*master)->cycle_begin({.cycle = static_cast<std::uint64_t>(cycles),
                            .time_ns = cycles * kPeriod,
                            .period_ns = kPeriod});
    slaves.step();
    link.set_time(slaves.now_ns);
    (void)(*master)->receive(state);
  }
  EXPECT_EQ((*master)->phase(), hal::Phase::kFault);
  EXPECT_LT(cycles, 1000) << "twelve seconds before";
  EXPECT_NE((*line)->status_text().find("slave 0 (board): the SII's check sum is wrong"),
            std::string::npos)
      << (*line)->status_text();
}

TEST(Line, KnowsHowLongItsWireWasBusy) {
  tandem::test::LineRig slaves(3);
  hal::ecat::InProcessLink link(*slaves.line);
  auto made = hal::can::LineBus::create(line_swing_robot(), 0, link, {.period_ns = 1'000'000});
  ASSERT_TRUE(made.has_value());
  hal::can::LineBus& line = **made;
  EXPECT_EQ(line.take_wire_ns(), 0);
  const canopen::Frame sync = canopen::make_sync();
  (void)line.send({&sync, 1});
  const auto sent = static_cast<std::int64_t>(link.statistics().sent_bytes);
  EXPECT_GE(sent, 84) << "a short frame";
  EXPECT_EQ(line.take_wire_ns(), 80 * sent) << "at 100 Mbit/s";
  EXPECT_EQ(line.take_wire_ns(), 0);
}

TEST(Line, HasNoBusTiming) {
  SimRobotConfig config{.posture = "up"};
  config.bus_timing = true;
  const auto made = SimRobot::create(line_swing_robot(), tandem::test::swing_kernels(2), config);
  ASSERT_FALSE(made.has_value());
  EXPECT_NE(made.error().to_string().find("sim.bus_timing: a robot on EtherCAT"), std::string::npos)
      << made.error().to_string();
}

}  // namespace
}  // namespace tandem::sim
