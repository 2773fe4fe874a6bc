#include "runtime/bumpless_transfer.hpp"

#include "hal/config/capabilities.hpp"
#include "hal/trapezoid.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem::runtime {
namespace {

constexpr double kMost_rad_s2 = 40.0;  // the joint's acceleration

/// What is sent in each cycle from the change of hands on, with the velocity beside it.
struct Sent {
  std::vector<double> position_rad, velocity_rad_s;
};
/// @param acceleration_rad_s2  of the owner's motion to what it wants; infinite: it writes that at
///                             once
Sent go_from(double last_rad, double wanted_rad,
             double acceleration_rad_s2 = std::numeric_limits<double>::infinity()) {
  hal::RobotConfig robot = hal::test::fake_robot();
  robot.joints[1].max_acceleration_rad_s2 = kMost_rad_s2;
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
  hal::Trapezoid owner{std::isfinite(acceleration_rad_s2) ? last_rad : wanted_rad, 0.0};
  for (int cycle = 0; cycle <= 2001; ++cycle) {
    transfer.before_update(command);
    (void)owner.step(wanted_rad, limits[1].max_velocity_rad_s, acceleration_rad_s2, 1e-3);
    command.position_rad()[1] = owner.position_rad;
    command.velocity_rad_s()[1] = owner.velocity_rad_s;
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

// Its first step counted as a motion to be led over to, and the two were harder than the joint may.
TEST(BumplessTransfer, AddsNothingToAMotionThatSetsOutFromTheLastCommand) {
  for (const double acceleration : {0.5 * kMost_rad_s2, kMost_rad_s2}) {
    const Sent sent = go_from(0.2, 1.2, acceleration);
    hal::Trapezoid motion{0.2, 0.0};
    for (std::size_t i = 0; i < sent.position_rad.size(); ++i) {
      (void)motion.step(1.2, 2.0, acceleration, 1e-3);
      ASSERT_EQ(sent.position_rad[i], motion.position_rad) << i;
      ASSERT_EQ(sent.velocity_rad_s[i], motion.velocity_rad_s) << i;
    }
  }
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
