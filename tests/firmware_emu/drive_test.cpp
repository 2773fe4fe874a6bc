// Every transition of the CiA 402 machine, as the axis makes it with its bridge.
#include <gtest/gtest.h>

#include <cmath>

#include "rig.hpp"

namespace tandem::firmware::testing {
namespace {

using canopen::DriveMachineState;

struct Drive : ::testing::Test {
  Drive() { rig.start(); }
  void order(std::uint16_t word, int cycles = 3) {
    rig.commands[0].controlword = word;
    rig.cycles(cycles);
  }
  [[nodiscard]] DriveMachineState state() const { return rig.state(); }
  [[nodiscard]] bool bridge() const { return rig.drives[0].enabled; }
  Rig rig;
};

TEST_F(Drive, StartsDisabledByItself) {  // 0, 1
  order(0x00);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
  EXPECT_EQ(rig.statusword() & 0x4F, 0x40);
}

TEST_F(Drive, GoesUpAndDownOneStateAtATime) {  // 2, 3, 6, 7
  order(0x06);
  EXPECT_EQ(state(), DriveMachineState::kReadyToSwitchOn);
  EXPECT_EQ(rig.statusword() & 0x6F, 0x21);
  order(0x07);
  EXPECT_EQ(state(), DriveMachineState::kSwitchedOn);
  EXPECT_EQ(rig.statusword() & 0x6F, 0x23);
  EXPECT_FALSE(bridge());
  order(0x06);
  EXPECT_EQ(state(), DriveMachineState::kReadyToSwitchOn);
  order(0x00);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
}

TEST_F(Drive, GoesFromSwitchedOnToDisabledOnDisableVoltageAndQuickStop) {  // 10
  order(0x06);
  order(0x07);
  order(0x02);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
  order(0x06);
  order(0x07);
  order(0x00);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
}

TEST_F(Drive, ClosesTheBridgeInOperationEnabledOnly) {  // 4
  order(0x06);
  order(0x07);
  order(0x0F);
  EXPECT_EQ(state(), DriveMachineState::kOperationEnabled);
  EXPECT_EQ(rig.statusword() & 0x6F, 0x27);
  EXPECT_TRUE(bridge());
}

TEST_F(Drive, OpensTheBridgeAtOnceOnDisableVoltage) {  // 9
  rig.enable();
  order(0x00, 1);  // takes effect at the next SYNC
  order(0x00, 1);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
  EXPECT_FALSE(bridge());
  EXPECT_EQ(rig.drives[0].voltage_V, 0.0);
}

TEST_F(Drive, OpensTheBridgeAtOnceOnShutdown) {  // 8, option 605B = 0
  rig.enable();
  order(0x06, 2);
  EXPECT_EQ(state(), DriveMachineState::kReadyToSwitchOn);
  EXPECT_FALSE(bridge());
}

TEST_F(Drive, ComesToRestBeforeItDisablesOperation) {  // 5, option 605C = 1
  rig.enable(-2);
  ASSERT_EQ(rig.write<std::int16_t>(0x2012, 0, 2000), 0U);
  rig.cycles(30);
  ASSERT_GT(rig.joints[0].w, 0.3);
  order(0x07, 4);
  EXPECT_EQ(state(), DriveMachineState::kOperationEnabled);  // still stopping
  EXPECT_TRUE(bridge());
  order(0x07, 1100);
  EXPECT_EQ(state(), DriveMachineState::kSwitchedOn);
  EXPECT_FALSE(bridge());
}

TEST_F(Drive, DisablesOperationAtOnceByOption) {  // 5, option 605C = 0
  ASSERT_EQ(rig.write<std::int16_t>(0x605C, 0, 0), 0U);
  rig.enable();
  order(0x07, 2);
  EXPECT_EQ(state(), DriveMachineState::kSwitchedOn);
}

TEST_F(Drive, BrakesOnQuickStopThenDisables) {  // 11, 12, option 605A = 2
  rig.enable(-2);
  ASSERT_EQ(rig.write<std::int16_t>(0x2012, 0, 2000), 0U);
  rig.cycles(30);
  order(0x02, 3);
  EXPECT_EQ(state(), DriveMachineState::kQuickStopActive);
  EXPECT_TRUE(bridge());
  order(0x02, 1100);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
  EXPECT_FALSE(bridge());
}

TEST_F(Drive, StaysInQuickStopByOptionAndComesBack) {  // 16, option 605A = 6
  ASSERT_EQ(rig.write<std::int16_t>(0x605A, 0, 6), 0U);
  rig.enable();
  order(0x02, 2000);
  EXPECT_EQ(state(), DriveMachineState::kQuickStopActive);
  EXPECT_EQ(rig.drives[0].voltage_V, 0.0);
  order(0x0F, 3);
  EXPECT_EQ(state(), DriveMachineState::kOperationEnabled);
}

/// A link with inertia that a load pulls, in velocity control at 0.5 rad/s upwards.
struct Loaded {
  explicit Loaded(std::uint16_t option_object, std::int16_t option) {
    rig.joints[0].link_inertia = 0.5;
    rig.joints[0].load_Nm = -15.0;
    rig.joints[0].th = -15.0 / rig.joints[0].Ks;
    rig.start();
    EXPECT_EQ(rig.write<std::int16_t>(option_object, 0, option), 0U);
    EXPECT_EQ(rig.write<std::uint32_t>(0x6085, 0, Rig::counts(1.0)), 0U);  // 1 rad/s^2
    rig.enable(9);
    rig.commands[0].velocity_offset = Rig::counts(0.5);
    rig.cycles(1500);
    EXPECT_NEAR(rig.joints[0].v, 0.5, 0.05);
  }
  /// @return how far the link goes in `ms` from now on
  double travel(std::uint16_t word, int ms) {
    rig.commands[0].controlword = word;
    const double from = rig.joints[0].q;
    rig.cycles(ms);
    return rig.joints[0].q - from;
  }
  Rig rig;
};

constexpr double kRampWay_rad = 0.5 * 0.5 / (2.0 * 1.0);  // v^2 / 2a

TEST(QuickStop, RampsDownAtTheDecelerationOf6085AndHolds) {
  Loaded one(0x605A, 6);
  const double first = one.travel(0x02, 250);
  EXPECT_NEAR(one.rig.joints[0].v, 0.25, 0.1) << "half of the ramp";
  EXPECT_NEAR(first + one.travel(0x02, 750), kRampWay_rad, 0.03);
  EXPECT_EQ(one.rig.state(), DriveMachineState::kQuickStopActive);
  EXPECT_NEAR(one.travel(0x02, 500), 0.0, 0.005) << "the load does not move it";
  EXPECT_EQ(one.rig.statusword() & 0x0400, 0x0400);
}

TEST(QuickStop, KeepsTheTorqueWhileItRampsThenSinksAndIsDisabled) {
  Loaded one(0x605A, 2);
  const auto motion = [&one] { return one.rig.board.axis(0).machine().motion(); };
  double way = one.travel(0x02, 2);
  int ms = 0;
  for (; ms < 2000 && motion() == canopen::DriveMotion::kQuickStop; ++ms) {
    way += one.travel(0x02, 1);
  }
  EXPECT_NEAR(way, kRampWay_rad, 0.03);
  EXPECT_GT(ms, 400);
  EXPECT_EQ(motion(), canopen::DriveMotion::kShorted);
  EXPECT_EQ(one.rig.state(), DriveMachineState::kQuickStopActive);
  one.travel(0x02, 1000);
  EXPECT_EQ(one.rig.state(), DriveMachineState::kSwitchOnDisabled);
  EXPECT_FALSE(one.rig.drives[0].enabled);
}

TEST(QuickStop, HaltOnTheRampHoldsInVelocityControl) {
  Loaded one(0x605D, 2);
  one.travel(0x10F, 1000);
  EXPECT_EQ(one.rig.state(), DriveMachineState::kOperationEnabled);
  EXPECT_NEAR(one.travel(0x10F, 500), 0.0, 0.005);
  EXPECT_EQ(one.rig.statusword() & 0x0400, 0x0400);
  EXPECT_GT(one.travel(0x0F, 1500), 0.3) << "and goes on";
}

TEST(QuickStop, ShortsTheWindingWithoutSensorsOrGains) {
  Loaded blind(0x605A, 6);
  ASSERT_EQ(blind.rig.write(0x2020, 1, 0.0F), 0U);
  blind.rig.cycle();
  blind.travel(0x02, 20);
  const double sinks = blind.travel(0x02, 1000);
  EXPECT_LT(sinks, -0.1) << "nothing but the winding brakes it";
}

TEST_F(Drive, HasAnInterpolationPeriod) {
  EXPECT_EQ(rig.read<std::uint8_t>(0x60C2, 1), 1U);
  EXPECT_EQ(rig.read<std::int8_t>(0x60C2, 2), -3);
  EXPECT_EQ(rig.write<std::uint8_t>(0x60C2, 1, 4), 0U);
  EXPECT_EQ(rig.read<std::uint8_t>(0x60C2, 1), 4U);
}

TEST_F(Drive, DisablesAtOnceOnQuickStopByOption) {  // 11 with option 605A = 0
  ASSERT_EQ(rig.write<std::int16_t>(0x605A, 0, 0), 0U);
  rig.enable();
  order(0x02, 2);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
}

TEST_F(Drive, HoldsOnHaltAndGoesOnAfterwards) {
  rig.enable(10);
  rig.commands[0].torque_offset = 100;
  rig.cycles(200);
  order(0x10F, 500);
  EXPECT_EQ(state(), DriveMachineState::kOperationEnabled);
  EXPECT_NEAR(rig.joints[0].w, 0.0, 0.02);
  rig.joints[0].q += 0.001;
  order(0x0F, 3000);
  EXPECT_NEAR(rig.joints[0].torque(), 5.0, 0.2);
}

TEST_F(Drive, ReactsToAFaultThenWaitsForTheResetEdge) {  // 13, 14, 15
  rig.enable();
  rig.joints[0].temperature_C = 200.0;
  rig.cycle();
  EXPECT_EQ(state(), DriveMachineState::kFaultReactionActive);
  EXPECT_TRUE(bridge());
  rig.cycles(1100);
  EXPECT_EQ(state(), DriveMachineState::kFault);
  EXPECT_FALSE(bridge());
  rig.joints[0].temperature_C = 25.0;
  order(0x0F, 10);
  EXPECT_EQ(state(), DriveMachineState::kFault);
  order(0x80, 3);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
  EXPECT_EQ(rig.error(), 0);
}

TEST_F(Drive, OpensTheBridgeAtOnceOnAFaultByOption) {  // 14, option 605E = 0
  ASSERT_EQ(rig.write<std::int16_t>(0x605E, 0, 0), 0U);
  rig.enable();
  rig.joints[0].temperature_C = 200.0;
  rig.cycles(2);
  EXPECT_EQ(state(), DriveMachineState::kFault);
  EXPECT_FALSE(bridge());
}

TEST_F(Drive, SeedsTheReferenceWhereItIsWhenItIsEnabled) {
  rig.joints[0].q = rig.joints[0].th = 0.4;
  rig.enable();
  rig.commands[0].controlword = 0x00;
  rig.cycles(3);
  rig.commands[0].position = Rig::counts(-1.0);  // stale, from before
  for (const int word : {0x06, 0x07}) order(static_cast<std::uint16_t>(word));
  rig.commands[0].controlword = 0x0F;
  rig.cycle();
  rig.send_commands = false;
  rig.cycle();
  ASSERT_EQ(state(), DriveMachineState::kOperationEnabled);
  EXPECT_EQ(rig.object<std::int32_t>(0x607A), Rig::counts(0.4));
  EXPECT_LT(std::abs(rig.drives[0].voltage_V), 0.2);  // the stale reference would ask for 40 V
}

TEST_F(Drive, ShowsTheModeInForceAndRefusesOthers) {
  rig.commands[0].mode = 10;
  rig.cycles(2);
  EXPECT_EQ(rig.object<std::int8_t>(0x6061), 10);
  rig.commands[0].mode = 7;  // interpolated position: not ours
  rig.cycles(2);
  EXPECT_EQ(rig.object<std::int8_t>(0x6061), 10);
  EXPECT_GE(rig.object<std::uint32_t>(0x2041), 1U);
  EXPECT_EQ(rig.write<std::int8_t>(0x6060, 0, 1), 0x06090030U);
}

TEST_F(Drive, LeavesNoTraceOfTheSessionAfterAnNmtReset) {
  rig.enable();
  ASSERT_EQ(rig.write(0x2020, 1, 123.0F), 0U);
  rig.nmt(129);
  rig.cycles(2);
  EXPECT_FALSE(bridge());
  EXPECT_EQ(rig.object<float>(0x2020, 1), 400.0F);
  EXPECT_EQ(state(), DriveMachineState::kSwitchOnDisabled);
}

/// An axis with a brake that opens in 7 and closes in 5 periods.
BoardSetup braked_setup() {
  BoardSetup setup = board_setup();
  setup.axes[0].parameters.brake_fitted = 1.0;
  setup.axes[0].parameters.brake_release_ms = 7;
  setup.axes[0].parameters.brake_engage_ms = 5;
  return setup;
}

TEST(Brake, OpensBeforeOperationIsEnabledAndClosesBeforeTheBridgeOpens) {
  Rig rig(braked_setup());
  rig.start();
  const auto set = [&rig] { return rig.object<std::uint32_t>(0x60FE, 1) & 1U; };
  for (const int word : {0x00, 0x06, 0x07}) {
    rig.commands[0].controlword = static_cast<std::uint16_t>(word);
    rig.cycles(3);
  }
  EXPECT_EQ(set(), 1U);
  EXPECT_FALSE(rig.drives[0].brake_open);
  rig.commands[0].controlword = 0x0F;
  rig.cycle();
  int open = 0;
  for (; open < 50 && rig.state() != DriveMachineState::kOperationEnabled; ++open) {
    rig.cycle();
    EXPECT_EQ(rig.drives[0].enabled, rig.drives[0].brake_open) << "it holds while it opens";
  }
  EXPECT_EQ(open, 1 + 7) << "the cycle that tells the brake, and its 7 ms";
  EXPECT_EQ(set(), 0U);
  rig.commands[0].controlword = 0x07;  // disable operation: a ramp, at rest after 20 ms
  rig.cycle();
  int until_set = 0, until_off = 0;
  for (int k = 0; k < 100 && rig.drives[0].enabled; ++k) {
    rig.cycle();
    if (rig.drives[0].brake_open) ++until_set;
    ++until_off;
  }
  EXPECT_EQ(until_off - until_set, 5 + 1) << "5 ms with brake and bridge, then without";
  EXPECT_EQ(rig.state(), DriveMachineState::kSwitchedOn);
  EXPECT_EQ(set(), 1U);
}

TEST(Brake, ClosesAtOnceWithTheBridgeInCategory0AndWithoutPower) {
  Rig rig(braked_setup());
  rig.start();
  rig.enable();
  rig.cycles(20);
  ASSERT_EQ(rig.state(), DriveMachineState::kOperationEnabled);
  rig.commands[0].controlword = 0x00;
  rig.cycle();
  rig.cycle();
  EXPECT_FALSE(rig.drives[0].enabled);
  EXPECT_FALSE(rig.drives[0].brake_open);
  EXPECT_FALSE(AxisDrive{}.brake_open) << "what a board without power does";
}

TEST(Brake, IsNotChangedUnderPowerAndShowsNothingWhereThereIsNone) {
  Rig rig(braked_setup());
  rig.start();
  EXPECT_EQ(rig.write<std::uint16_t>(0x203A, 2, 8), 0U);
  rig.enable();
  rig.cycles(20);
  EXPECT_EQ(rig.write<std::uint16_t>(0x203A, 2, 9), 0x08000022U);
  EXPECT_EQ(rig.read<std::uint32_t>(0x60FE, 1), 0U);
  Rig plain;
  plain.start();
  plain.cycles(3);
  EXPECT_EQ(plain.object<std::uint32_t>(0x60FE, 1), 0U) << "no brake is set";
}

}  // namespace
}  // namespace tandem::firmware::testing
