#include <cstring>

#include "tests/canopen/wire.hpp"
#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using test::kPi;
using test::Rig;

void set_mode(Rig& rig, std::size_t joint, ControlMode mode,
              InteractionMode interaction = InteractionMode::kStiff) {
  rig.command.mode()[joint] = static_cast<std::int8_t>(mode);
  rig.command.interaction()[joint] = static_cast<std::uint8_t>(interaction);
}

TEST(Exchange, ACommandTakesEffectAtTheNextSync) {
  Rig rig;
  rig.bring_up();
  (void)rig.read();
  rig.command.position_rad()[2] = 0.01;
  (void)rig.write();
  const std::int32_t before = rig.axis(2).objects().target_position;
  EXPECT_NE(before, 57);
  (void)rig.read();
  EXPECT_EQ(rig.axis(2).objects().target_position, 57);  // 0.01 rad in hundredths of a degree
}

TEST(Exchange, FeedbackOfTheSyncArrivesInTheSameCycle) {
  Rig rig;
  rig.bring_up();
  rig.position_rad[5] = kPi / 180.0;
  EXPECT_EQ(rig.read(), Code::kOk);
  EXPECT_DOUBLE_EQ(rig.state.position_rad()[5], kPi / 180.0);
  EXPECT_DOUBLE_EQ(rig.state.motor_position_rad()[5], kPi / 180.0);
  EXPECT_EQ(rig.state.age_cycles()[5], 0u);
}

TEST(Exchange, EveryModeIsToldAndSaidBack) {
  Rig rig;
  rig.bring_up();
  struct Case {
    ControlMode mode;
    InteractionMode interaction;
    int wire;
  };
  using enum ControlMode;
  const Case cases[] = {
      {kPosition, InteractionMode::kStiff, 8},     {kVelocity, InteractionMode::kStiff, 9},
      {kTorque, InteractionMode::kStiff, 10},      {kPosition, InteractionMode::kCompliant, -1},
      {kOpenLoop, InteractionMode::kStiff, -2},    {kCurrent, InteractionMode::kStiff, -3},
      {kVelocity, InteractionMode::kCompliant, -4}};
  for (const Case& c : cases) {
    set_mode(rig, 1, c.mode, c.interaction);
    rig.steps(8);
    EXPECT_EQ(rig.axis(1).objects().mode, c.wire);
    EXPECT_EQ(rig.state.mode()[1], static_cast<int>(c.mode)) << c.wire;
    EXPECT_EQ(rig.state.interaction()[1], static_cast<int>(c.interaction)) << c.wire;
  }
}

TEST(Exchange, SlowCommandsAreSentWhenTheyChange) {
  Rig rig;
  rig.bring_up();
  rig.steps(3);
  const std::uint64_t before = rig.legs.passed();
  rig.steps(1);
  const std::uint64_t quiet = rig.legs.passed() - before;
  rig.command.stiffness_Nm_rad()[0] = 250.0;
  rig.command.voltage_V()[0] = -12.34;
  rig.command.current_A()[0] = 1.5;
  rig.steps(2);
  const firmware::AxisObjects& axis = rig.axis(0).objects();
  EXPECT_EQ(rig.object<float>(0, 0x2010), 250.0F);
  EXPECT_EQ(rig.object<float>(0, 0x2011), 5.0F);
  EXPECT_EQ(axis.target_voltage, -1234);
  EXPECT_EQ(axis.target_current, 150);
  EXPECT_GE(quiet, 7u) << "SYNC, three commands, three feedbacks";
  EXPECT_LE(quiet, 14u) << "no slow command";
}

TEST(Exchange, CommandsBeyondTheWiresRangeAreClamped) {
  Rig rig;
  rig.bring_up();
  set_mode(rig, 0, ControlMode::kTorque);
  rig.command.torque_Nm()[0] = 1.0e6;
  rig.command.voltage_V()[0] = -1.0e6;
  rig.steps(2);
  EXPECT_EQ(rig.axis(0).objects().torque_offset, 32767);
  EXPECT_EQ(rig.axis(0).objects().target_voltage, -32768);
}

TEST(Exchange, AccelerationIsTheDifferenceOfVelocities) {
  Rig rig;
  rig.bring_up();
  double before = 0.0;
  for (int i = 1; i <= 20; ++i) {
    rig.position_rad[0] = 0.5e-3 * i * i * 0.01;
    before = rig.state.velocity_rad_s()[0];
    (void)rig.step();
  }
  EXPECT_NE(rig.state.acceleration_rad_s2()[0], 0.0);
  EXPECT_NEAR(rig.state.acceleration_rad_s2()[0], (rig.state.velocity_rad_s()[0] - before) * 1000.0,
              1e-9);
}

TEST(Exchange, SensorChannelsArriveInSi) {
  Rig rig;
  rig.bring_up();
  const auto values = rig.state.sensor_values(0);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(values[i], rig.wrench[i]);
  EXPECT_EQ(rig.state.sensor_age_cycles()[0], 0u);
}

TEST(Exchange, ASilentSensorAgesAndComesBackByItself) {
  Rig rig;
  rig.bring_up();
  rig.sensor_present = false;
  EXPECT_EQ(rig.read(), Code::kTimeout);
  EXPECT_EQ(rig.state.sensor_age_cycles()[0], 1u);
  EXPECT_EQ(rig.state.sensor_values(0)[2], 300.0) << "the last value stays";
  rig.steps(200);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  EXPECT_EQ(rig.master->status_text(),
            "sensor foot (node 40, bus arms): waiting for its boot-up message");
  rig.sensor_present = true;
  rig.wrench[2] = 310.0;
  rig.steps(1500);
  EXPECT_EQ(rig.state.sensor_values(0)[2], 310.0);
  EXPECT_EQ(rig.state.sensor_age_cycles()[0], 0u);
}

TEST(Exchange, GainsThatChangeTravelBySdoOneACycle) {
  Rig rig;
  rig.bring_up();
  rig.parameters.set_gains(3, PidLoop::kPosition, {.kp = 500.0, .ki = 11.0, .kd = 41.0});
  rig.parameters.set_gains(3, PidLoop::kTorque, {.kp = 0.3, .ki = 2.0, .kd = 0.0});
  rig.steps(2);
  EXPECT_EQ(rig.gains(3, 0x2020)[0], 500.0F);
  EXPECT_EQ(rig.gains(3, 0x2020)[1], 10.0F) << "one object at a time";
  rig.steps(8);
  EXPECT_EQ(rig.gains(3, 0x2020), (std::array<float, 4>{500.0F, 11.0F, 41.0F, 100.0F}));
  EXPECT_EQ(rig.gains(3, 0x2022), (std::array<float, 4>{0.3F, 2.0F, 0.0F, 40.0F}));
  EXPECT_EQ(rig.gains(2, 0x2020)[0], 400.0F) << "of this joint alone";
  EXPECT_TRUE(rig.master->warnings().empty());
}

TEST(Exchange, AGainThatTheDriveRefusesIsNamedOfEachBoard) {
  Rig rig;
  rig.bring_up();
  rig.parameters.set_gains(3, PidLoop::kVelocity, {.kp = -1.0, .ki = 0.0, .kd = 0.0});
  rig.steps(10);
  const std::string refused =
      "a value was refused: object 2821:01 of joint Joint3 (board board_1, node 11, axis 1): "
      "value too low (abort code 0x06090032)";
  EXPECT_EQ(rig.master->warnings(), std::vector{refused});
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  rig.parameters.set_gains(0, PidLoop::kCurrent, {.kp = 0.0, .ki = 0.0, .kd = -1.0});
  rig.steps(20);
  ASSERT_EQ(rig.master->warnings().size(), 2u);
  EXPECT_TRUE(rig.master->warnings()[0].starts_with("a value was refused: object 2023:03 of"));
  EXPECT_EQ(rig.master->warnings()[1], refused);
}

TEST(Exchange, FeedbackThatDoesNotComeIsCountedByNode) {
  Rig rig;
  rig.bring_up();
  EXPECT_TRUE(rig.master->warnings().empty());
  rig.present[1] = false;
  rig.steps(3);
  rig.present[1] = true;
  rig.steps(5);
  ASSERT_EQ(rig.master->warnings().size(), 1u);
  EXPECT_EQ(rig.master->warnings()[0],
            "board_1 (node 11 on bus legs): 3 cycles without its feedback");
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
}

TEST(Exchange, AnEmergencyThatNamesNoAxisIsTold) {
  Rig rig;
  rig.bring_up();
  // A vendor's own byte 3, from a board and from the sensor; then one that names an axis.
  const std::array arms{canopen::wire(0x0A8, {0x00, 0x50, 0x81, 0xA0, 1, 2, 3, 4})};
  const std::array legs{canopen::wire(0x08B, {0x40, 0x81, 0x11, 0xA0, 0xFF, 0, 0, 0}),
                        canopen::wire(0x08B, {0x10, 0x81, 0x11, 0x02, 0, 0, 0, 9}),
                        canopen::wire(0x08C, {0x10, 0x82, 0x11, 0x01, 0, 0, 0, 0})};
  (void)rig.legs.boards().send(legs);
  (void)rig.arms.boards().send(arms);
  rig.steps(2);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  EXPECT_EQ(rig.master->warnings(),
            (std::vector<std::string>{
                "board_1 (node 11 on bus legs): emergencies that name no axis: 2; the last: "
                "frames were lost (error code 0x8110), register 0x11, then 02 00 00 00 09",
                "joint Joint5 (board board_2, node 12, axis 1): an emergency without a fault: "
                "PDO too short (error code 0x8210)",
                "foot (node 40 on bus arms): emergencies that name no axis: 1; the last: device "
                "hardware (error code 0x5000), register 0x81, then A0 01 02 03 04"}));
}

TEST(Exchange, AFaultIsNamedByAnEmergencyThatNamesNoAxis) {
  Rig rig;
  rig.bring_up();
  rig.present[1] = false;  // in its place, byte by byte: an emergency, and both axes in fault
  std::array<std::uint8_t, 32> feedback{};
  feedback[0] = feedback[16] = 0x18;
  feedback[1] = feedback[17] = 0x02;
  const std::array frames{canopen::wire(0x08B, {0x31, 0x23, 0x11, 0xA0, 0, 0, 0, 0}),
                          canopen::make_frame(0x18B, feedback)};
  (void)rig.legs.boards().send(frames);
  rig.step();
  const std::string text = rig.master->status_text();
  for (const char* joint :
       {"Joint2 (board board_1, node 11, axis 0): earth leakage of the motor (error code 0x2331)",
        "Joint3 (board board_1, node 11, axis 1): earth leakage of the motor (error code "
        "0x2331)"}) {
    EXPECT_NE(text.find(joint), std::string::npos) << text;
  }
}

TEST(Exchange, CommandsThatABusDoesNotTakeAreCounted) {
  Rig rig;
  rig.bring_up();
  const std::vector<canopen::Frame> many(512, canopen::make_heartbeat(127, {}));
  (void)rig.read();
  (void)rig.legs.master().send(many);  // the queue is full now
  EXPECT_EQ(rig.write(), Code::kQueueFull);
  ASSERT_EQ(rig.master->warnings().size(), 1u);
  EXPECT_EQ(rig.master->warnings()[0], "a bus did not take the commands of 1 cycles");
}

TEST(Exchange, AnIdleJointIsDisabledAndComesBackWhereItIs) {
  Rig rig;
  rig.bring_up();
  set_mode(rig, 2, ControlMode::kIdle);
  rig.steps(8);
  EXPECT_EQ(rig.state.drive_state()[2], static_cast<int>(DriveState::kReadyToSwitchOn));
  EXPECT_EQ(rig.state.mode()[2], static_cast<int>(ControlMode::kIdle));
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  rig.position_rad[2] = 0.3;  // moved by hand
  rig.steps(2);
  set_mode(rig, 2, ControlMode::kPosition);
  rig.command.position_rad()[2] = 0.3;
  rig.steps(8);
  EXPECT_EQ(rig.state.drive_state()[2], static_cast<int>(DriveState::kOperationEnabled));
  EXPECT_EQ(rig.axis(2).objects().target_position, rig.axis(2).objects().position);
}

TEST(Exchange, ShutsDownByQuickStopAndPreOperational) {
  Rig rig;
  rig.bring_up();
  int cycles = 0;
  bool done = false;
  while (!done && cycles < 5000) {
    (void)rig.read();
    done = rig.shut_down();
    ++cycles;
  }
  ASSERT_TRUE(done);
  EXPECT_GT(cycles, 1);
  (void)rig.read();
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_EQ(rig.axis(j).machine().motion(), canopen::DriveMotion::kNone);
  }
  for (const auto& board : rig.boards) {
    EXPECT_EQ(board->nmt_state(), canopen::NmtState::kPreOperational);
  }
}

TEST(Exchange, ASnapshotGoesOnWithTheSameBytes) {
  Rig rig;
  rig.steps(150);  // in the middle of configuration
  Archive saved;
  rig.archive(saved);
  rig.leave(Phase::kBringUp);
  rig.steps(20);
  Archive first;
  rig.archive(first);

  Archive restore(saved.bytes());
  rig.archive(restore);
  ASSERT_TRUE(restore.ok() && restore.at_end());
  rig.leave(Phase::kBringUp);
  rig.steps(20);
  Archive second;
  rig.archive(second);
  ASSERT_EQ(first.bytes().size(), second.bytes().size());
  EXPECT_EQ(std::memcmp(first.bytes().data(), second.bytes().data(), first.bytes().size()), 0);
}

}  // namespace
}  // namespace tandem::hal::can
