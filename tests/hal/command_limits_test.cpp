#include "hal/command_limits.hpp"

#include <limits>

#include "base/archive.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem::hal {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

class Limits : public testing::Test {
 protected:
  void SetUp() override {
    for (std::size_t j = 0; j < 3; ++j) {
      state.position_rad()[j] = 0.1;
      state.drive_state()[j] = static_cast<std::uint8_t>(DriveState::kOperationEnabled);
      command.position_rad()[j] = 0.1;
      command.mode()[j] = static_cast<std::int8_t>(ControlMode::kPosition);
    }
    ASSERT_EQ(limits.apply(state, command), Code::kOk);
  }
  void mode(ControlMode mode) { command.mode()[0] = static_cast<std::int8_t>(mode); }

  RobotConfig robot = test::fake_robot();  // +-1.5 rad, 2 rad/s, 20 Nm, 24 V, 10 A
  StateImage state{robot.shape()};
  CommandImage command{robot.shape()};
  CommandLimits limits{robot, 1'000'000};
};

TEST_F(Limits, LetGoodCommandsPassUnchanged) {
  command.position_rad()[0] = 0.1015;
  command.velocity_rad_s()[0] = 1.5;
  command.torque_Nm()[0] = -20.0;
  command.voltage_V()[0] = 24.0;
  command.current_A()[0] = -10.0;
  command.stiffness_Nm_rad()[0] = 200.0;
  command.damping_Nms_rad()[0] = 25.0;
  const CommandImage before = command;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_TRUE(std::ranges::equal(command.bytes(), before.bytes()));
  EXPECT_EQ(limits.counters()[0].not_finite + limits.counters()[0].out_of_range +
                limits.counters()[0].too_fast,
            0U);
}

TEST_F(Limits, KeepTheLastGoodValueOfEveryFieldThatIsNotFinite) {
  command.velocity_rad_s()[0] = 0.5;
  command.torque_Nm()[0] = 3.0;
  command.voltage_V()[0] = 4.0;
  command.current_A()[0] = 5.0;
  command.stiffness_Nm_rad()[0] = 6.0;
  command.damping_Nms_rad()[0] = 7.0;
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  const CommandImage good = command;
  for (const double bad : {kNan, kInf, -kInf}) {
    command.position_rad()[0] = bad;
    command.velocity_rad_s()[0] = bad;
    command.torque_Nm()[0] = bad;
    command.voltage_V()[0] = bad;
    command.current_A()[0] = bad;
    command.stiffness_Nm_rad()[0] = bad;
    command.damping_Nms_rad()[0] = bad;
    EXPECT_EQ(limits.apply(state, command), Code::kNotFinite);
    EXPECT_TRUE(std::ranges::equal(command.bytes(), good.bytes()));
  }
  EXPECT_EQ(limits.counters()[0].not_finite, 21U);
  EXPECT_EQ(limits.codes()[0], Code::kNotFinite);
  EXPECT_EQ(limits.codes()[1], Code::kOk);
}

TEST_F(Limits, ReplaceAModeThatDoesNotExist) {
  command.mode()[0] = 17;
  EXPECT_EQ(limits.apply(state, command), Code::kNotFinite);
  EXPECT_EQ(command.mode()[0], static_cast<std::int8_t>(ControlMode::kPosition));
  command.interaction()[0] = 2;
  EXPECT_EQ(limits.apply(state, command), Code::kNotFinite);
  EXPECT_EQ(command.interaction()[0], 0);
}

TEST_F(Limits, HoldEveryReferenceWithinItsRange) {
  command.velocity_rad_s()[0] = -2.5;
  command.torque_Nm()[0] = 21.0;
  command.voltage_V()[0] = -30.0;
  command.current_A()[0] = 11.0;
  command.stiffness_Nm_rad()[0] = -1.0;
  command.damping_Nms_rad()[0] = 1e9;
  EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
  EXPECT_EQ(command.velocity_rad_s()[0], -2.0);
  EXPECT_EQ(command.torque_Nm()[0], 20.0);
  EXPECT_EQ(command.voltage_V()[0], -24.0);
  EXPECT_EQ(command.current_A()[0], 10.0);
  EXPECT_EQ(command.stiffness_Nm_rad()[0], 0.0);
  EXPECT_EQ(command.damping_Nms_rad()[0], limits.limits()[0].max_damping_Nms_rad);
  EXPECT_EQ(limits.counters()[0].out_of_range, 6U);
}

TEST_F(Limits, MoveAPositionNoFasterThanTheJointMay) {
  command.position_rad()[0] = 0.2;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], 0.102);
  EXPECT_EQ(limits.counters()[0].too_fast, 1U);
  command.position_rad()[0] = -1.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], 0.100);
}

TEST_F(Limits, StopAPositionAtItsLimit) {
  for (int i = 0; i < 2000; ++i) {
    command.position_rad()[0] = 9.0;
    EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
    ASSERT_LE(command.position_rad()[0], 1.5);
  }
  EXPECT_EQ(command.position_rad()[0], 1.5);
}

TEST_F(Limits, StartFromTheMeasuredPositionWheneverTheLoopWasOpen) {
  mode(ControlMode::kTorque);
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  state.position_rad()[0] = 0.9;
  mode(ControlMode::kPosition);
  command.position_rad()[0] = 0.1;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], 0.898);

  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kFault);
  state.position_rad()[0] = -0.5;
  command.position_rad()[0] = 0.1;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], -0.498);
}

TEST_F(Limits, LeadAJointBackIntoItsRangeWithoutAJump) {
  state.position_rad()[0] = 1.6;
  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kSwitchedOn);
  command.position_rad()[0] = 1.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], 1.598);
}

TEST_F(Limits, StopAVelocityThatLeadsBeyondAPositionLimit) {
  mode(ControlMode::kVelocity);
  state.position_rad()[0] = 1.5;
  command.velocity_rad_s()[0] = 1.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
  EXPECT_EQ(command.velocity_rad_s()[0], 0.0);
  command.velocity_rad_s()[0] = -1.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_EQ(command.velocity_rad_s()[0], -1.0);
}

TEST_F(Limits, GoOnFromASnapshotAsBefore) {
  command.position_rad()[0] = 0.2;
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  Archive saved;
  saved(limits);
  command.position_rad()[0] = 0.2;
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  const double first = command.position_rad()[0];
  Archive restored(saved.bytes());
  restored(limits);
  ASSERT_TRUE(restored.ok() && restored.at_end());
  command.position_rad()[0] = 0.2;
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_EQ(command.position_rad()[0], first);
}

}  // namespace
}  // namespace tandem::hal
