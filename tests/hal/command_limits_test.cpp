#include "hal/command_limits.hpp"

#include <array>
#include <limits>

#include "base/archive.hpp"
#include "hal/config/capabilities.hpp"
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

  RobotConfig robot = test::fake_robot();  // +-1.5 rad, 2 rad/s, 20 Nm, 24 V, 10 A (4 A: 20 Nm)
  StateImage state{robot.shape()};
  CommandImage command{robot.shape()};
  CommandLimits limits{robot_of(robot), 1'000'000};
};

// A code and a count said neither which of the fields nor by how much.
TEST_F(Limits, SayFieldValueAndLimitOfWhatTheyChange) {
  const auto words = [&] {
    (void)limits.apply(state, command);
    return in_words(limits.met()[0]);
  };
  const std::string followed = ": it is followed as fast as the joint's limits allow";
  EXPECT_EQ(words(), "");
  command.position_rad()[0] = 0.2;
  EXPECT_EQ(words(), "the position reference 0.2 rad asks for more than 2 rad/s" + followed);
  command.position_rad()[0] = 9.0;
  EXPECT_EQ(words(), "the position reference 9 rad is beyond the limit 1.5 rad") << "goes first";
  command.damping_Nms_rad()[0] = kInf;
  EXPECT_EQ(words(), "the damping inf is not finite") << "goes first of all";
  command.torque_Nm()[0] = 15.0;  // the position stays where it was limited to
  EXPECT_EQ(words(), "the torque 15 Nm asks for more than 2000 Nm/s" + followed);
  command.torque_Nm()[0] = -21.0;
  EXPECT_EQ(words(), "the torque -21 Nm is beyond the limit -20 Nm");
  command.mode()[0] = 17;
  EXPECT_EQ(words(), "the mode 17 does not exist");
  mode(ControlMode::kVelocity);
  command.torque_Nm()[0] = 0.0;
  state.position_rad()[0] = 1.5 - 1e-4;
  command.velocity_rad_s()[0] = 1.0;
  EXPECT_EQ(words(),
            "the velocity reference 1 rad/s is more than 0.04472 rad/s, with which the "
            "joint stops within its range");
  EXPECT_EQ(in_words(limits.met()[1]), "");
}

TEST_F(Limits, NameTheAccelerationOrTheJerkThatIsTooMuch) {
  robot.joints[0].max_acceleration_rad_s2 = 10.0;
  robot.joints[1].max_acceleration_rad_s2 = 1e5;
  robot.joints[1].max_jerk_rad_s3 = 300.0;
  limits = CommandLimits(robot_of(robot), 1'000'000);
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  command.position_rad()[0] = command.position_rad()[1] = 0.101;  // 1 rad/s, 1000 rad/s2
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_NE(in_words(limits.met()[0]).find("more than 10 rad/s2"), std::string::npos);
  EXPECT_NE(in_words(limits.met()[1]).find("more than 300 rad/s3"), std::string::npos);
}

TEST_F(Limits, LetGoodCommandsPassUnchanged) {
  command.position_rad()[0] = 0.1015;
  command.velocity_rad_s()[0] = 1.5;
  command.torque_Nm()[0] = -2.0;  // a tenth of what it may be, in a tenth of 10 ms
  command.voltage_V()[0] = 24.0;
  command.current_A()[0] = -4.0;  // gives 20 Nm
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
  command.current_A()[0] = 3.5;
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
  for (int i = 0; i < 10; ++i) {
    command.torque_Nm()[0] = 20.0;
    ASSERT_EQ(limits.apply(state, command), Code::kOk);
  }
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
  EXPECT_EQ(command.current_A()[0], 4.0) << "which gives 20 Nm";
  EXPECT_EQ(command.stiffness_Nm_rad()[0], 0.0);
  EXPECT_EQ(command.damping_Nms_rad()[0], limits.limits()[0].max_damping_Nms_rad);
  EXPECT_EQ(limits.counters()[0].out_of_range, 6U);
}

TEST_F(Limits, TakeAnExcessOfOneInTenMillionForNoRounding) {
  command.position_rad()[0] = 0.1 + 0.002 * (1.0 + 1e-7);
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], 0.102);
  EXPECT_EQ(limits.counters()[0].too_fast, 1U);
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

/// A spring may yield far: stiff again, the joint stays where it is instead of leaping to where the
/// reference was.
TEST_F(Limits, StartFromTheMeasuredPositionWhenAJointBecomesStiff) {
  command.interaction()[0] = static_cast<std::uint8_t>(InteractionMode::kCompliant);
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  state.position_rad()[0] = 0.8;  // pulled off its reference, which is 0.1
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_EQ(command.position_rad()[0], 0.1) << "as long as it yields";
  command.interaction()[0] = static_cast<std::uint8_t>(InteractionMode::kStiff);
  command.position_rad()[0] = 0.8;
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_EQ(command.position_rad()[0], 0.8);
  command.position_rad()[0] = 0.1;  // whoever still wants it there gets it at the joint's speed
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], 0.798);
}

TEST_F(Limits, LeaveAJointOutsideOfItsRangeWhereItIsAndLeadItBackSlowly) {
  state.position_rad()[0] = 1.6;
  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kSwitchedOn);
  command.position_rad()[0] = 1.6;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kOperationEnabled);
  for (int i = 0; i < 100; ++i) {
    command.position_rad()[0] = 1.6;  // held: 1.5 would be a jump
    EXPECT_EQ(limits.apply(state, command), Code::kOk);
    EXPECT_EQ(command.position_rad()[0], 1.6);
  }
  command.position_rad()[0] = 1.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], 1.6 - 0.05 * 2.0 * 1e-3);
  command.position_rad()[0] = 1.6;  // not out again
  EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
  EXPECT_DOUBLE_EQ(command.position_rad()[0], 1.5999);
  for (int i = 0; i < 2000; ++i) {
    command.position_rad()[0] = 1.0;
    EXPECT_EQ(limits.apply(state, command), Code::kOk);
  }
  EXPECT_EQ(command.position_rad()[0], 1.0);
  command.position_rad()[0] = 1.55;
  EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
}

TEST_F(Limits, LeadAJointBackSlowlyInVelocityModeToo) {
  mode(ControlMode::kVelocity);
  state.position_rad()[0] = -1.6;
  for (int i = 0; i < 20; ++i) {
    command.velocity_rad_s()[0] = 2.0;
    EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
  }
  EXPECT_DOUBLE_EQ(command.velocity_rad_s()[0], 0.1);
}

TEST_F(Limits, StopAVelocityThatLeadsBeyondAPositionLimit) {
  mode(ControlMode::kVelocity);
  state.position_rad()[0] = 1.5;
  command.velocity_rad_s()[0] = 1.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
  EXPECT_EQ(command.velocity_rad_s()[0], 0.0);
  command.velocity_rad_s()[0] = -0.2;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_EQ(command.velocity_rad_s()[0], -0.2);
}

TEST_F(Limits, ChangeTorqueAndVelocityByATenthOfTheirLimitInAMillisecond) {
  command.torque_Nm()[0] = -20.0;  // as a feed-forward
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.torque_Nm()[0], -2.0);
  EXPECT_EQ(limits.counters()[0].too_fast, 1U);

  mode(ControlMode::kTorque);
  state.torque_Nm()[0] = 5.0;  // measured: where torque control starts
  command.torque_Nm()[0] = 20.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.torque_Nm()[0], 7.0);
  for (int i = 1; i < 8; ++i) {
    command.torque_Nm()[0] = 20.0;
    EXPECT_EQ(limits.apply(state, command), Code::kOk);
  }
  EXPECT_EQ(command.torque_Nm()[0], 20.0);
  command.torque_Nm()[0] = -20.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.torque_Nm()[0], 18.0);

  mode(ControlMode::kVelocity);
  state.velocity_rad_s()[0] = 0.5;
  command.velocity_rad_s()[0] = 2.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.velocity_rad_s()[0], 0.7);
  command.velocity_rad_s()[0] = -2.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.velocity_rad_s()[0], 0.5);
}

TEST_F(Limits, ChangeCurrentAndVoltageNoFasterThanTheTorqueMayInTheirModes) {
  const JointCapabilities& limit = limits.limits()[0];
  EXPECT_LE(limit.max_current_rate_A_s, limit.max_current_A / kFullScale_s);
  EXPECT_LE(limit.max_voltage_rate_V_s, limit.max_voltage_V / kFullScale_s);
  const auto steps_to = [&](ControlMode which, double& value, double most, double rate) {
    mode(which);
    value = 0.0;
    ASSERT_EQ(limits.apply(state, command), Code::kOk);
    value = 1e9;
    EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
    double before = 0.0;
    for (int k = 0; k < 2000 && value < most; ++k) {
      EXPECT_LE(value - before, rate * 1e-3 * (1.0 + 1e-9));
      before = value;
      ASSERT_EQ(limits.apply(state, command), Code::kOk) << "it goes on by itself";
    }
    EXPECT_EQ(value, most);
  };
  steps_to(ControlMode::kCurrent, command.current_A()[0], limit.max_current_A,
           limit.max_current_rate_A_s);
  steps_to(ControlMode::kOpenLoop, command.voltage_V()[0], limit.max_voltage_V,
           limit.max_voltage_rate_V_s);
}

TEST_F(Limits, StartACurrentFromWhatIsMeasured) {
  state.current_A()[0] = 3.0;
  mode(ControlMode::kCurrent);
  command.current_A()[0] = 0.0;
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_NEAR(command.current_A()[0], 3.0, limits.limits()[0].max_current_rate_A_s * 1e-3 + 1e-9);
  EXPECT_GT(command.current_A()[0], 0.0);
}

TEST_F(Limits, GoOnTowardATorqueThatIsWrittenOnce) {
  command.torque_Nm()[0] = 20.0;
  for (int i = 1; i <= 10; ++i) {
    EXPECT_EQ(limits.apply(state, command), Code::kOk);
    EXPECT_NEAR(command.torque_Nm()[0], 2.0 * i, 1e-9);
  }
  EXPECT_EQ(command.torque_Nm()[0], 20.0);
  command.torque_Nm()[0] = 0.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  command.torque_Nm()[0] = 17.0;  // written again: toward that
  for (int i = 0; i < 5; ++i) EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_EQ(command.torque_Nm()[0], 17.0);
}

TEST_F(Limits, LetADriveThatIsOffHaveAnyTorque) {
  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kSwitchedOn);
  command.torque_Nm()[0] = -20.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_EQ(command.torque_Nm()[0], -20.0);
}

TEST_F(Limits, StartFromWhatIsMeasuredWhenADriveIsEnabledAgain) {
  mode(ControlMode::kVelocity);
  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kFault);
  command.velocity_rad_s()[0] = 2.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kOperationEnabled);
  command.velocity_rad_s()[0] = 2.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.velocity_rad_s()[0], 0.2) << "it stands";

  mode(ControlMode::kTorque);
  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kFault);
  command.torque_Nm()[0] = 20.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  state.drive_state()[0] = static_cast<std::uint8_t>(DriveState::kOperationEnabled);
  command.torque_Nm()[0] = 20.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_DOUBLE_EQ(command.torque_Nm()[0], 2.0);
}

/// The drive carries the measured torque over, and what comes on top of it would add to that.
TEST_F(Limits, LetACompliantJointBeginWithTheTorqueThatIsMeasured) {
  state.torque_Nm()[0] = 15.0;
  for (const ControlMode moves : {ControlMode::kPosition, ControlMode::kVelocity}) {
    mode(moves);
    command.interaction()[0] = static_cast<std::uint8_t>(InteractionMode::kStiff);
    command.torque_Nm()[0] = 0.0;
    for (int i = 0; i < 20; ++i) EXPECT_EQ(limits.apply(state, command), Code::kOk);
    command.torque_Nm()[0] = 15.0;
    EXPECT_EQ(limits.apply(state, command), Code::kOk);
    EXPECT_DOUBLE_EQ(command.torque_Nm()[0], 2.0) << "beside a stiff loop's it is a step";
    command.interaction()[0] = static_cast<std::uint8_t>(InteractionMode::kCompliant);
    command.torque_Nm()[0] = 15.0;
    EXPECT_EQ(limits.apply(state, command), Code::kOk);
    EXPECT_EQ(command.torque_Nm()[0], 15.0);
    command.torque_Nm()[0] = 20.0;
    EXPECT_EQ(limits.apply(state, command), Code::kOk);
    EXPECT_DOUBLE_EQ(command.torque_Nm()[0], 17.0) << "from then on it keeps its rate";
  }
}

TEST_F(Limits, ChangeAnImpedanceInForceGradually) {
  const double stiffest = limits.limits()[0].max_stiffness_Nm_rad;
  const double most = limits.limits()[0].max_damping_Nms_rad;
  command.interaction()[0] = static_cast<std::uint8_t>(InteractionMode::kCompliant);
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  for (int i = 1; i <= 10; ++i) {
    command.stiffness_Nm_rad()[0] = stiffest;
    command.damping_Nms_rad()[0] = most;
    EXPECT_EQ(limits.apply(state, command), Code::kOk);
    EXPECT_NEAR(command.stiffness_Nm_rad()[0], 0.1 * i * stiffest, 1e-9 * stiffest);
    EXPECT_NEAR(command.damping_Nms_rad()[0], 0.1 * i * most, 1e-9 * most);
  }
  command.stiffness_Nm_rad()[0] = 0.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_NEAR(command.stiffness_Nm_rad()[0], 0.9 * stiffest, 1e-9 * stiffest);
}

/// Joint 0 declares 20 rad/s^2 and 400 rad/s^3.
class DeclaredLimits : public Limits {
 protected:
  static RobotConfig declared() {
    RobotConfig robot = test::fake_robot();
    robot.joints[0].max_acceleration_rad_s2 = 20.0;
    robot.joints[0].max_jerk_rad_s3 = 400.0;
    return robot;
  }
  void SetUp() override {
    Limits::SetUp();
    limits = CommandLimits(robot_of(declared()), 1'000'000);
    ASSERT_EQ(limits.apply(state, command), Code::kOk);
  }
  /// A joint that follows its commands, from where it is, at `wanted` [rad/s].
  /// @return the farthest place, and the largest deceleration
  std::pair<double, double> run_to_the_end(double wanted) {
    mode(ControlMode::kVelocity);
    double hardest = 0.0, before = 0.0;
    for (int i = 0; i < 3000; ++i) {
      command.velocity_rad_s()[0] = wanted;
      (void)limits.apply(state, command);  // out of range, once it is there
      const double now = command.velocity_rad_s()[0];
      hardest = std::max(hardest, (std::abs(before) - std::abs(now)) / 1e-3);
      before = now;
      state.velocity_rad_s()[0] = now;
      state.position_rad()[0] += 1e-3 * now;
    }
    return {state.position_rad()[0], hardest};
  }
  /// The largest first, second and third difference of `field` on its way to `wanted`.
  std::array<double, 3> way(std::span<double> field, double wanted, int cycles) {
    std::array<double, 3> most{}, last{}, rate{};
    double before = field[0];
    for (int i = 0; i < cycles; ++i) {
      field[0] = wanted;
      EXPECT_EQ(limits.apply(state, command), Code::kOk);
      rate[0] = (field[0] - before) / 1e-3;
      rate[1] = (rate[0] - last[0]) / 1e-3;
      rate[2] = (rate[1] - last[1]) / 1e-3;
      for (std::size_t k = 0; k < 3; ++k) most[k] = std::max(most[k], std::abs(rate[k]));
      last = rate;
      before = field[0];
    }
    EXPECT_EQ(field[0], wanted);
    return most;
  }
};

TEST_F(DeclaredLimits, BrakeAVelocityBeforeTheEndOfTheRange) {
  for (const double wanted : {2.0, -2.0}) {
    state.position_rad()[0] = 0.0;
    const auto [place, hardest] = run_to_the_end(wanted);
    EXPECT_NEAR(place, std::copysign(1.5, wanted), 2e-3);
    EXPECT_LT(hardest, 20.0 * 1.1) << "the last step is to 0";
  }
  EXPECT_GT(limits.counters()[0].too_fast, 0U);
}

TEST_F(DeclaredLimits, HoldForAPosition) {
  const auto [velocity, acceleration, jerk] = way(command.position_rad(), 1.4, 2000);
  EXPECT_NEAR(velocity, 2.0, 0.01);
  EXPECT_NEAR(acceleration, 20.0, 0.5);
  EXPECT_LE(jerk, 400.1);
  EXPECT_GT(limits.counters()[0].too_fast, 100U);
}

TEST_F(DeclaredLimits, HoldForAVelocity) {
  mode(ControlMode::kVelocity);
  const auto [acceleration, jerk, snap] = way(command.velocity_rad_s(), 2.0, 500);
  EXPECT_NEAR(acceleration, 20.0, 0.5);
  EXPECT_LE(jerk, 400.1);
  const auto [brake, brake_jerk, brake_snap] = way(command.velocity_rad_s(), -1.0, 500);
  EXPECT_NEAR(brake, 20.0, 0.5);
  EXPECT_LE(brake_jerk, 400.1);
}

TEST_F(DeclaredLimits, YieldToTheEndOfTheRange) {
  mode(ControlMode::kVelocity);
  way(command.velocity_rad_s(), 1.0, 500);
  state.position_rad()[0] = 1.5;
  command.velocity_rad_s()[0] = 1.0;
  EXPECT_EQ(limits.apply(state, command), Code::kOutOfRange);
  EXPECT_EQ(command.velocity_rad_s()[0], 0.0);
}

TEST_F(DeclaredLimits, AreNotThoseOfOtherJoints) {
  command.position_rad()[1] = 0.102;
  EXPECT_EQ(limits.apply(state, command), Code::kOk);
  EXPECT_EQ(command.position_rad()[1], 0.102);
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

/// Joint 0 declares 20 rad/s^2.
class DeclaredAcceleration : public Limits {
 protected:
  void SetUp() override {
    robot.joints[0].max_acceleration_rad_s2 = 20.0;
    limits = CommandLimits(robot_of(robot), 1'000'000);
    Limits::SetUp();
  }
};

TEST_F(DeclaredAcceleration, BrakesAJointThatMovesWhenItsPositionLoopCloses) {
  mode(ControlMode::kTorque);
  ASSERT_EQ(limits.apply(state, command), Code::kOk);
  state.velocity_rad_s()[0] = 1.0;
  mode(ControlMode::kPosition);
  double before = 0.1, speed = 1.0, farthest = 0.1;
  for (int i = 0; i < 500; ++i) {
    command.position_rad()[0] = 0.1;  // where it was measured
    command.velocity_rad_s()[0] = 0.0;
    ASSERT_EQ(limits.apply(state, command), Code::kOk);
    const double now = (command.position_rad()[0] - before) / 1e-3;
    EXPECT_LE(std::abs(now - speed), 0.02 * (1.0 + 1e-9)) << i;
    speed = now;
    before = command.position_rad()[0];
    farthest = std::max(farthest, before);
  }
  EXPECT_NEAR(farthest, 0.1 + 0.025, 1e-3) << "v^2 / 2a";
  EXPECT_EQ(before, 0.1);
}

TEST_F(DeclaredAcceleration, SaysTheVelocityOfAPositionThatIsHeldBackAndThenTheOwnersAgain) {
  command.position_rad()[0] = 0.5;
  command.velocity_rad_s()[0] = 0.3;
  double before = 0.1;
  int held_back = 0;
  for (int i = 0; i < 1000; ++i) {
    command.position_rad()[0] = 0.5;  // the owner leaves the velocity alone
    ASSERT_EQ(limits.apply(state, command), Code::kOk);
    const double speed = (command.position_rad()[0] - before) / 1e-3;
    before = command.position_rad()[0];
    if (before == 0.5) continue;
    ++held_back;
    EXPECT_NEAR(command.velocity_rad_s()[0], speed, 1e-9) << i;
  }
  EXPECT_GT(held_back, 200);
  EXPECT_EQ(command.velocity_rad_s()[0], 0.3);
}

}  // namespace
}  // namespace tandem::hal
