#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using test::Rig;
using test::robot_config;

/// Makes joint `j`'s drive fault: its encoder says nothing any more for a moment.
void break_encoder(Rig& rig, std::size_t j) {
  const double before = rig.position_rad[j];
  rig.position_rad[j] = std::nan("");
  rig.steps(3);
  rig.position_rad[j] = before;
  rig.steps(3);
}

void reset(Rig& rig, std::size_t j) {
  rig.command.fault_reset()[j] = 1;
  rig.steps(1);
  rig.command.fault_reset()[j] = 0;
}

RobotConfig with_category(StopCategory category) {
  RobotConfig robot = robot_config();
  for (JointConfig& joint : robot.joints) joint.on_fault = category;
  return robot;
}

TEST(Fault, LatchesWithCauseJointAndTime) {
  Rig rig;
  rig.bring_up();
  const auto at_ms = static_cast<long>(rig.cycle);
  break_encoder(rig, 1);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.state.fault()[1], 0x7300u);
  EXPECT_EQ(rig.state.fault()[0], 0u);
  const std::string text = rig.master->status_text();
  char when[32];
  std::snprintf(when, sizeof when, "at 0.%03ld s", at_ms);
  EXPECT_EQ(text.find("joint Joint1 (board board_0, node 10, axis 1): position sensor "
                      "(error code 0x7300)"),
            0u)
      << text;
  EXPECT_NE(text.find(when), std::string::npos) << text;
  EXPECT_EQ(rig.step(), Code::kFault) << "stays, though the cause is gone";
}

TEST(Fault, Category1QuickStopsEveryAxis) {
  Rig rig(with_category(StopCategory::kCategory1));
  rig.bring_up();
  break_encoder(rig, 1);
  rig.steps(2000);
  for (std::size_t j : {0u, 2u, 3u, 4u, 5u}) {
    EXPECT_EQ(rig.axis(j).objects().controlword, 0x0002);
    EXPECT_EQ(rig.state.drive_state()[j], static_cast<int>(DriveState::kSwitchOnDisabled));
  }
}

TEST(Fault, Category0OpensEveryBridgeAtOnce) {
  Rig rig(with_category(StopCategory::kCategory0));
  rig.bring_up();
  break_encoder(rig, 1);
  for (std::size_t j : {0u, 2u, 3u, 4u, 5u}) {
    EXPECT_EQ(rig.axis(j).objects().controlword, 0x0000);
    EXPECT_EQ(rig.axis(j).machine().motion(), canopen::DriveMotion::kNone);
  }
}

TEST(Fault, CategoryHoldKeepsTheOthersWhereTheyAre) {
  Rig rig(with_category(StopCategory::kHold));
  rig.bring_up();
  break_encoder(rig, 1);
  rig.command.position_rad()[3] = 0.5;  // not followed any more
  rig.steps(20);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  for (std::size_t j : {0u, 2u, 3u, 4u, 5u}) {
    EXPECT_EQ(rig.state.drive_state()[j], static_cast<int>(DriveState::kOperationEnabled));
    EXPECT_EQ(rig.axis(j).objects().target_position, rig.axis(j).objects().position);
  }
}

TEST(Fault, CategoryHoldFollowsABrakingAxisToItsRestAndNoFurther) {
  Rig rig(with_category(StopCategory::kHold));
  rig.bring_up();
  double place = 0.0, speed = 0.0;  // of axis 3
  const auto go = [&](double change) {
    speed += change;
    place += speed;
    rig.command.position_rad()[3] = place;
    rig.command.velocity_rad_s()[3] = speed * 1e3;
    rig.steps(1);
    return rig.axis(3).objects().target_position;
  };
  for (int i = 0; i < 20; ++i) (void)go(1e-4);
  rig.master->stop(StopCategory::kHold);
  for (int i = 0; i < 20; ++i) (void)go(-1e-4);
  const std::int32_t rest = go(0.0);
  EXPECT_NEAR(rest, std::round(place * 5730.0), 4) << "some 5730 counts per rad";
  EXPECT_EQ(go(-1e-2), rest) << "that is no braking";
  EXPECT_EQ(go(0.0), rest);
  EXPECT_EQ(rig.axis(3).objects().velocity_offset, 0);
}

TEST(Fault, CategoryWarnOnlyTells) {
  Rig rig(with_category(StopCategory::kWarn));
  rig.bring_up();
  break_encoder(rig, 1);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  EXPECT_EQ(rig.state.fault()[1], 0x7300u);
  rig.command.position_rad()[3] = 0.01;
  rig.steps(2);
  EXPECT_EQ(rig.axis(3).objects().target_position, 57) << "the others go on";
  rig.steps(2000);
  reset(rig, 1);
  rig.steps(30);
  EXPECT_EQ(rig.state.fault()[1], 0u);
  EXPECT_EQ(rig.state.drive_state()[1], static_cast<int>(DriveState::kOperationEnabled));
}

TEST(Fault, ResetEnablesEveryAxisAtItsMeasuredPosition) {
  Rig rig;
  rig.bring_up();
  break_encoder(rig, 1);
  rig.steps(1500);
  for (double& q : rig.position_rad) q += 0.2;  // sagged in the meantime
  rig.steps(5);
  reset(rig, 1);
  rig.leave(Phase::kFault, 200);
  ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_EQ(rig.state.fault()[j], 0u);
    EXPECT_EQ(rig.state.drive_state()[j], static_cast<int>(DriveState::kOperationEnabled));
    EXPECT_EQ(rig.axis(j).objects().target_position, rig.axis(j).objects().position);
  }
}

TEST(Fault, StaysLatchedWhenTheCauseIsStillThere) {
  Rig rig;
  rig.bring_up();
  rig.position_rad[1] = std::nan("");
  rig.steps(1500);
  reset(rig, 1);
  rig.steps(1500);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.state.fault()[1], 0x7300u);
}

TEST(Fault, WithoutAResetNothingIsEnabledAgain) {
  Rig rig;
  rig.bring_up();
  break_encoder(rig, 1);
  rig.steps(3000);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.state.drive_state()[0], static_cast<int>(DriveState::kSwitchOnDisabled));
}

TEST(Fault, ABoardThatDiesIsNoticedAndNamed) {
  Rig rig;
  rig.bring_up();
  rig.present[2] = false;
  EXPECT_EQ(rig.step(), Code::kTimeout);
  EXPECT_EQ(rig.state.age_cycles()[4], 1u);
  rig.steps(11);
  EXPECT_EQ(rig.master->phase(), Phase::kFault) << "after command_timeout_cycles without TPDO";
  EXPECT_EQ(rig.state.fault()[4], 0x8130u);
  EXPECT_EQ(rig.state.fault()[5], 0x8130u);
  const std::string text = rig.master->status_text();
  EXPECT_EQ(text.find("joint Joint4 (board board_2, node 12, axis 0): board lost"), 0u) << text;
  EXPECT_NE(text.find("no complete TPDO for 10 cycles"), std::string::npos) << text;
}

TEST(Fault, ALostHeartbeatIsNoticedWithoutSupervisionOfPdos) {
  RobotConfig robot = robot_config();
  for (BoardConfig& board : robot.boards) board.command_timeout_cycles = 0;
  Rig rig(robot);
  rig.bring_up();
  rig.present[2] = false;
  rig.steps(100);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  rig.steps(60);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_NE(rig.master->status_text().find("heartbeat lost"), std::string::npos);
  EXPECT_NE(rig.master->status_text().find("(none for 150 ms)"), std::string::npos);
}

TEST(Fault, ABoardThatRebootsIsConfiguredAnewByTheReset) {
  Rig rig;
  rig.bring_up();
  rig.parameters.set_gains(5, PidLoop::kPosition, {.kp = 500.0, .ki = 10.0, .kd = 40.0});
  rig.steps(10);
  rig.boards[2] = std::make_unique<firmware::Board>(test::board_setup(rig.robot, 2));
  rig.steps(5);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_NE(rig.master->status_text().find("booted again by itself"), std::string::npos)
      << rig.master->status_text();
  rig.steps(1500);
  reset(rig, 4);
  rig.leave(Phase::kFault, 2000);
  ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  rig.steps(10);
  EXPECT_EQ(rig.object<std::uint32_t>(5, 0x608F, 1), 36000u);
  EXPECT_EQ(rig.gains(5, 0x2020)[0], 500.0F) << "what was set at run time is sent again";
}

TEST(Fault, ABoardThatCountsAsLostButStillHearsIsStoppedWithTheNextSync) {
  Rig rig;
  rig.bring_up();
  const std::array<canopen::Frame, 1> told{
      canopen::make_heartbeat(12, canopen::NmtState::kPreOperational)};
  (void)rig.legs.boards().send(told);
  rig.steps(1);
  ASSERT_EQ(rig.state.fault()[4], 0x8130u);
  rig.master->stop(StopCategory::kCategory0);
  rig.steps(1);
  for (const std::size_t j : {4u, 5u}) {
    EXPECT_EQ(rig.axis(j).machine().motion(), canopen::DriveMotion::kShorted) << j;
  }
  rig.steps(1500);
  rig.master->reset();
  rig.leave(Phase::kBringUp, 2000);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
}

bool every_axis(const Rig& rig, canopen::DriveMotion motion) {
  for (std::size_t j = 0; j < 6; ++j) {
    if (rig.axis(j).machine().motion() != motion) return false;
  }
  return true;
}

TEST(Stop, OfCategory0OpensEveryBridgeWithTheNextSync) {
  Rig rig;
  rig.bring_up();
  (void)rig.read();
  rig.master->stop(StopCategory::kCategory0);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.write(), Code::kFault);
  (void)rig.read();
  EXPECT_TRUE(every_axis(rig, canopen::DriveMotion::kNone));
  EXPECT_EQ(rig.state.fault()[0], 0u) << "no drive is at fault";
  EXPECT_EQ(rig.master->status_text(), "stopped by request (category0)");
}

TEST(Stop, OfCategory1BringsEveryAxisToRestFirst) {
  Rig rig;
  rig.bring_up();
  (void)rig.read();
  rig.master->stop(StopCategory::kCategory1);
  (void)rig.write();
  (void)rig.read();
  EXPECT_TRUE(every_axis(rig, canopen::DriveMotion::kQuickStop));
  rig.steps(1500);
  EXPECT_TRUE(every_axis(rig, canopen::DriveMotion::kNone));
}

TEST(Stop, TheHardestIsCarriedOutAndNoneSoftensIt) {
  Rig rig;
  rig.bring_up();
  rig.master->stop(StopCategory::kWarn);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  rig.master->stop(StopCategory::kHold);
  rig.steps(5);
  EXPECT_TRUE(every_axis(rig, canopen::DriveMotion::kFollow));
  rig.master->stop(StopCategory::kCategory0);
  rig.master->stop(StopCategory::kHold);
  rig.steps(2);
  EXPECT_TRUE(every_axis(rig, canopen::DriveMotion::kNone));
}

TEST(Stop, StaysUntilTheResetThatEnablesEveryAxisWhereItIs) {
  for (const StopCategory category :
       {StopCategory::kCategory0, StopCategory::kCategory1, StopCategory::kHold}) {
    Rig rig;
    rig.bring_up();
    rig.master->stop(category);
    rig.steps(2000);
    EXPECT_EQ(rig.master->phase(), Phase::kFault);
    for (double& q : rig.position_rad) q += 0.2;
    rig.steps(5);
    reset(rig, 1);
    EXPECT_EQ(rig.master->phase(), Phase::kFault) << "a joint's reset leaves the robot's stop";
    rig.master->reset();
    EXPECT_EQ(rig.master->phase(), Phase::kBringUp);
    EXPECT_LT(rig.leave(Phase::kBringUp, 200), 200);
    ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
    for (std::size_t j = 0; j < 6; ++j) {  // one that never let go keeps what it holds
      const std::int32_t held = category == StopCategory::kHold ? 0 : 1146;
      EXPECT_EQ(rig.axis(j).objects().target_position, held) << to_string(category);
    }
  }
}

TEST(Stop, WhileAResetEnablesTheAxesTakesEffectWithTheNextSync) {
  RobotConfig robot = robot_config();
  robot.joints[1].brake = BrakeConfig{.torque_Nm = 9.0, .release_ms = 40, .engage_ms = 10};
  Rig rig(robot);
  rig.bring_up();
  rig.master->stop(StopCategory::kCategory0);
  rig.steps(50);
  rig.master->reset();
  rig.steps(20);
  ASSERT_EQ(rig.axis(0).machine().motion(), canopen::DriveMotion::kFollow);
  ASSERT_EQ(rig.axis(1).machine().motion(), canopen::DriveMotion::kSlowDown) << "its brake opens";
  (void)rig.read();
  rig.master->stop(StopCategory::kCategory0);
  (void)rig.write();
  (void)rig.read();
  EXPECT_TRUE(every_axis(rig, canopen::DriveMotion::kNone));
}

TEST(Stop, IsResetTogetherWithTheFaultsOfDrivesAndBoards) {
  Rig rig;
  rig.bring_up();
  break_encoder(rig, 1);
  rig.boards[2] = std::make_unique<firmware::Board>(test::board_setup(rig.robot, 2));
  rig.steps(5);
  rig.master->stop(StopCategory::kCategory1);
  rig.steps(1500);
  rig.master->reset();
  rig.leave(Phase::kBringUp, 2000);
  ASSERT_EQ(rig.master->phase(), Phase::kOperational) << rig.master->status_text();
  EXPECT_EQ(rig.object<std::uint32_t>(5, 0x608F, 1), 36000u) << "configured anew";
}

TEST(Stop, IsNotResetWhileACauseIsStillThere) {
  Rig rig;
  rig.bring_up();
  rig.position_rad[1] = std::nan("");
  rig.steps(1500);
  rig.master->reset();
  EXPECT_EQ(rig.leave(Phase::kBringUp, 3000), 1001) << "kResetTimeoutNs";
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.state.fault()[1], 0x7300u);
  for (std::size_t j : {0u, 2u, 3u, 4u, 5u}) {
    EXPECT_EQ(rig.state.drive_state()[j], static_cast<int>(DriveState::kSwitchOnDisabled));
  }
  rig.present[2] = false;
  rig.steps(20);
  rig.position_rad[1] = 0.0;
  rig.master->reset();
  EXPECT_GT(rig.leave(Phase::kBringUp, 5000), 2000) << "a board that is away is waited for";
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  EXPECT_EQ(rig.state.fault()[1], 0u);
  EXPECT_NE(rig.master->status_text().find("board board_2"), std::string::npos);
}

TEST(Stop, AJointThatOnlyWarnsIsResetWhileTheOthersFollow) {
  Rig rig(with_category(StopCategory::kWarn));
  rig.bring_up();
  break_encoder(rig, 1);
  rig.steps(1500);
  rig.master->reset();
  EXPECT_EQ(rig.master->phase(), Phase::kBringUp);
  rig.command.position_rad()[3] = 0.01;
  rig.steps(2);
  EXPECT_EQ(rig.axis(3).objects().target_position, 57);
  rig.leave(Phase::kBringUp, 100);
  EXPECT_EQ(rig.master->phase(), Phase::kOperational);
  EXPECT_EQ(rig.state.fault()[1], 0u);
}

TEST(Stop, DuringBringUpEndsIt) {
  Rig rig;
  rig.steps(20);
  ASSERT_EQ(rig.master->phase(), Phase::kBringUp);
  rig.master->stop(StopCategory::kCategory1);
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
  rig.steps(3000);
  EXPECT_TRUE(every_axis(rig, canopen::DriveMotion::kNone));
  rig.master->reset();
  EXPECT_EQ(rig.master->phase(), Phase::kFault);
}

TEST(Fault, BoardsStopByThemselvesWhenTheMasterDies) {
  Rig rig;
  rig.bring_up();
  // No SYNC, no command, no heartbeat: only the boards' time goes on.
  std::array<firmware::AxisSense, 2> sense;
  for (auto& one : sense) one.bus_voltage_V = 40.0;
  std::array<firmware::AxisDrive, 2> drive;
  for (int ms = 0; ms < 20; ++ms) rig.boards[0]->step(1'000'000, sense, drive);
  EXPECT_NE(rig.boards[0]->axis(0).machine().motion(), canopen::DriveMotion::kFollow);
}

/// Boards of ours, and a run that ends as it should: the silence after it is no error of theirs.
TEST(Fault, TheSilenceAfterACleanRunIsNone) {
  Rig rig;
  rig.bring_up();
  int taken = 0;
  do (void)rig.read();
  while (!rig.shut_down() && ++taken < 4000);
  EXPECT_LT(taken, 1000);
  std::vector<canopen::Frame> heard(64);
  for (int i = 0; i < 2000; ++i) {  // nobody says anything any more
    for (auto& board : rig.boards) {
      std::array<firmware::AxisSense, 2> sense;
      std::array<firmware::AxisDrive, 2> drive;
      for (auto& one : sense) one.bus_voltage_V = 40.0;
      if (i == 0) {
        for (const canopen::Frame& frame : rig.legs.to_boards()) board->receive(frame);
      }
      board->step(1'000'000, sense, drive);
      for (const canopen::Frame& frame : board->outgoing()) {
        EXPECT_NE(frame.id & 0x780, canopen::cob::kEmergency)
            << "code " << canopen::get<std::uint16_t>(frame.data.data()) << ", " << i
            << " ms later";
      }
      board->clear_outgoing();
    }
  }
}

}  // namespace
}  // namespace tandem::hal::can
