#include "canopen/drive_machine.hpp"

#include "base/archive.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {
namespace {

using enum DriveMachineState;

struct Drive : testing::Test {
  DriveMachine drive;
  DriveInputs inputs;
  DriveOptions options;

  DriveMachineState step(int word) {
    return drive.step(static_cast<std::uint16_t>(word), inputs, options);
  }
  void enable() {
    for (const int word : {0x00, 0x06, 0x07, 0x0F}) step(word);
    ASSERT_EQ(drive.state(), kOperationEnabled);
  }
};

TEST(DriveStates, AreReadFromTheProfilesStatuswords) {
  EXPECT_EQ(drive_state(0x0000), kNotReadyToSwitchOn);
  EXPECT_EQ(drive_state(0x0250), kSwitchOnDisabled);
  EXPECT_EQ(drive_state(0x0231), kReadyToSwitchOn);
  EXPECT_EQ(drive_state(0x0233), kSwitchedOn);
  EXPECT_EQ(drive_state(0x1637), kOperationEnabled);
  EXPECT_EQ(drive_state(0x0217), kQuickStopActive);
  EXPECT_EQ(drive_state(0x021F), kFaultReactionActive);
  EXPECT_EQ(drive_state(0x0218), kFault);
  EXPECT_EQ(drive_state(0x0238), kFault) << "bit 5 plays no part in a fault";
}

TEST_F(Drive, GoesUpByTransitions0To4WithTheProfilesStatuswords) {
  EXPECT_EQ(drive.state(), kNotReadyToSwitchOn);
  EXPECT_EQ(step(0x00), kSwitchOnDisabled);
  EXPECT_EQ(drive.statusword(), 0x0250);
  EXPECT_EQ(step(0x06), kReadyToSwitchOn);
  EXPECT_EQ(drive.statusword(), 0x0231);
  EXPECT_EQ(step(0x07), kSwitchedOn);
  EXPECT_EQ(drive.statusword(), 0x0233);
  EXPECT_EQ(drive.motion(), DriveMotion::kNone);
  EXPECT_EQ(step(0x0F), kOperationEnabled);
  EXPECT_EQ(drive.statusword(), 0x0237);
  EXPECT_EQ(drive.motion(), DriveMotion::kFollow);
}

TEST_F(Drive, EnableOperationFromReadySwitchesOnFirst) {
  step(0x00);
  step(0x06);
  EXPECT_EQ(step(0x0F), kSwitchedOn);
  EXPECT_EQ(step(0x0F), kOperationEnabled);
}

TEST_F(Drive, DoesNotSkipShutdown) {
  step(0x00);
  EXPECT_EQ(step(0x0F), kSwitchOnDisabled);
  EXPECT_EQ(step(0x07), kSwitchOnDisabled);
}

TEST_F(Drive, MakesEveryDownwardTransition) {
  enable();
  EXPECT_EQ(step(0x07), kOperationEnabled);  // 5 on the slow-down ramp
  EXPECT_EQ(drive.motion(), DriveMotion::kSlowDown);
  inputs.at_rest = true;
  EXPECT_EQ(step(0x07), kSwitchedOn);
  EXPECT_EQ(step(0x06), kReadyToSwitchOn);   // 6
  EXPECT_EQ(step(0x00), kSwitchOnDisabled);  // 7
  enable();
  EXPECT_EQ(step(0x06), kReadyToSwitchOn);   // 8, disabled at once by default
  EXPECT_EQ(step(0x02), kSwitchOnDisabled);  // 7 by quick stop
  enable();
  EXPECT_EQ(step(0x0D), kSwitchOnDisabled);  // 9
  step(0x06);
  step(0x07);
  EXPECT_EQ(step(0x00), kSwitchOnDisabled);  // 10
  step(0x06);
  step(0x07);
  EXPECT_EQ(step(0x0B), kSwitchOnDisabled);  // 10 by quick stop
}

TEST_F(Drive, ShutdownOnTheRampWhenItsOptionSaysSo) {
  options.shutdown = 1;
  enable();
  EXPECT_EQ(step(0x06), kOperationEnabled);
  EXPECT_EQ(drive.motion(), DriveMotion::kSlowDown);
  inputs.at_rest = true;
  EXPECT_EQ(step(0x06), kReadyToSwitchOn);
}

TEST_F(Drive, QuickStopRampsAndThenDisables) {
  enable();
  EXPECT_EQ(step(0x02), kQuickStopActive);  // 11
  EXPECT_EQ(drive.statusword(), 0x0217);
  EXPECT_EQ(drive.motion(), DriveMotion::kQuickStop);
  EXPECT_EQ(step(0x0F), kQuickStopActive) << "option 2 does not come back";
  inputs.at_rest = true;
  EXPECT_EQ(step(0x02), kSwitchOnDisabled);  // 12
}

TEST_F(Drive, QuickStopOptionsChooseTheRampAndWhereItEnds) {
  options.quick_stop = 0;
  enable();
  EXPECT_EQ(step(0x02), kSwitchOnDisabled);
  options.quick_stop = 1;
  enable();
  step(0x02);
  EXPECT_EQ(drive.motion(), DriveMotion::kSlowDown);
  step(0x00);
  EXPECT_EQ(drive.state(), kSwitchOnDisabled);
  options.quick_stop = 6;
  enable();
  inputs.at_rest = true;
  step(0x02);
  EXPECT_EQ(step(0x02), kQuickStopActive) << "option 6 stays";
  EXPECT_EQ(step(0x0F), kOperationEnabled);  // 16
}

TEST_F(Drive, ARampThatHasComeToRestGoesOnWithTheShortedWinding) {
  enable();
  step(0x02);
  inputs.at_rest = inputs.standstill = true;
  EXPECT_EQ(step(0x02), kQuickStopActive);
  EXPECT_EQ(drive.motion(), DriveMotion::kShorted);
  inputs.at_rest = inputs.standstill = false;  // the load moves it
  EXPECT_EQ(step(0x02), kQuickStopActive);
  inputs.at_rest = true;
  EXPECT_EQ(step(0x02), kSwitchOnDisabled);
}

TEST_F(Drive, StopsOnTheWindingWhereOptionMinusOneSaysSo) {
  options.quick_stop = -1;
  enable();
  EXPECT_EQ(step(0x02), kQuickStopActive);
  EXPECT_EQ(drive.motion(), DriveMotion::kShorted);
  inputs.at_rest = true;
  EXPECT_EQ(step(0x0F), kSwitchOnDisabled);
  options.fault_reaction = 2;
  enable();
  inputs.fault = true;
  step(0x0F);
  EXPECT_EQ(drive.motion(), DriveMotion::kQuickStop);
}

/// CiA 402's table of commands has bit 7 at 0 in every row but the fault reset's.
TEST_F(Drive, WithBit7NoOtherBitIsACommand) {
  options.quick_stop = 6;
  for (const std::vector<int>& path : {std::vector<int>{0x00},
                                       {0x00, 0x06},
                                       {0x00, 0x06, 0x07},
                                       {0x00, 0x06, 0x07, 0x0F},
                                       {0x00, 0x06, 0x07, 0x0F, 0x02}}) {
    for (int bits = 0; bits < 0x10; ++bits) {
      drive.reset();
      for (const int word : path) step(word);
      const DriveMachineState before = drive.state();
      const DriveMotion motion = drive.motion();
      for (int k = 0; k < 3; ++k) step(0x80 | bits);
      EXPECT_EQ(drive.state(), before) << std::hex << bits;
      EXPECT_EQ(drive.motion(), motion) << std::hex << bits;
    }
  }
}

TEST_F(Drive, AStopUnderWayEndsWhateverBit7Says) {
  enable();
  step(0x02);
  inputs.at_rest = true;
  EXPECT_EQ(step(0x8F), kSwitchOnDisabled);
}

TEST_F(Drive, ShowsTargetReachedWhereAStopThatStaysHasComeToRest) {
  constexpr int kBit10 = 0x0400;
  const auto reached = [&](int word) {
    step(word);
    return (drive.statusword() & kBit10) != 0;
  };
  options.quick_stop = 5;
  enable();
  inputs.standstill = true;
  EXPECT_FALSE(reached(0x0F)) << "a cyclic mode";
  inputs.standstill = false;
  EXPECT_FALSE(reached(0x10F)) << "halt, still moving";
  inputs.standstill = true;
  EXPECT_TRUE(reached(0x10F)) << "halt";
  EXPECT_TRUE(reached(0x02)) << "quick stop that stays";
  inputs.standstill = false;
  enable();
  inputs.standstill = true;
  EXPECT_FALSE(reached(0x07)) << "disable operation: on its way";
  options.quick_stop = 2;
  enable();
  EXPECT_FALSE(reached(0x02)) << "on its way";
}

TEST_F(Drive, AFaultReactsLatchesAndNeedsARisingEdge) {
  enable();
  inputs.fault = true;
  EXPECT_EQ(step(0x0F), kFaultReactionActive);  // 13
  EXPECT_EQ(drive.statusword(), 0x021F);
  EXPECT_EQ(drive.motion(), DriveMotion::kShorted);
  EXPECT_EQ(step(0x0F), kFaultReactionActive);
  inputs.at_rest = true;
  EXPECT_EQ(step(0x0F), kFault);  // 14
  EXPECT_EQ(drive.statusword(), 0x0218);
  EXPECT_EQ(drive.motion(), DriveMotion::kNone);
  EXPECT_EQ(step(0x80), kFault) << "the cause is still there";
  inputs.fault = false;
  EXPECT_EQ(step(0x80), kFault) << "no edge";
  EXPECT_EQ(step(0x00), kFault);
  EXPECT_EQ(step(0x80), kSwitchOnDisabled);  // 15
  EXPECT_TRUE(drive.fault_was_reset());
  step(0x80);
  EXPECT_FALSE(drive.fault_was_reset());
}

TEST_F(Drive, FaultReactionOptionZeroOrNoPowerGoesStraightToFault) {
  options.fault_reaction = 0;
  enable();
  inputs.fault = true;
  EXPECT_EQ(step(0x0F), kFaultReactionActive);
  EXPECT_EQ(drive.motion(), DriveMotion::kNone);
  EXPECT_EQ(step(0x0F), kFault);
}

TEST_F(Drive, AResetBitThatIsSetAtPowerOnIsNoEdge) {
  inputs.fault = true;
  step(0x80);
  inputs.fault = false;
  step(0x80);
  EXPECT_EQ(step(0x80), kFault);
}

TEST_F(Drive, HaltKeepsTheStateAndStopsTheMotion) {
  enable();
  EXPECT_EQ(step(0x10F), kOperationEnabled);
  EXPECT_EQ(drive.motion(), DriveMotion::kSlowDown);
  EXPECT_EQ(step(0x0F), kOperationEnabled);
  EXPECT_EQ(drive.motion(), DriveMotion::kFollow);
}

TEST_F(Drive, ALostConnectionFollowsItsOption) {
  enable();
  drive.abort_connection(0, options);
  EXPECT_EQ(drive.state(), kOperationEnabled);
  drive.abort_connection(3, options);
  EXPECT_EQ(drive.state(), kQuickStopActive);
  step(0x00);
  enable();
  drive.abort_connection(2, options);
  EXPECT_EQ(drive.state(), kSwitchOnDisabled);
}

TEST_F(Drive, ShowsTheInputsInItsStatusword) {
  enable();
  inputs = {
      .internal_limit = true, .follows_command = true, .following_error = true, .warning = true};
  step(0x0F);
  EXPECT_EQ(drive.statusword(), 0x0237 | 0x0080 | 0x0800 | 0x1000 | 0x2000);
}

TEST_F(Drive, TheMastersControlwordsLeadToOperationEnabled) {
  std::vector<DriveMachineState> path;
  for (int i = 0; i < 5; ++i) {
    path.push_back(step(controlword_towards_enabled(drive_state(drive.statusword()))));
  }
  EXPECT_EQ(path, (std::vector<DriveMachineState>{kSwitchOnDisabled, kReadyToSwitchOn, kSwitchedOn,
                                                  kOperationEnabled, kOperationEnabled}));
}

TEST_F(Drive, ArchiveRestoresARampInProgress) {
  enable();
  step(0x07);
  Archive saved;
  drive.archive(saved);
  DriveMachine other;
  Archive restore(saved.bytes());
  other.archive(restore);
  inputs.at_rest = true;
  EXPECT_EQ(other.step(0x07, inputs, options), kSwitchedOn);
}

// --- with a brake ---

struct Braked : Drive {
  Braked() { inputs.has_brake = true; }
  DriveMachineState step(int word, bool moved) {
    inputs.brake_moved = moved;
    return Drive::step(word);
  }
  void enable() {
    for (const int word : {0x00, 0x06, 0x07, 0x0F}) step(word, true);
    step(0x0F, true);
    ASSERT_EQ(drive.state(), kOperationEnabled);
    ASSERT_FALSE(drive.brake_set());
  }
};

TEST_F(Braked, HoldsInSwitchedOnUntilTheBrakeIsOpen) {
  for (const int word : {0x00, 0x06, 0x07}) step(word, true);
  EXPECT_TRUE(drive.brake_set());
  EXPECT_EQ(step(0x0F, true), kSwitchedOn) << "it has not even been told";
  EXPECT_FALSE(drive.brake_set());
  EXPECT_EQ(drive.motion(), DriveMotion::kSlowDown) << "the bridge holds";
  EXPECT_EQ(step(0x0F, false), kSwitchedOn);
  EXPECT_EQ(drive.statusword(), 0x0233);
  EXPECT_EQ(step(0x0F, true), kOperationEnabled);
  EXPECT_EQ(drive.motion(), DriveMotion::kFollow);
}

TEST_F(Braked, SetsTheBrakeAgainWhenEnablingIsGivenUp) {
  for (const int word : {0x07, 0x06, 0x00, 0x02}) {
    drive.reset();
    for (const int up : {0x00, 0x06, 0x07, 0x0F}) step(up, true);
    ASSERT_FALSE(drive.brake_set());
    step(word, false);
    EXPECT_TRUE(drive.brake_set()) << word;
    EXPECT_EQ(drive.motion(), DriveMotion::kNone) << word;
  }
}

TEST_F(Braked, KeepsTheBridgeUntilTheBrakeHoldsAfterEveryRamp) {
  struct Case {
    int word;
    bool fault;
    DriveMachineState during, after;
  };
  for (const Case& one : {Case{0x02, false, kQuickStopActive, kSwitchOnDisabled},
                          Case{0x07, false, kOperationEnabled, kSwitchedOn},
                          Case{0x0F, true, kFaultReactionActive, kFault}}) {
    SCOPED_TRACE(one.word);
    drive.reset();
    inputs.at_rest = inputs.fault = false;
    enable();
    inputs.fault = one.fault;
    EXPECT_EQ(step(one.word, true), one.during);
    EXPECT_FALSE(drive.brake_set()) << "it still moves";
    inputs.at_rest = true;
    EXPECT_EQ(step(one.word, true), one.during);
    EXPECT_TRUE(drive.brake_set());
    inputs.at_rest = false;  // what rests is not released again
    EXPECT_EQ(step(one.word, false), one.during);
    EXPECT_TRUE(drive.brake_set());
    EXPECT_NE(drive.motion(), DriveMotion::kNone);
    EXPECT_EQ(step(one.word, true), one.after);
    EXPECT_EQ(drive.motion(), DriveMotion::kNone);
  }
}

TEST_F(Braked, OpensTheBridgeAtOnceWhereThatIsAskedAndSetsTheBrakeWithIt) {
  enable();
  EXPECT_EQ(step(0x00, true), kSwitchOnDisabled);
  EXPECT_EQ(drive.motion(), DriveMotion::kNone);
  EXPECT_TRUE(drive.brake_set());
  drive.reset();
  enable();
  options.fault_reaction = 0;
  inputs.fault = true;
  step(0x0F, true);
  EXPECT_EQ(drive.motion(), DriveMotion::kNone);
  EXPECT_TRUE(drive.brake_set());
}

TEST_F(Braked, LeavesTheBrakeOpenWhereAStopStaysUnderPower) {
  options.quick_stop = 6;
  enable();
  step(0x02, true);
  inputs.at_rest = true;
  for (int k = 0; k < 5; ++k) EXPECT_EQ(step(0x02, true), kQuickStopActive);
  EXPECT_FALSE(drive.brake_set());
  EXPECT_EQ(step(0x0F, true), kOperationEnabled);
}

}  // namespace
}  // namespace tandem::canopen
