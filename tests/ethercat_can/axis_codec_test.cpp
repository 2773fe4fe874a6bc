#include "hal/ethercat-can/axis_codec.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace tandem::hal::can {
namespace {

/// 100 counts a degree, 1000 motor counts a degree, 50 Nm rated.
AxisScale scale() {
  JointConfig joint;
  joint.encoder_counts_per_rev = 36000.0;
  joint.motor_encoder_counts_per_rev = 360000.0;
  joint.rated_torque_Nm = 50.0;
  return AxisScale::of(joint);
}

constexpr canopen::DriveAbilities kCyclic{.position = canopen::Mode::kCsp,
                                          .velocity = canopen::Mode::kCsv,
                                          .torque = canopen::Mode::kCst};

struct Codec : ::testing::Test {
  CommandImage command{ImageShape{.joints = 1, .sensor_channels = {}}};
  StateImage state{ImageShape{.joints = 1, .sensor_channels = {}}};
  RawCommand raw;

  void SetUp() override { command.mode()[0] = static_cast<std::int8_t>(ControlMode::kPosition); }
};

TEST_F(Codec, CommandsBecomeCountsAndPerMille) {
  command.position_rad()[0] = -std::numbers::pi / 2;
  command.velocity_rad_s()[0] = std::numbers::pi / 180.0;
  command.torque_Nm()[0] = -12.5;
  command.voltage_V()[0] = 24.0;
  command.current_A()[0] = -0.014;
  command.stiffness_Nm_rad()[0] = 300.0;
  encode_command(scale(), kCyclic, command, 0, raw);
  EXPECT_EQ(raw.mode, 8);
  EXPECT_EQ(raw.target_position, -9000);
  EXPECT_EQ(raw.velocity_offset, 100);
  EXPECT_EQ(raw.torque_offset, -250);
  EXPECT_EQ(raw.target_voltage, 2400);
  EXPECT_EQ(raw.target_current, -1);
  EXPECT_EQ(raw.stiffness, 300.0F);
}

TEST_F(Codec, CommandsAreClampedAndNeverWrapped) {
  command.position_rad()[0] = 1.0e9;
  command.velocity_rad_s()[0] = -std::numeric_limits<double>::infinity();
  command.torque_Nm()[0] = 1.0e9;
  command.current_A()[0] = std::nan("");
  command.stiffness_Nm_rad()[0] = 1.0e300;
  encode_command(scale(), kCyclic, command, 0, raw);
  EXPECT_EQ(raw.target_position, std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(raw.velocity_offset, std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(raw.torque_offset, 32767);
  EXPECT_EQ(raw.target_current, 0);
  EXPECT_TRUE(std::isfinite(raw.stiffness));
}

TEST_F(Codec, PositionsGoByInterpolationWhereADriveHasNoCsp) {
  encode_command(scale(), {.position = canopen::Mode::kIp}, command, 0, raw);
  EXPECT_EQ(raw.mode, 7);
  EXPECT_EQ(image_mode(7).first, ControlMode::kPosition);
}

TEST_F(Codec, AZeroAndADirectionHoldAcrossTheCountersEnd) {
  constexpr auto kLast = std::numeric_limits<std::int32_t>::max();
  constexpr auto kFirst = std::numeric_limits<std::int32_t>::min();
  JointConfig joint;
  joint.encoder_counts_per_rev = 36000.0;
  joint.motor_encoder_counts_per_rev = 36000.0;
  joint.rated_torque_Nm = 50.0;
  joint.reversed = true;
  joint.zero_counts = kLast - 8;
  const AxisScale turned = AxisScale::of(joint);
  command.position_rad()[0] = -10 * 2.0 * std::numbers::pi / 36000.0;
  command.velocity_rad_s()[0] = 2.0 * std::numbers::pi / 36000.0;
  command.torque_Nm()[0] = 5.0;
  encode_command(turned, kCyclic, command, 0, raw);
  EXPECT_EQ(raw.target_position, kFirst + 1) << "ten counts up, past the last one";
  EXPECT_EQ(raw.velocity_offset, -1);
  EXPECT_EQ(raw.torque_offset, -100);
  for (const std::int32_t count : {kFirst, kFirst + 1, -1, 0, 1, kLast - 8, kLast}) {
    EXPECT_EQ(turned.to_drive(turned.from_zero(count)), count);
  }
  RawFeedback feedback;
  feedback.position = kFirst + 1;
  feedback.velocity = -3;
  feedback.torque = -100;
  decode_feedback(turned, feedback, 0, state);
  EXPECT_DOUBLE_EQ(state.position_rad()[0], command.position_rad()[0]);
  EXPECT_GT(state.velocity_rad_s()[0], 0.0);
  EXPECT_DOUBLE_EQ(state.torque_Nm()[0], 5.0);
}

// A gripper's 100 deg begin at 300 deg of its encoder's turn.
TEST_F(Codec, TheTurnOfASingleTurnEncoderIsTheOneOfTheJointsRange) {
  JointConfig joint;
  joint.encoder_counts_per_rev = joint.motor_encoder_counts_per_rev = 3600.0;
  joint.min_position_rad = -0.2;
  joint.max_position_rad = 1.5;
  joint.zero_counts = 3114;
  joint.encoder_turn_counts = 3600;
  for (const bool reversed : {false, true}) {
    joint.reversed = reversed;
    for (const double rad : {-0.19, 0.0, 0.7, 0.85, 1.49}) {
      for (const int turns : {-2, 0, 3}) {  // those that it has made since power-on
        AxisScale found = AxisScale::of(joint);
        const int counts = 3114 + static_cast<int>(std::lround(rad * found.counts_per_rad));
        const int shown = ((counts % 3600) + 3600) % 3600 + turns * 3600;
        found.find_turn(shown);
        EXPECT_EQ(found.from_zero(shown), counts - 3114) << rad << ", " << turns;
        found.find_turn(shown);
        EXPECT_EQ(found.from_zero(shown), counts - 3114) << "once more";
      }
    }
  }
}

TEST_F(Codec, IdleKeepsTheModeOfTheDrive) {
  encode_command(scale(), kCyclic, command, 0, raw);
  command.mode()[0] = static_cast<std::int8_t>(ControlMode::kIdle);
  encode_command(scale(), kCyclic, command, 0, raw);
  EXPECT_EQ(raw.mode, 8);
}

TEST_F(Codec, FeedbackFromLiteralBytes) {
  RawFeedback feedback;
  const auto from_wire = [](void* variable, const auto& bytes) {
    canopen::PdoCopy copy{.data = variable, .size = static_cast<std::uint8_t>(bytes.size())};
    canopen::PdoCopies({&copy, 1}).from_wire(bytes.data());
  };
  const std::array<std::uint8_t, 2> status{0x37, 0x12};
  const std::array<std::uint8_t, 4> position{0xD8, 0xDC, 0xFF, 0xFF};  // -9000
  const std::array<std::uint8_t, 4> velocity{0x64, 0x00, 0x00, 0x00};  // 100
  const std::array<std::uint8_t, 2> torque{0x06, 0xFF};                // -250
  const std::array<std::uint8_t, 4> motor{0x10, 0x27, 0x00, 0x00};     // 10000
  const std::array<std::uint8_t, 2> current{0x9C, 0xFF};               // -100
  const std::array<std::uint8_t, 2> voltage{0x60, 0x09};               // 2400
  const std::array<std::uint8_t, 2> temperature{0x6E, 0x01};           // 366
  const std::array<std::uint8_t, 1> mode{0xFF};                        // -1
  from_wire(feedback.variable(WireField::kStatusword), status);
  from_wire(feedback.variable(WireField::kPosition), position);
  from_wire(feedback.variable(WireField::kVelocity), velocity);
  from_wire(feedback.variable(WireField::kTorque), torque);
  from_wire(feedback.variable(WireField::kMotorPosition), motor);
  from_wire(feedback.variable(WireField::kCurrent), current);
  from_wire(feedback.variable(WireField::kVoltage), voltage);
  from_wire(feedback.variable(WireField::kTemperature), temperature);
  from_wire(feedback.variable(WireField::kModeDisplay), mode);
  decode_feedback(scale(), feedback, 0, state);
  EXPECT_DOUBLE_EQ(state.position_rad()[0], -std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(state.velocity_rad_s()[0], std::numbers::pi / 180.0);
  EXPECT_DOUBLE_EQ(state.torque_Nm()[0], -12.5);
  EXPECT_DOUBLE_EQ(state.motor_position_rad()[0], 10.0 * std::numbers::pi / 180.0);
  EXPECT_DOUBLE_EQ(state.current_A()[0], -1.0);
  EXPECT_DOUBLE_EQ(state.voltage_V()[0], 24.0);
  EXPECT_DOUBLE_EQ(state.temperature_C()[0], 36.6);
  EXPECT_EQ(state.statusword()[0], 0x1237);
  EXPECT_EQ(state.drive_state()[0], static_cast<int>(DriveState::kOperationEnabled));
  EXPECT_EQ(state.mode()[0], static_cast<int>(ControlMode::kPosition));
  EXPECT_EQ(state.interaction()[0], static_cast<int>(InteractionMode::kCompliant));
}

TEST_F(Codec, CommandToLiteralBytes) {
  RawCommand out;
  out.controlword = 0x000F;
  out.mode = -1;
  out.target_position = -9000;
  out.torque_offset = -250;
  out.stiffness = 1.0F;
  std::array<std::uint8_t, 16> bytes{};
  std::array copies{
      canopen::PdoCopy{out.variable(WireField::kControlword), 0, 2},
      canopen::PdoCopy{out.variable(WireField::kMode), 2, 1},
      canopen::PdoCopy{out.variable(WireField::kTargetPosition), 3, 4},
      canopen::PdoCopy{out.variable(WireField::kTorqueOffset), 7, 2},
      canopen::PdoCopy{out.variable(WireField::kStiffness), 9, 4},
  };
  const canopen::PdoCopies all(copies);
  EXPECT_TRUE(all.differ(bytes.data()));
  all.to_wire(bytes.data());
  EXPECT_FALSE(all.differ(bytes.data()));
  out.mode = 8;
  EXPECT_TRUE(all.differ(bytes.data()));
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 16>{0x0F, 0x00, 0xFF, 0xD8, 0xDC, 0xFF, 0xFF, 0x06,
                                                 0xFF, 0x00, 0x00, 0x80, 0x3F}));
}

TEST_F(Codec, ADriveThatIsNotEnabledIsIdle) {
  RawFeedback feedback;
  feedback.statusword = 0x0233;
  feedback.mode_display = 8;
  decode_feedback(scale(), feedback, 0, state);
  EXPECT_EQ(state.mode()[0], static_cast<int>(ControlMode::kIdle));
  EXPECT_EQ(state.drive_state()[0], static_cast<int>(DriveState::kSwitchedOn));
}

}  // namespace
}  // namespace tandem::hal::can
