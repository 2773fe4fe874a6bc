#include "hal/devices.hpp"

#include <cmath>
#include <limits>

#include "hal/config/capabilities.hpp"
#include "hal/trapezoid.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem::hal {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

TEST(Trapezoid, RestsExactlyAtItsTargetAfterTheClosedFormsTime) {
  Trapezoid reference;
  int steps = 0;
  double fastest = 0.0, last = 0.0;
  while (!reference.step(1.0, 0.5, 2.0, 1e-3)) {
    ASSERT_LE(std::abs(reference.velocity_rad_s - last), 2e-3 * (1 + 1e-9));
    last = reference.velocity_rad_s;
    fastest = std::max(fastest, last);
    ASSERT_LE(reference.position_rad, 1.0 + 1e-12);
    ASSERT_LT(++steps, 10'000);
  }
  EXPECT_EQ(reference.position_rad, 1.0);
  EXPECT_EQ(reference.velocity_rad_s, 0.0);
  EXPECT_DOUBLE_EQ(fastest, 0.5);
  EXPECT_NEAR(steps * 1e-3, 1.0 / 0.5 + 0.5 / 2.0, 3e-3);  // L / v + v / a
}

TEST(Trapezoid, TurnsRoundWithoutAJumpOfVelocity) {
  Trapezoid reference;
  for (int i = 0; i < 500; ++i) reference.step(1.0, 0.5, 2.0, 1e-3);
  EXPECT_GT(reference.velocity_rad_s, 0.4);
  double last = reference.velocity_rad_s;
  int steps = 0;
  while (!reference.step(-0.2, 0.5, 2.0, 1e-3)) {
    ASSERT_LE(std::abs(reference.velocity_rad_s - last), 2e-3 * (1 + 1e-9));
    last = reference.velocity_rad_s;
    ASSERT_GE(reference.position_rad, -0.2 - 1e-12);
    ASSERT_LT(++steps, 10'000);
  }
  EXPECT_EQ(reference.position_rad, -0.2);
}

/// With 1400 rad/s^2 the last step would otherwise be 1.4 mm long, in a millisecond.
TEST(Trapezoid, IsNeverFasterThanItsSpeedHoweverHardItMayBrake) {
  for (const double acceleration : {700.0, 1400.0, 1e4, 1e9, 1e300}) {
    Trapezoid reference;
    int steps = 0;
    double last = 0.0;
    while (!reference.step(1.0, 0.7, acceleration, 1e-3)) {
      ASSERT_LE(reference.position_rad - last, 0.7e-3 * (1 + 1e-9)) << acceleration;
      ASSERT_LT(++steps, 2'000) << acceleration;
      last = reference.position_rad;
    }
    EXPECT_LE(reference.position_rad - last, 0.7e-3 * (1 + 1e-9)) << acceleration;
    EXPECT_EQ(reference.position_rad, 1.0) << acceleration;
  }
}

class DevicesTest : public testing::Test {
 protected:
  void mode(ControlMode mode) { ASSERT_EQ(devices.modes.set_control_mode(0, mode), Code::kOk); }

  RobotConfig robot = test::fake_robot();  // +-1.5 rad, 2 rad/s, 20 Nm, 24 V, 10 A
  StateImage state{robot.shape()};
  CommandImage command{robot.shape()};
  ParameterImage parameters = initial_parameters(robot);
  Devices devices{robot_of(robot), state, command, parameters, 1'000'000};
};

/// At 2 rad/s, braking with 4 rad/s^2 takes half a radian; with the slow motion's own 0.01 rad/s^2
/// it would take two hundred.
class FastMotion : public DevicesTest {
 protected:
  void SetUp() override {
    mode(ControlMode::kPosition);
    ASSERT_EQ(motion.set_ref_speed(0, 2.0), Code::kOk);
    ASSERT_EQ(motion.set_ref_acceleration(0, 4.0), Code::kOk);
    ASSERT_EQ(motion.position_move(0, 1.4), Code::kOk);
    for (int i = 0; i < 600; ++i) advance();
    fast_at_rad = command.position_rad()[0];
    ASSERT_GT(command.velocity_rad_s()[0], 1.4);
  }
  void advance() {
    motion.advance();
    farthest_rad = std::max(farthest_rad, command.position_rad()[0]);
  }
  void rest() {
    for (int i = 0; !motion.check_motion_done(0); ++i) {
      advance();
      ASSERT_LT(i, 100'000);
    }
  }

  PositionControl& motion = devices.position;
  double fast_at_rad = 0.0, farthest_rad = 0.0;
};

TEST_F(FastMotion, KeepsItsBrakeWhenASlowerOneTakesItOver) {
  ASSERT_EQ(motion.set_ref_speed(0, 0.02), Code::kOk);
  ASSERT_EQ(motion.set_ref_acceleration(0, 0.01), Code::kOk);
  ASSERT_EQ(motion.position_move(0, fast_at_rad + 0.2), Code::kOk);
  rest();
  EXPECT_LE(farthest_rad, fast_at_rad + 0.51) << "half a radian, and then back";
  EXPECT_EQ(command.position_rad()[0], fast_at_rad + 0.2);
}

TEST_F(FastMotion, IsStoppedWithItsBrakeByWhoeverHasAskedForASlowOne) {
  ASSERT_EQ(motion.set_ref_acceleration(0, 0.01), Code::kOk);
  ASSERT_EQ(motion.position_move(0, 1.4), Code::kOk);
  ASSERT_EQ(motion.stop(0), Code::kOk);
  rest();
  EXPECT_LE(command.position_rad()[0], fast_at_rad + 0.51);
}

TEST_F(FastMotion, BrakesHarderAsSoonAsItMay) {
  ASSERT_EQ(motion.set_ref_acceleration(0, 8.0), Code::kOk);
  advance();
  ASSERT_EQ(motion.stop(0), Code::kOk);
  rest();
  EXPECT_LE(command.position_rad()[0], fast_at_rad + 0.26) << "a quarter of a radian, not a half";
}

/// As limits do that hold a reference back: what is sent comes 50 cycles later.
TEST_F(FastMotion, IsLedUntilWhatIsSentHasArrived) {
  std::vector<double> sent(50, command.position_rad()[0]);
  for (std::size_t i = 0; !motion.check_motion_done(0); ++i) {
    advance();
    std::swap(command.position_rad()[0], sent[i % sent.size()]);
    ASSERT_LT(i, 100'000U);
  }
  EXPECT_EQ(command.position_rad()[0], 1.4);
}

/// The default is 1 rad/s^2 here: a quarter of 2 rad/s in half a second.
TEST_F(DevicesTest, AStopBrakesAtLeastAsHardAsAnOrdinaryMotion) {
  mode(ControlMode::kPosition);
  PositionControl& motion = devices.position;
  ASSERT_EQ(motion.set_ref_acceleration(0, 0.1), Code::kOk);
  ASSERT_EQ(motion.position_move(0, 1.4), Code::kOk);
  for (int i = 0; i < 3000; ++i) motion.advance();
  const double from = command.position_rad()[0];
  ASSERT_GT(command.velocity_rad_s()[0], 0.29);
  ASSERT_EQ(motion.stop(0), Code::kOk);
  for (int i = 0; i < 310; ++i) motion.advance();
  EXPECT_TRUE(motion.check_motion_done(0));
  EXPECT_LE(command.position_rad()[0] - from, 0.3 * 0.3 / 2.0 * 1.01);
}

TEST_F(DevicesTest, RefuseWhatIsNotFiniteOrBeyondALimitAndChangeNothing) {
  mode(ControlMode::kPosition);
  const CommandImage before = command;
  EXPECT_EQ(devices.position.position_move(0, kNoNumber), Code::kNotFinite);
  EXPECT_EQ(devices.position.position_move(0, 1.6), Code::kOutOfRange);
  EXPECT_EQ(devices.position.relative_move(0, -2.0), Code::kOutOfRange);
  EXPECT_EQ(devices.position.set_ref_speed(0, 2.1), Code::kOutOfRange);
  EXPECT_EQ(devices.position.set_ref_speed(0, 0.0), Code::kOutOfRange);
  EXPECT_EQ(devices.position.set_ref_acceleration(0, kNoNumber), Code::kNotFinite);
  EXPECT_EQ(devices.position_direct.set_position(0, -1.6), Code::kOutOfRange);
  EXPECT_EQ(devices.impedance.set_impedance(0, {-1.0, 0.0}), Code::kOutOfRange);
  EXPECT_EQ(devices.impedance.set_impedance(0, {10.0, kNoNumber}), Code::kNotFinite);
  EXPECT_EQ(devices.impedance.set_impedance_offset(0, 21.0), Code::kOutOfRange);
  EXPECT_EQ(devices.pid.set_pid(0, PidLoop::kPosition, {1.0, -1.0, 0.0}), Code::kOutOfRange);
  devices.advance();
  EXPECT_TRUE(std::ranges::equal(command.bytes(), before.bytes()));
  EXPECT_EQ(parameters.revision(0), 0U);
}

TEST_F(DevicesTest, RefuseAReferenceOfAnotherMode) {
  mode(ControlMode::kPosition);
  EXPECT_EQ(devices.velocity.velocity_move(0, 0.1), Code::kOutOfRange);
  EXPECT_EQ(devices.torque.set_ref_torque(0, 1.0), Code::kOutOfRange);
  EXPECT_EQ(devices.open_loop.set_ref_voltage(0, 1.0), Code::kOutOfRange);
  EXPECT_EQ(devices.current.set_ref_current(0, 1.0), Code::kOutOfRange);
  mode(ControlMode::kTorque);
  EXPECT_EQ(devices.position.position_move(0, 0.1), Code::kOutOfRange);
  EXPECT_EQ(devices.position_direct.set_position(0, 0.1), Code::kOutOfRange);
  EXPECT_EQ(devices.torque.set_ref_torque(0, 1.0), Code::kOk);
}

// Two controllers have devices over the same images: each writes what it was asked for.
TEST_F(DevicesTest, LeaveAloneTheJointsThatOthersMove) {
  Devices other{robot_of(robot), state, command, parameters, 1'000'000};
  mode(ControlMode::kVelocity);
  ASSERT_EQ(devices.velocity.velocity_move(0, 0.5), Code::kOk);
  ASSERT_EQ(devices.modes.set_control_mode(1, ControlMode::kPosition), Code::kOk);
  ASSERT_EQ(devices.position.position_move(1, 0.3), Code::kOk);
  state.fault()[2] = 0x8611;
  ASSERT_EQ(devices.amplifier.reset_fault(2), Code::kOk);
  for (int i = 0; i < 100; ++i) devices.advance();
  state.fault()[2] = 0;
  const CommandImage before = command;
  EXPECT_GT(command.velocity_rad_s()[0], 0.0);
  other.advance();
  EXPECT_TRUE(std::ranges::equal(command.bytes(), before.bytes()));
  devices.advance();
  EXPECT_EQ(command.fault_reset()[2], 0);
}

TEST_F(DevicesTest, AnswerForAJointThatDoesNotExist) {
  EXPECT_TRUE(std::isnan(devices.encoders.position_rad(3)));
  EXPECT_EQ(devices.encoders.timestamp_ns(3), -1);
  EXPECT_EQ(devices.modes.set_control_mode(3, ControlMode::kIdle), Code::kOutOfRange);
  EXPECT_EQ(devices.position.position_move(3, 0.0), Code::kOutOfRange);
  EXPECT_EQ(devices.position.set_ref_speed(3, 0.1), Code::kOutOfRange);
  EXPECT_EQ(devices.pid.set_pid(3, PidLoop::kTorque, {}), Code::kOutOfRange);
  EXPECT_TRUE(std::isnan(devices.pid.pid(3, PidLoop::kTorque).kp));
  EXPECT_EQ(devices.amplifier.status(3), DriveState::kUnknown);
  EXPECT_EQ(devices.amplifier.reset_fault(3), Code::kOutOfRange);
}

TEST_F(DevicesTest, SeedReferencesFromTheMeasuredStateOnAModeChange) {
  state.position_rad()[0] = 0.7;
  state.torque_Nm()[0] = 3.0;
  state.voltage_V()[0] = 2.0;
  state.current_A()[0] = 0.5;
  command.velocity_rad_s()[0] = 9.0;
  mode(ControlMode::kPosition);
  EXPECT_EQ(command.position_rad()[0], 0.7);
  EXPECT_EQ(command.velocity_rad_s()[0], 0.0);
  EXPECT_EQ(command.torque_Nm()[0], 0.0);
  mode(ControlMode::kTorque);
  EXPECT_EQ(command.torque_Nm()[0], 3.0);
  mode(ControlMode::kOpenLoop);
  EXPECT_EQ(command.voltage_V()[0], 2.0);
  mode(ControlMode::kCurrent);
  EXPECT_EQ(command.current_A()[0], 0.5);
}

TEST_F(DevicesTest, GiveTimestampsOfTheSampleNotOfTheCycle) {
  state.time_ns()[0] = 50'000'000;
  state.age_cycles()[1] = 3;
  state.sensor_age_cycles()[0] = 2;
  EXPECT_EQ(devices.encoders.timestamp_ns(0), 50'000'000);
  EXPECT_EQ(devices.encoders.timestamp_ns(1), 47'000'000);
  EXPECT_EQ(devices.force_torque("hand")->timestamp_ns(), 48'000'000);
}

TEST_F(DevicesTest, FindSensorsByNameAndSuggestTheNearest) {
  EXPECT_TRUE(devices.force_torque("hand").has_value());
  EXPECT_TRUE(devices.imu("imu").has_value());
  EXPECT_FALSE(devices.imu("hand").has_value());
  EXPECT_EQ(devices.force_torque("hnad").error().hint, "did you mean 'hand'?");
}

TEST_F(DevicesTest, StartWithTheConfiguredGainsAndImpedance) {
  EXPECT_EQ(devices.pid.pid(2, PidLoop::kVelocity).ki, 100.0);
  EXPECT_EQ(devices.impedance.impedance(2).stiffness_Nm_rad, 50.0);
  EXPECT_EQ(devices.impedance.impedance_limits(2).stiffness_Nm_rad, 200.0);
}

TEST(Capabilities, AreWhatTheGainsTableHasLoopsFor) {
  RobotConfig robot = test::fake_robot();
  robot.gains[0].current = {};
  robot.gains[0].velocity = {};
  const JointCapabilities joint = joint_capabilities(robot)[0];
  EXPECT_TRUE(joint.can(ControlMode::kPosition, InteractionMode::kCompliant));
  EXPECT_TRUE(joint.can(ControlMode::kIdle, InteractionMode::kStiff));
  EXPECT_FALSE(joint.can(ControlMode::kCurrent, InteractionMode::kStiff));
  EXPECT_FALSE(joint.can(ControlMode::kVelocity, InteractionMode::kStiff));
}

TEST(Capabilities, TakeTheDampingOfTheGainsOrTheCriticalOne) {
  RobotConfig robot = test::fake_robot();
  EXPECT_EQ(joint_capabilities(robot)[0].max_damping_Nms_rad, 25.0);
  robot.gains[0].position.gains.kd = 0.0;
  robot.gains[0].damping_Nms_rad = 0.0;
  // 2 sqrt(k m), k of the position loop: 200 Nm/rad, m of the rotor: 0.2 kg m2
  EXPECT_DOUBLE_EQ(joint_capabilities(robot)[0].max_damping_Nms_rad, 2.0 * std::sqrt(40.0));
}

TEST(Capabilities, NameTheJointAndTheGainsTableThatLackALoop) {
  RobotConfig robot = test::fake_robot();
  robot.gains[0].current = {};
  EXPECT_TRUE(check_capability(robot, 1, ControlMode::kTorque).has_value());
  const Status refused = check_capability(robot, 1, ControlMode::kCurrent);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().key, "gains.arm");
  EXPECT_NE(refused.error().message.find("joint 'elbow' has no"), std::string::npos);
  EXPECT_NE(refused.error().hint.find("[gains.arm]"), std::string::npos);
}

/// It may come over a network.
TEST(Faults, ACauseThatThereIsNotHasNoText) {
  const auto none = static_cast<FaultCause>(253);
  EXPECT_FALSE(is_of_board(none));
  EXPECT_TRUE(is_of_board(FaultCause::kIgnoresStop));
  EXPECT_FALSE(is_of_board(FaultCause::kNotFollowing));
  const RobotConfig robot = test::fake_robot();
  const test::FakeBackend backend(robot);
  EXPECT_EQ(backend.fault_text(none, 0x7300), "the drive reports error 0x7300");
}

/// They pass links, and are in logs.
TEST(Faults, KeepTheirNumbers) {
  EXPECT_EQ(static_cast<int>(FaultCause::kBoardRefused), 8);
  EXPECT_EQ(static_cast<int>(FaultCause::kIgnoresStop), 12);
  EXPECT_EQ(static_cast<int>(FaultCause::kSwings), 16);
  EXPECT_EQ(row_of(FaultCause::kByWatchdog).number, 3U);
  EXPECT_EQ(row_of(FaultCause::kOwnerLate).number, 3U);
  EXPECT_EQ(row_of(FaultCause::kLinkStates).number, 2U);
  EXPECT_EQ(row_of(FaultCause::kSunk).number, 5U);
  EXPECT_EQ(row_of(FaultCause::kHomingInterrupted).number, 5U);
}

TEST(Faults, OfADriveOrABoardHaveWordsWithTheirAdvice) {
  const RobotConfig robot = test::fake_robot();
  const test::FakeBackend backend(robot);
  EXPECT_EQ(backend.fault_text(FaultCause::kIgnoresStop, 0x8130),
            "its drive does not obey the stop, and may still be enabled: cut its power (emergency "
            "stop, STO)");
  for (std::size_t i = 1; i < std::size(kCauseRows); ++i) {
    const auto cause = static_cast<FaultCause>(i);
    if (!is_of_drive(cause) || cause == FaultCause::kJointLost) continue;
    const std::string text = backend.fault_text(cause, 0x8130);
    EXPECT_FALSE(text.empty()) << i;
    EXPECT_EQ(text.find_first_of("{}"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace tandem::hal
