#include "runtime/bumpless_transfer.hpp"

#include "hal/config/capabilities.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem::runtime {
namespace {

/// What is sent in each cycle from the change of hands on, with the velocity beside it.
struct Sent {
  std::vector<double> position_rad, velocity_rad_s;
};
Sent go_from(double last_rad, double wanted_rad) {
  const hal::RobotConfig robot = hal::test::fake_robot();
  const std::vector<hal::JointCapabilities> limits = hal::joint_capabilities(robot);
  hal::StateImage state(robot.shape());
  hal::CommandImage command(robot.shape());
  state.drive_state()[1] = static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled);
  command.mode()[1] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
  command.position_rad()[1] = last_rad;
  BumplessTransfer transfer(limits, 1'000'000);
  transfer.watch(command);
  transfer.begin(1, state, command);
  Sent sent;
  for (int cycle = 0; cycle <= 2001; ++cycle) {
    transfer.before_update(command);
    command.position_rad()[1] = wanted_rad;
    command.velocity_rad_s()[1] = 0.0;
    transfer.after_update(state, command);
    sent.position_rad.push_back(command.position_rad()[1]);
    sent.velocity_rad_s.push_back(command.velocity_rad_s()[1]);
  }
  return sent;
}

TEST(BumplessTransfer, GoesFromTheLastCommandToTheNewOneInATenthOfASecond) {
  const Sent sent = go_from(1.0, 1.02);
  EXPECT_EQ(sent.position_rad.front(), 1.0);
  EXPECT_DOUBLE_EQ(sent.position_rad[50], 1.01);
  EXPECT_LT(sent.position_rad[99], 1.02);
  EXPECT_EQ(sent.position_rad[100], 1.02);
  EXPECT_EQ(sent.velocity_rad_s[100], 0.0);
  EXPECT_TRUE(std::ranges::is_sorted(sent.position_rad));
  for (std::size_t i = 1; i < 100; ++i) {
    const double speed = (sent.position_rad[i + 1] - sent.position_rad[i - 1]) / 2e-3;
    EXPECT_NEAR(sent.velocity_rad_s[i], speed, 1e-3) << i;
  }
}

TEST(BumplessTransfer, TakesItsTimeForALongWay) {
  const Sent sent = go_from(1.0, 1.2);  // at 2 rad/s: half of it at most
  EXPECT_NEAR(*std::ranges::max_element(sent.velocity_rad_s), 1.0, 1e-2);
  EXPECT_LT(sent.position_rad[374], 1.2);
  EXPECT_EQ(sent.position_rad[375], 1.2);
  EXPECT_EQ(go_from(1.0, -1.0).position_rad[2000], -1.0) << "2 s at most";
}

// What the joint measured a cycle ago counted as what the controller wants.
TEST(BumplessTransfer, LeavesThePositionThatIsOfferedOutsidePositionControl) {
  const hal::RobotConfig robot = hal::test::fake_robot();
  const std::vector<hal::JointCapabilities> limits = hal::joint_capabilities(robot);
  hal::StateImage state(robot.shape());
  hal::CommandImage command(robot.shape());
  state.drive_state()[1] = static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled);
  command.mode()[1] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
  BumplessTransfer transfer(limits, 1'000'000);
  transfer.begin(1, state, command);
  command.mode()[1] = static_cast<std::int8_t>(hal::ControlMode::kTorque);
  command.torque_Nm()[1] = 1.0;
  for (int cycle = 0; cycle < 120; ++cycle) {
    const double offered_rad = 0.001 * cycle;
    command.position_rad()[1] = offered_rad;
    transfer.before_update(command);
    EXPECT_EQ(command.position_rad()[1], offered_rad) << cycle;
    EXPECT_EQ(command.torque_Nm()[1], 1.0) << "what it wrote last";
    transfer.after_update(state, command);
    EXPECT_EQ(command.position_rad()[1], offered_rad) << cycle;
  }
}

}  // namespace
}  // namespace tandem::runtime
