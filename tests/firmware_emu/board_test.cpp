#include "firmware_emu/board.hpp"

#include <gtest/gtest.h>

#include "rig.hpp"

namespace tandem::firmware::testing {
namespace {

using canopen::DriveState;
using canopen::Frame;

TEST(Board, SaysBootUpAndAnswersWhoItIs) {
  Rig rig;
  rig.step();
  ASSERT_EQ(rig.seen.size(), 1U);
  EXPECT_EQ(rig.seen[0].id, 0x705U);
  EXPECT_EQ(rig.seen[0].length, 1);
  EXPECT_EQ(rig.seen[0].data[0], 0x00);
  EXPECT_EQ(rig.read<std::uint32_t>(0x1000, 0), 0x00020192U);
  EXPECT_EQ(rig.read<std::uint32_t>(0x1018, 1), 0x7A4DU);
  EXPECT_EQ(rig.read<std::uint32_t>(0x1018, 4), 0x12345678U);
}

TEST(Board, ComesToOperationThroughTheDriveMachine) {
  Rig rig;
  rig.start();
  rig.cycles(2);
  EXPECT_EQ(rig.state(), DriveState::kSwitchOnDisabled);
  rig.commands[0].controlword = 0x06;
  rig.cycles(2);
  EXPECT_EQ(rig.state(), DriveState::kReadyToSwitchOn);
  rig.commands[0].controlword = 0x07;
  rig.cycles(2);
  EXPECT_EQ(rig.state(), DriveState::kSwitchedOn);
  EXPECT_FALSE(rig.drives[0].enabled);
  rig.commands[0].controlword = 0x0F;
  rig.cycles(2);
  EXPECT_EQ(rig.state(), DriveState::kOperationEnabled);
  EXPECT_TRUE(rig.drives[0].enabled);
}

TEST(Board, FollowsAPositionInCsp) {
  Rig rig;
  rig.joints[0].link_inertia = 0.5;
  rig.start();
  rig.enable();
  const std::int32_t target = Rig::counts(0.2);
  for (int k = 0; k < 6000; ++k) {
    rig.commands[0].position = std::min(target, k * 100);
    rig.cycle();
  }
  EXPECT_NEAR(rig.joints[0].q, 0.2, 1.0e-3);
  EXPECT_EQ(rig.error(), 0);
}

}  // namespace
}  // namespace tandem::firmware::testing
