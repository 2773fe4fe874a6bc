#include "runtime/bumpless_transfer.hpp"

#include "tests/hal/fake_backend.hpp"

namespace tandem::runtime {
namespace {

TEST(BumplessTransfer, GoesFromTheLastCommandToTheNewOneInATenthOfASecond) {
  const hal::RobotConfig robot = hal::test::fake_robot();
  hal::StateImage state(robot.shape());
  hal::CommandImage command(robot.shape());
  state.drive_state()[1] = static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled);
  command.mode()[1] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
  command.position_rad()[1] = 1.0;
  BumplessTransfer transfer(robot.joints.size(), 1'000'000);
  transfer.begin(1, state, command);
  std::vector<double> sent;
  for (int cycle = 0; cycle <= 101; ++cycle) {
    transfer.before_update(command);
    command.position_rad()[1] = 2.0;
    transfer.after_update(state, command);
    sent.push_back(command.position_rad()[1]);
  }
  EXPECT_EQ(sent.front(), 1.0);
  EXPECT_DOUBLE_EQ(sent[50], 1.5);
  EXPECT_LT(sent[99], 2.0);
  EXPECT_EQ(sent[100], 2.0);
  EXPECT_EQ(sent[101], 2.0);
  EXPECT_TRUE(std::ranges::is_sorted(sent));
}

}  // namespace
}  // namespace tandem::runtime
