// What injected faults do to the robot itself: physics, sensors, boards. How each is noticed and
// answered: tests/runtime/fault_rows_test.cpp.
#include <algorithm>
#include <cmath>

#include "canopen/messages.hpp"
#include "tests/sim/swing_loop.hpp"

namespace tandem::sim {
namespace {

using hal::FaultKind;
using Loop = test::SwingLoop;
using test::swing_robot;

ScenarioFault of(FaultKind kind) {
  ScenarioFault fault;
  fault.kind = kind;
  const bool joint = kind >= FaultKind::kEncoderFreeze && kind <= FaultKind::kSpringBreak;
  const bool board = kind >= FaultKind::kBoardKill && kind <= FaultKind::kSupplySag;
  if (joint) fault.joint = 0;
  if (board) fault.board = 0;
  if (kind == FaultKind::kBusDown) fault.bus = 0;
  return fault;
}

/// A swing that holds, and then has this fault.
struct Faulty : Loop {
  explicit Faulty(const ScenarioFault& fault, int order = 2)
      : Loop(swing_robot(order), {.posture = "up"}, order) {
    bring_up();
    run(200);
    EXPECT_EQ(robot().inject(fault), Code::kOk);
  }
  EmulatedRobot& robot() { return sim_robot->robot(); }
  const firmware::Axis& axis() { return robot().board(0).axis(0); }
  JointReading joint() { return robot().plant().joint(0); }
};

TEST(InjectedFault, AFrozenEncoderStaysWhileTheJointMoves) {
  Faulty loop(of(FaultKind::kEncoderFreeze));
  const double before = loop.axis().measured().link_position_rad;
  loop.command.position_rad()[0] += 0.01;
  loop.run(30);
  EXPECT_NEAR(loop.axis().measured().link_position_rad, before, 2.5e-5);
  EXPECT_GT(std::abs(loop.joint().position_rad - before), 1e-4);
}

TEST(InjectedFault, AnEncoderJumpsByItsAngleAndBack) {
  ScenarioFault fault = of(FaultKind::kEncoderJump);
  fault.value = 0.005;
  fault.duration_ns = 3'000'000;
  Faulty loop(fault);
  for (int i = 0; i < 3; ++i) {
    loop.step();
    EXPECT_NEAR(loop.axis().measured().link_position_rad - loop.joint().position_rad, 0.005, 3e-5);
  }
  loop.step();
  EXPECT_NEAR(loop.axis().measured().link_position_rad, loop.joint().position_rad, 3e-5);
}

TEST(InjectedFault, TheMotorsEncoderIsOneOfItsOwn) {
  ScenarioFault fault = of(FaultKind::kEncoderUnplug);
  fault.encoder = EncoderSide::kMotor;
  Faulty loop(fault);
  loop.step();
  EXPECT_EQ(loop.axis().objects().error_code, 0x7300);
}

TEST(InjectedFault, ABrokenSpringCarriesNothingAndAddsNoEnergy) {
  hal::RobotConfig robot = swing_robot();
  robot.boards[0].command_timeout_cycles = 0;
  Loop loop(robot, {.integrator = Integrator::kRungeKutta4, .posture = "up"});
  loop.bring_up();
  loop.run(1500);
  EmulatedRobot& emulated = loop.sim_robot->robot();
  ASSERT_GT(std::abs(emulated.plant().joint(0).torque_Nm), 1.0) << "it carries the link";
  ScenarioFault off = of(FaultKind::kBoardKill);  // nobody drives it any more
  ASSERT_EQ(emulated.inject(off), Code::kOk);
  ASSERT_EQ(emulated.inject(of(FaultKind::kSpringBreak)), Code::kOk);
  const ActuatorModel& m = emulated.plant().actuators().model(0);
  const auto energy = [&] {  // of link and rotor: a point of 2 kg at 0.5 m, hanging at 0
    const JointReading j = emulated.plant().joint(0);
    const double link = 0.5 * 2.0 * 0.25 * j.velocity_rad_s * j.velocity_rad_s -
                        2.0 * 9.81 * 0.5 * std::cos(j.position_rad);
    return link + 0.5 * m.inertia_kg_m2 * j.motor_velocity_rad_s * j.motor_velocity_rad_s;
  };
  double before = energy();
  for (int i = 0; i < 1000; ++i) {
    loop.step();
    ASSERT_EQ(emulated.plant().joint(0).torque_Nm, 0.0);
    ASSERT_LT(energy(), before + 1e-6);
    before = std::max(before, energy());
  }
}

TEST(InjectedFault, AnOverheatedWindingIsMeasuredAndCools) {
  ScenarioFault fault = of(FaultKind::kMotorOverheat);
  fault.value = 100.0;
  fault.ramp_ns = 10'000'000;
  fault.duration_ns = 20'000'000;
  Faulty loop(fault);
  loop.run(6);
  EXPECT_NEAR(loop.joint().temperature_C, 25.0 + 75.0 * 0.5, 0.1);
  loop.run(14);
  EXPECT_NEAR(loop.joint().temperature_C, 100.0, 0.1);
  loop.run(500);
  EXPECT_LT(loop.joint().temperature_C, 99.9);
}

TEST(InjectedFault, ASaggingSupplyIsMeasuredAndBoundsTheBridge) {
  ScenarioFault fault = of(FaultKind::kSupplySag);
  fault.value = 30.0;
  fault.ramp_ns = 10'000'000;
  Faulty loop(fault);
  loop.run(6);
  EXPECT_NEAR(loop.axis().measured().bus_voltage_V, 35.0, 1e-9);
  loop.command.position_rad()[0] += 0.4;
  for (int i = 0; i < 200; ++i) {
    loop.step();
    ASSERT_LE(std::abs(loop.joint().voltage_V), loop.axis().measured().bus_voltage_V);
  }
}

TEST(InjectedFault, ABoardWithoutPowerIsSilentAndBootsWhenItIsBack) {
  ScenarioFault fault = of(FaultKind::kBoardKill);
  fault.duration_ns = 50'000'000;
  Faulty loop(fault);
  loop.run(1);
  EXPECT_EQ(loop.joint().voltage_V, 0.0);
  EXPECT_EQ(loop.joint().current_A, 0.0);
  EXPECT_EQ(loop.state.age_cycles()[0], 1U);
  loop.run(49);
  EXPECT_EQ(loop.state.age_cycles()[0], 50U);
  EXPECT_EQ(loop.robot().board(0).nmt_state(), canopen::NmtState::kOperational) << "not heard";
  loop.run(1);
  EXPECT_EQ(loop.robot().board(0).nmt_state(), canopen::NmtState::kPreOperational);
}

TEST(InjectedFault, AResetBoardForgetsItsConfiguration) {
  Faulty loop(of(FaultKind::kBoardReset));
  ASSERT_EQ(loop.robot().board(0).dictionary().value<std::uint16_t>(0x1017, 0), 50);
  loop.run(1);
  EXPECT_EQ(loop.robot().board(0).dictionary().value<std::uint16_t>(0x1017, 0), 0);
  EXPECT_EQ(loop.axis().machine().motion(), canopen::DriveMotion::kNone);
  EXPECT_EQ(loop.joint().voltage_V, 0.0);
}

TEST(InjectedFault, AnotherIdentityIsReadWhileItLasts) {
  ScenarioFault fault = of(FaultKind::kBoardIdentity);
  fault.number = 0x1234;
  fault.duration_ns = 5'000'000;
  Faulty loop(fault);
  const auto product = [&] {
    return loop.robot().board(0).dictionary().value<std::uint32_t>(0x1018, canopen::kProduct);
  };
  loop.run(1);
  EXPECT_EQ(product(), 0x1234U);
  loop.run(5);
  EXPECT_EQ(product(), canopen::kBoardProduct);
}

TEST(InjectedFault, ASecondBoardAnswersUnderTheSameIdentifiers) {
  SimRobotConfig config{.posture = "up"};
  config.faults = {of(FaultKind::kBoardDuplicate)};
  auto made = EmulatedRobot::create(swing_robot(), test::swing_kernels(2), config);
  ASSERT_TRUE(made);
  ASSERT_EQ((*made)->step(0), Code::kOk);
  std::array<canopen::Frame, 16> answers;
  const std::size_t count = (*made)->bus(0).master().receive(answers);
  EXPECT_EQ(std::count_if(answers.begin(), answers.begin() + static_cast<std::ptrdiff_t>(count),
                          [](const canopen::Frame& one) { return one.id == 0x701; }),
            2);
  EXPECT_EQ((*made)->inject(of(FaultKind::kBoardDuplicate)), Code::kOutOfRange);
}

TEST(InjectedFault, AMissingBoardNeverBoots) {
  SimRobotConfig config{.posture = "up"};
  config.faults = {of(FaultKind::kBoardKill)};
  Loop loop(swing_robot(), config);
  loop.run(3100);
  EXPECT_EQ(loop.sim_robot->phase(), hal::Phase::kFault);
  EXPECT_NE(loop.sim_robot->status_text().find("no boot-up message"), std::string::npos);
}

TEST(InjectedFault, SnapshotsHoldEveryKindOfFault) {
  SimRobotConfig config{.posture = "up"};
  for (const FaultKind kind :
       {FaultKind::kFrameDelay, FaultKind::kFrameReorder, FaultKind::kEncoderFreeze,
        FaultKind::kEncoderJump, FaultKind::kMotorOverheat, FaultKind::kSupplySag,
        FaultKind::kBoardDuplicate, FaultKind::kSpringBreak}) {
    ScenarioFault fault = of(kind);
    fault.from = FaultFrom::kEnabled;
    fault.start_ns = 100'000'000;
    fault.value = kind == FaultKind::kEncoderJump ? 0.001 : 30.0;
    fault.probability = is_frame_fault(kind) ? 0.05 : 1.0;
    fault.ramp_ns = 400'000'000;
    config.faults.push_back(fault);
  }
  Loop loop(swing_robot(), config);
  loop.bring_up();
  loop.run(300);  // during all of them
  const std::vector<std::byte> saved = loop.bytes();
  const auto on = [&] {
    loop.run(400);
    return loop.bytes();
  };
  const std::vector<std::byte> first = on();
  Archive restore(saved);
  ASSERT_TRUE(loop.sim_robot->archive(restore));
  restore(loop.state, loop.command, loop.time);
  ASSERT_TRUE(restore.ok() && restore.at_end());
  EXPECT_EQ(on(), first);
}

}  // namespace
}  // namespace tandem::sim
