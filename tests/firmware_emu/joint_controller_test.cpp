#include "firmware_emu/joint_controller.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tandem::firmware {
namespace {

using canopen::Mode;

constexpr double kDt = 1.0e-3;

canopen::DriveParameters config() {
  return {.min_position_rad = -1.0,
          .max_position_rad = 1.5,
          .position = {.kp = 100.0, .ki = 50.0, .kd = 4.0},
          .velocity = {.kp = 20.0, .ki = 30.0, .kd = 0.5},
          .torque = {.kp = 0.2, .ki = 3.0, .kd = 0.01},
          .current = {.kp = 0.3, .ki = 40.0},
          .torque_to_voltage_V_Nm = 0.16,
          .emf_compensation_Vs_rad = 3.0,
          .resistance_ohm = 0.5,
          .motor_constant_Nm_A = 4.0,
          .spring_Nm_rad = 500.0,
          .voltage_limit_V = 40.0,
          .current_limit_A = 50.0,
          .torque_limit_Nm = 60.0,
          .velocity_limit_rad_s = 5.0,
          .transfer_time_s = 0.0};  // the laws themselves: no transfer
}

Measurement measured() {
  return {.link_position_rad = 0.3,
          .link_velocity_rad_s = 0.2,
          .link_acceleration_rad_s2 = 1.5,
          .motor_position_rad = 0.31,
          .motor_velocity_rad_s = 0.25,
          .torque_Nm = 5.0,
          .torque_rate_Nm_s = 7.0,
          .current_A = 1.2,
          .bus_voltage_V = 48.0};
}

Reference reference() {
  return {.position_rad = 0.4,
          .velocity_rad_s = 0.5,
          .torque_Nm = 2.0,
          .voltage_V = 6.0,
          .current_A = 3.0,
          .stiffness_Nm_rad = 80.0,
          .damping_Nms_rad = 6.0};
}

/// A controller in its steady action and mode, its integrals at zero.
JointController settled(const canopen::DriveParameters& c, Mode mode, const Measurement& m,
                        const Reference& r) {
  canopen::DriveParameters quiet = c;
  for (Pid::Config* pid : {&quiet.position, &quiet.velocity, &quiet.torque, &quiet.current}) {
    pid->ki = 0.0;
  }
  JointController controller;
  controller.configure(quiet, kDt);
  controller.update(BridgeAction::kFollow, mode, r, m);
  controller.update(BridgeAction::kFollow, mode, r, m);
  controller.configure(c, kDt);
  controller.update(BridgeAction::kFollow, mode, r, m);
  return controller;
}

/// V = ff tau_ref + emf th' + kp (tau_ref - tau) + I - kd dtau/dt
double cascade(const canopen::DriveParameters& c, double torque_ref, const Measurement& m,
               double I) {
  return c.torque_to_voltage_V_Nm * torque_ref +
         c.emf_compensation_Vs_rad * m.motor_velocity_rad_s +
         c.torque.kp * (torque_ref - m.torque_Nm) + I - c.torque.kd * m.torque_rate_Nm_s;
}

void expect_law(Mode mode, const canopen::DriveParameters& c, double torque_ref,
                double outer_I = 0.0) {
  JointController controller = settled(c, mode, measured(), reference());
  const double I = controller.torque_loop().state.i;
  const double V = controller.update(BridgeAction::kFollow, mode, reference(), measured());
  EXPECT_NEAR(controller.terms().torque_reference_Nm, torque_ref + outer_I, 1.0e-12);
  EXPECT_NEAR(V, cascade(c, torque_ref + outer_I, measured(), I), 1.0e-12);
  EXPECT_NE(I, 0.0);
}

TEST(JointController, ObeysThePositionLawOnTheLink) {
  // 100 * 0.1 + 4 * 0.3 + 50 * 0.1 * dt + 2
  expect_law(Mode::kCsp, config(), 100.0 * 0.1 + 4.0 * 0.3 + 2.0, 50.0 * 0.1 * kDt);
}

TEST(JointController, ObeysThePositionLawOnTheMotorWithTheIntegralOnTheLink) {
  canopen::DriveParameters c = config();
  c.motor_feedback = 1.0;
  expect_law(Mode::kCsp, c, 100.0 * (0.4 + 2.0 / 500.0 - 0.31) + 4.0 * (0.5 - 0.25) + 2.0,
             50.0 * 0.1 * kDt);
}

TEST(JointController, ObeysTheVelocityLaw) {
  expect_law(Mode::kCsv, config(), 20.0 * 0.3 - 0.5 * 1.5 + 2.0, 30.0 * 0.3 * kDt);
}

TEST(JointController, ObeysTheTorqueLaw) { expect_law(Mode::kCst, config(), 2.0); }

TEST(JointController, ObeysTheImpedanceLaw) {
  expect_law(Mode::kImpedance, config(), 80.0 * 0.1 + 6.0 * 0.3 + 2.0);
}

TEST(JointController, ObeysTheVelocityImpedanceLawAboutItsIntegratedReference) {
  JointController controller = settled(config(), Mode::kVelocityImpedance, measured(), reference());
  const double held = controller.terms().held_position_rad;
  EXPECT_NEAR(held, 0.3 + 3 * 0.5 * kDt, 1.0e-12);  // from where the joint was, three periods
  controller.update(BridgeAction::kFollow, Mode::kVelocityImpedance, reference(), measured());
  EXPECT_NEAR(controller.terms().torque_reference_Nm, 80.0 * (held - 0.3) + 6.0 * 0.3 + 2.0,
              1.0e-12);
}

TEST(JointController, GivesTheVoltageItIsTold) {
  JointController controller = settled(config(), Mode::kOpenLoop, measured(), reference());
  EXPECT_DOUBLE_EQ(
      controller.update(BridgeAction::kFollow, Mode::kOpenLoop, reference(), measured()), 6.0);
}

TEST(JointController, ObeysTheCurrentLaw) {
  JointController controller = settled(config(), Mode::kCurrent, measured(), reference());
  const double I = controller.electrical_loop().state.i;
  EXPECT_NEAR(I, 40.0 * 1.8 * kDt, 1.0e-12);
  EXPECT_NEAR(controller.update(BridgeAction::kFollow, Mode::kCurrent, reference(), measured()),
              0.5 * 3.0 + 4.0 * 0.25 + 0.3 * 1.8 + I, 1.0e-12);
}

TEST(JointController, ShortsTheWindingInBrakeAndOpensTheBridgeInOff) {
  JointController controller = settled(config(), Mode::kCst, measured(), reference());
  EXPECT_DOUBLE_EQ(controller.update(BridgeAction::kBrake, Mode::kCst, reference(), measured()),
                   controller.terms().voltage_V);
  EXPECT_DOUBLE_EQ(controller.update(BridgeAction::kBrake, Mode::kCst, reference(), measured()),
                   0.0);
  EXPECT_DOUBLE_EQ(controller.update(BridgeAction::kOff, Mode::kCst, reference(), measured()), 0.0);
}

TEST(JointController, LimitsTheVoltageToTheSupplyAndToItsSetting) {
  canopen::DriveParameters c = config();
  c.torque_limit_Nm = 1000.0;
  c.velocity_limit_rad_s = 0.0;
  Reference r = reference();
  r.voltage_V = 100.0;
  Measurement m = measured();
  m.motor_velocity_rad_s = 6.0;  // the current is no limit here: 24 + 25 V
  JointController controller = settled(c, Mode::kOpenLoop, m, r);
  EXPECT_DOUBLE_EQ(controller.update(BridgeAction::kFollow, Mode::kOpenLoop, r, m), 40.0);
  EXPECT_EQ(controller.terms().voltage_saturation, 1);
  m.bus_voltage_V = 30.0;
  EXPECT_DOUBLE_EQ(controller.update(BridgeAction::kFollow, Mode::kOpenLoop, r, m), 30.0);
  EXPECT_TRUE(controller.limited());
}

TEST(JointController, LimitsTheCurrentThatTheVoltageWouldDrive) {
  canopen::DriveParameters c = config();
  c.current_limit_A = 10.0;
  Reference r = reference();
  r.voltage_V = -30.0;
  const Measurement m = measured();
  JointController controller = settled(c, Mode::kOpenLoop, m, r);
  const double V = controller.update(BridgeAction::kFollow, Mode::kOpenLoop, r, m);
  EXPECT_NEAR((V - 4.0 * m.motor_velocity_rad_s) / 0.5, -10.0, 1.0e-12);
  EXPECT_EQ(controller.terms().voltage_saturation, -1);
}

TEST(JointController, TakesTheDrivingCurrentAwayTowardsTheVelocityLimitInEveryMode) {
  canopen::DriveParameters c = config();
  c.voltage_limit_V = 1000.0;
  c.torque_to_voltage_V_Nm = 100.0;  // the cascade asks for all that there is
  Reference r = reference();
  Measurement m = measured();
  m.bus_voltage_V = 1000.0;
  for (const Mode mode : {Mode::kCst, Mode::kImpedance, Mode::kOpenLoop, Mode::kCurrent}) {
    const bool direct = mode == Mode::kOpenLoop || mode == Mode::kCurrent;
    for (const double way : {1.0, -1.0}) {
      r.torque_Nm = way * 60.0;
      r.voltage_V = way * 1000.0;
      r.current_A = way * 50.0;
      r.stiffness_Nm_rad = r.damping_Nms_rad = 0.0;
      struct Case {
        double share, most_A;
      };
      for (const Case& one :
           {Case{0.5, direct ? 15.0 : 50.0}, Case{0.95, 0.75 * 15.0}, Case{1.0, 0.5 * 15.0},
            Case{1.1, 0.0}, Case{1.2, -0.5 * 15.0}, Case{2.0, -15.0}}) {
        m.link_velocity_rad_s = m.motor_velocity_rad_s = way * one.share * 5.0;
        JointController controller = settled(c, mode, m, r);
        const double V = controller.update(BridgeAction::kFollow, mode, r, m);
        EXPECT_NEAR(way * (V - 4.0 * m.motor_velocity_rad_s) / 0.5, one.most_A, 1e-9)
            << static_cast<int>(mode) << " " << way << " " << one.share;
        EXPECT_TRUE(controller.limited());
      }
    }
  }
}

TEST(JointController, LimitsTheTorqueReference) {
  Reference r = reference();
  r.torque_Nm = -500.0;
  JointController controller = settled(config(), Mode::kCst, measured(), r);
  EXPECT_DOUBLE_EQ(controller.terms().torque_reference_Nm, -60.0);
  EXPECT_EQ(controller.terms().torque_saturation, -1);
}

TEST(JointController, KeepsReferencesWithinPositionAndVelocityLimits) {
  Reference r = reference();
  r.position_rad = 3.0;
  r.velocity_rad_s = 9.0;
  Measurement m = measured();
  JointController position = settled(config(), Mode::kCsp, m, r);
  EXPECT_DOUBLE_EQ(position.terms().position_error_rad, 1.5 - 0.3);
  EXPECT_TRUE(position.limited());
  JointController velocity = settled(config(), Mode::kCsv, m, r);
  EXPECT_DOUBLE_EQ(velocity.velocity_loop().state.p, 20.0 * (5.0 - 0.2));
  m.link_position_rad = 1.5;  // at the limit: outward no more, inward yes
  velocity = settled(config(), Mode::kCsv, m, r);
  EXPECT_DOUBLE_EQ(velocity.velocity_loop().state.p, 20.0 * (0.0 - 0.2));
  r.velocity_rad_s = -2.0;
  velocity = settled(config(), Mode::kCsv, m, r);
  EXPECT_DOUBLE_EQ(velocity.velocity_loop().state.p, 20.0 * (-2.0 - 0.2));
}

TEST(JointController, LetsAJointThatStandsOutsideOfItsRangeStayAndComeInButNotGoOutAgain) {
  canopen::DriveParameters c = config();  // up to 1.5 rad
  Measurement m = measured();
  m.link_position_rad = 1.8;
  Reference r = reference();
  JointController controller;
  controller.configure(c, kDt);
  const auto error = [&](double position_rad) {
    r.position_rad = position_rad;
    controller.update(BridgeAction::kFollow, Mode::kCsp, r, m);
    return controller.terms().position_error_rad + m.link_position_rad;
  };
  EXPECT_DOUBLE_EQ(error(1.8), 1.8) << "no jump to 1.5";
  EXPECT_FALSE(controller.limited());
  EXPECT_DOUBLE_EQ(error(2.0), 1.8);
  EXPECT_DOUBLE_EQ(error(1.7), 1.7);
  EXPECT_DOUBLE_EQ(error(1.8), 1.7) << "not back out";
  EXPECT_DOUBLE_EQ(error(1.2), 1.2);
  EXPECT_DOUBLE_EQ(error(1.6), 1.5);
}

TEST(JointController, WindsUpNoIntegralOfTheCascadeAgainstTheVoltage) {
  canopen::DriveParameters c = config();
  c.voltage_limit_V = 5.0;
  Reference r = reference();
  r.position_rad = 1.4;
  JointController controller = settled(c, Mode::kCsp, measured(), r);
  const double position_I = controller.position_loop().state.i;
  const double torque_I = controller.torque_loop().state.i;
  for (int k = 0; k < 2000; ++k)
    controller.update(BridgeAction::kFollow, Mode::kCsp, r, measured());
  EXPECT_EQ(controller.terms().voltage_saturation, 1);
  EXPECT_DOUBLE_EQ(controller.position_loop().state.i, position_I);
  EXPECT_DOUBLE_EQ(controller.torque_loop().state.i, torque_I);
}

TEST(JointController, WindsUpNoIntegralAgainstTheTorqueLimit) {
  canopen::DriveParameters c = config();
  c.torque_limit_Nm = 3.0;
  JointController controller = settled(c, Mode::kCsp, measured(), reference());
  const double I = controller.position_loop().state.i;
  for (int k = 0; k < 2000; ++k) {
    controller.update(BridgeAction::kFollow, Mode::kCsp, reference(), measured());
  }
  EXPECT_DOUBLE_EQ(controller.position_loop().state.i, I);
  EXPECT_DOUBLE_EQ(controller.terms().torque_reference_Nm, 3.0);
}

TEST(JointController, DoesNotRunAwayFromABlockedJointInVelocityImpedance) {
  canopen::DriveParameters c = config();
  c.torque_limit_Nm = 10.0;
  JointController controller = settled(c, Mode::kVelocityImpedance, measured(), reference());
  for (int k = 0; k < 20000; ++k) {
    controller.update(BridgeAction::kFollow, Mode::kVelocityImpedance, reference(), measured());
  }
  EXPECT_LT(80.0 * (controller.terms().held_position_rad - 0.3), 10.0);
}

TEST(JointController, ChangesBetweenAnyTwoModesWithoutAStepOfTheVoltage) {
  canopen::DriveParameters c = config();
  c.transfer_time_s = 0.02;
  const Mode modes[] = {Mode::kCsp,
                        Mode::kCsv,
                        Mode::kCst,
                        Mode::kImpedance,
                        Mode::kCurrent,
                        Mode::kOpenLoop,
                        Mode::kVelocityImpedance};
  for (const Mode from : modes) {
    for (const Mode to : modes) {
      if (from == to) continue;
      JointController controller;
      controller.configure(c, kDt);
      double before = 0.0;
      for (int k = 0; k < 100; ++k) {
        before = controller.update(BridgeAction::kFollow, from, reference(), measured());
      }
      EXPECT_NEAR(controller.update(BridgeAction::kFollow, to, reference(), measured()), before,
                  1e-12)
          << static_cast<int>(from) << " to " << static_cast<int>(to);
      for (int k = 0; k < 400; ++k) {
        controller.update(BridgeAction::kFollow, to, reference(), measured());
      }
      EXPECT_NEAR(controller.terms().transfer_V, 0.0, 1.0e-7);  // and it decays: exp(-20)
    }
  }
}

// A subnormal number changes nothing either, but CPUs are slow with it, for the rest of the run.
TEST(JointController, ForgetsAStepOfTheVoltageAfterALongTime) {
  canopen::DriveParameters c = config();
  c.transfer_time_s = 0.02;
  JointController controller;
  controller.configure(c, kDt);
  controller.update(BridgeAction::kFollow, Mode::kCst, reference(), measured());
  controller.update(BridgeAction::kFollow, Mode::kCsp, reference(), measured());
  ASSERT_NE(controller.terms().transfer_V, 0.0);
  for (int k = 0; k < 20'000; ++k) {
    controller.update(BridgeAction::kFollow, Mode::kCsp, reference(), measured());
    ASSERT_NE(std::fpclassify(controller.terms().transfer_V), FP_SUBNORMAL);
  }
  EXPECT_EQ(controller.terms().transfer_V, 0.0);
}

TEST(JointController, SeedsTheIntegralThatTheNewModeHas) {
  canopen::DriveParameters c = config();
  c.transfer_time_s = 0.02;
  JointController controller;
  controller.configure(c, kDt);
  controller.update(BridgeAction::kFollow, Mode::kCst, reference(), measured());
  const double held = controller.terms().torque_reference_Nm;
  controller.update(BridgeAction::kFollow, Mode::kCsp, reference(), measured());
  EXPECT_DOUBLE_EQ(controller.terms().torque_reference_Nm, held);
  EXPECT_NEAR(controller.position_loop().state.i,
              held - 2.0 - 100.0 * 0.1 - 4.0 * 0.3 + 50.0 * 0.1 * kDt, 1.0e-12);
}

TEST(JointController, StartsAtTheBackEmfWhenTheBridgeCloses) {
  canopen::DriveParameters c = config();
  c.transfer_time_s = 0.02;
  JointController controller;
  controller.configure(c, kDt);
  controller.update(BridgeAction::kOff, Mode::kCsp, reference(), measured());
  EXPECT_DOUBLE_EQ(controller.update(BridgeAction::kFollow, Mode::kCsp, reference(), measured()),
                   4.0 * 0.25);                                   // no current
  EXPECT_DOUBLE_EQ(controller.terms().torque_reference_Nm, 5.0);  // what the spring carries
}

TEST(JointController, TakesNewGainsWithoutAStepOfTheVoltage) {
  canopen::DriveParameters c = config();
  c.transfer_time_s = 0.02;
  JointController controller;
  controller.configure(c, kDt);
  double before = 0.0;
  for (int k = 0; k < 200; ++k) {
    before = controller.update(BridgeAction::kFollow, Mode::kImpedance, reference(), measured());
  }
  c.torque.kp = 0.9;
  controller.configure(c, kDt);
  EXPECT_DOUBLE_EQ(
      controller.update(BridgeAction::kFollow, Mode::kImpedance, reference(), measured()), before);
  EXPECT_NE(controller.terms().transfer_V, 0.0);
}

TEST(JointController, HoldsWhereItWasWhenItHasToStop) {
  JointController controller = settled(config(), Mode::kCst, measured(), reference());
  controller.update(BridgeAction::kHold, Mode::kCst, reference(), measured());
  Measurement moved = measured();
  moved.link_position_rad += 0.05;
  controller.update(BridgeAction::kHold, Mode::kCst, reference(), moved);
  EXPECT_NEAR(controller.terms().position_error_rad, -0.05, 1.0e-15);
}

TEST(JointController, HoldsAtRest) {
  canopen::DriveParameters c = config();
  c.position.ki = 0.0;
  JointController controller = settled(c, Mode::kCst, measured(), reference());
  controller.update(BridgeAction::kHold, Mode::kCst, reference(), measured());
  controller.update(BridgeAction::kHold, Mode::kCst, reference(), measured());
  // 100 * 0 + 4 * (0 - 0.2) + 2
  EXPECT_NEAR(controller.terms().torque_reference_Nm, -4.0 * 0.2 + 2.0, 1.0e-12);
}

TEST(JointController, ChangesTheTorqueReferenceNoFasterThanItsSlopeInEveryMode) {
  for (const Mode mode :
       {Mode::kCsp, Mode::kCsv, Mode::kCst, Mode::kImpedance, Mode::kVelocityImpedance}) {
    SCOPED_TRACE(static_cast<int>(mode));
    canopen::DriveParameters c = config();
    c.torque_slope_Nm_s = 5000.0;
    JointController controller = settled(c, mode, measured(), reference());
    double last = controller.terms().torque_reference_Nm;
    double most = 0.0;
    for (int k = 0; k < 60; ++k) {
      Reference step = reference();
      const double side = k / 20 % 2 == 0 ? 1.0 : -1.0;
      step.position_rad = side;
      step.velocity_rad_s = 5.0 * side;
      step.torque_Nm = 100.0 * side;
      controller.update(BridgeAction::kFollow, mode, step, measured());
      const double now = controller.terms().torque_reference_Nm;
      most = std::max(most, std::abs(now - last));
      if (k == 20) {
        EXPECT_TRUE(controller.limited()) << "statusword bit 11";
      }
      last = now;
    }
    EXPECT_NEAR(most, 5.0, 1.0e-9);
    EXPECT_NEAR(last, 60.0, 1.0e-9) << "it gets there";
  }
}

TEST(JointController, ShowsNoTorqueReferenceThatIsNotInForce) {
  for (const Mode mode : {Mode::kCst, Mode::kCurrent, Mode::kOpenLoop}) {
    JointController controller;
    controller.configure(config(), kDt);
    controller.update(BridgeAction::kFollow, Mode::kCst, reference(), measured());
    ASSERT_NE(controller.terms().torque_reference_Nm, 0.0);
    const BridgeAction then = mode == Mode::kCst ? BridgeAction::kBrake : BridgeAction::kFollow;
    controller.update(then, mode, reference(), measured());
    EXPECT_EQ(controller.terms().torque_reference_Nm, 0.0) << static_cast<int>(mode);
  }
}

TEST(JointController, DelaysNeitherBrakeNorOpenBridgeNorALoweredLimitByTheSlope) {
  canopen::DriveParameters c = config();
  c.torque_slope_Nm_s = 10.0;
  Reference full = reference();
  full.torque_Nm = 60.0;
  JointController controller = settled(config(), Mode::kCst, measured(), full);
  ASSERT_EQ(controller.terms().torque_reference_Nm, 60.0);
  controller.configure(c, kDt);
  c.torque_limit_Nm = 20.0;
  controller.configure(c, kDt);
  controller.update(BridgeAction::kFollow, Mode::kCst, full, measured());
  EXPECT_EQ(controller.terms().torque_reference_Nm, 20.0);
  controller.update(BridgeAction::kFollow, Mode::kCst, full, measured());
  JointController braking = controller;
  braking.update(BridgeAction::kBrake, Mode::kCst, full, measured());
  EXPECT_EQ(braking.update(BridgeAction::kBrake, Mode::kCst, full, measured()), 0.0);
  EXPECT_EQ(controller.update(BridgeAction::kOff, Mode::kCst, full, measured()), 0.0);
}

}  // namespace
}  // namespace tandem::firmware
