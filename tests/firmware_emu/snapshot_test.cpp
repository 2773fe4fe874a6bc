// A board's snapshot: run on from it, in the same board or in a new one, and get the same bits.
#include <gtest/gtest.h>

#include <cstring>

#include "rig.hpp"

namespace tandem::firmware::testing {
namespace {

BoardSetup noisy() {
  BoardSetup setup = board_setup(2);
  setup.axes[0].torque_noise_Nm = 0.1;
  setup.axes[1].torque_noise_Nm = 0.2;
  return setup;
}

std::vector<std::byte> bytes_of(Board& board) {
  Archive archive;
  board.archive(archive);
  return {archive.bytes().begin(), archive.bytes().end()};
}

/// 300 cycles that change mode, gains, and end in a fault. @return the voltages, bit for bit
std::vector<double> go_on(Rig& rig) {
  std::vector<double> voltages;
  for (int k = 0; k < 300; ++k) {
    rig.commands[0].position = Rig::counts(0.001 * k);
    rig.commands[0].mode = k < 100 ? 8 : -1;
    rig.commands[1].torque_offset = static_cast<std::int16_t>(k);
    if (k == 150) rig.write(0x2022, 1, 0.3F);
    rig.joints[1].temperature_C = k < 200 ? 25.0 : 150.0;
    rig.cycle();
    voltages.push_back(rig.drives[0].voltage_V);
    voltages.push_back(rig.drives[1].voltage_V);
  }
  return voltages;
}

TEST(Snapshot, RunsOnToTheSameBitsInTheSameBoardAndInAnother) {
  Rig rig(noisy());
  for (TestJoint& joint : rig.joints) joint.link_inertia = 0.4;
  rig.start();
  rig.enable(8);
  ASSERT_EQ(rig.write(0x2020, 1, 350.0F), 0U);
  rig.cycles(50);
  ASSERT_EQ(rig.write(0x2021, 1, 30.0F), 0U);  // written, not yet in force
  const std::vector<std::byte> saved = bytes_of(rig.board);
  const auto joints = rig.joints;
  const auto commands = rig.commands;
  const std::vector<double> first = go_on(rig);
  const std::vector<std::byte> end = bytes_of(rig.board);
  EXPECT_EQ(rig.state(1), canopen::DriveMachineState::kFaultReactionActive);

  Rig fresh(noisy());
  for (Rig* again : {&rig, &fresh}) {
    Archive load(saved);
    again->board.archive(load);
    ASSERT_TRUE(load.ok());
    EXPECT_TRUE(load.at_end());
    again->joints = joints;
    again->commands = commands;
    EXPECT_EQ(bytes_of(again->board), saved);
    EXPECT_EQ(go_on(*again), first);
    EXPECT_EQ(bytes_of(again->board), end);
  }
}

TEST(Snapshot, HoldsTheFramesThatWaitToBeSent) {
  Board board(noisy());
  std::vector<AxisSense> sense(2);
  std::vector<AxisDrive> drive(2);
  board.step(1'000'000, sense, drive);  // boot-up
  ASSERT_EQ(board.outgoing().size(), 1U);
  const std::vector<std::byte> saved = bytes_of(board);
  Board other(noisy());
  Archive load(saved);
  other.archive(load);
  ASSERT_EQ(other.outgoing().size(), 1U);
  EXPECT_EQ(other.outgoing()[0].id, 0x705U);
}

TEST(Snapshot, IsRefusedByABoardOfAnotherShape) {
  Board two(noisy());
  Board one(board_setup(1));
  Archive load(bytes_of(two));
  one.archive(load);
  EXPECT_FALSE(load.ok() && load.at_end());
}

}  // namespace
}  // namespace tandem::firmware::testing
