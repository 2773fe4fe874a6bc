// What every backend must do: each interface's each call has an effect that shows in the state.
// A backend's own test instantiates BackendConformance over its factories; nothing is disabled.
// Layer: tests.  Thread: any.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include "base/archive.hpp"
#include "hal/backend.hpp"
#include "hal/command_limits.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/devices.hpp"

namespace tandem::hal::test {

/// A robot to test, powered off, and what may be done with it.
struct ConformanceRobot {
  RobotConfig robot;
  std::unique_ptr<Backend> backend;
  std::size_t joint = 0;      ///< is moved; everything else holds its position
  double way_rad = 0.2;       ///< it may move this far to both sides of where it stands
  double torque_Nm = 0.5;     ///< moves it gently
  double torque_share = 0.3;  ///< of it that reaches the free link at least: the rotor takes J of
                              ///< J + m, and a light link m has little to push against
  double voltage_V = 0.5;     ///< moves it gently
  double current_A = 0.2;     ///< moves it gently
  std::function<void(std::size_t joint)> provoke_fault;  ///< makes the joint's drive trip
  std::shared_ptr<void> keep;                            ///< whatever else must live
};

struct ConformanceCase {
  std::string name;
  std::function<ConformanceRobot()> make;
};
inline void PrintTo(const ConformanceCase& one, std::ostream* out) { *out << one.name; }

/// A robot with its loop: wait and check are left out, the rest is as in the runtime.
class Rig {
 public:
  explicit Rig(ConformanceRobot made)
      : it(std::move(made)),
        state(it.robot.shape()),
        command(it.robot.shape()),
        parameters(initial_parameters(it.robot)),
        devices(robot_of(it.robot), state, command, parameters, time.period_ns),
        limits(robot_of(it.robot), time.period_ns),
        j(it.joint) {}

  /// One cycle. Codes are the caller's to look at: `read`, `limited`, `written`.
  void step() {
    time.time_ns = static_cast<std::int64_t>(time.cycle) * time.period_ns;
    it.backend->exchange(time);
    read = it.backend->read(time, state);
    devices.advance();
    limited = limits.apply(state, command);
    written = it.backend->write(command, parameters);
    ++time.cycle;
  }
  void run(double seconds) {
    for (int i = 0; i < cycles(seconds); ++i) step();
  }
  /// Steps until `done`, at most so long. @return whether it came true.
  bool until(const std::function<bool()>& done, double seconds) {
    for (int i = 0; i < cycles(seconds); ++i) {
      if (done()) return true;
      step();
    }
    return done();
  }
  /// The mean of something over a time.
  double mean(const std::function<double()>& value, double seconds) {
    double sum = 0.0;
    for (int i = 0; i < cycles(seconds); ++i) {
      step();
      sum += value();
    }
    return sum / cycles(seconds);
  }
  /// The largest of something over a time.
  double peak(const std::function<double()>& value, double seconds) {
    double most = -1e300;
    for (int i = 0; i < cycles(seconds); ++i) {
      step();
      most = std::max(most, value());
    }
    return most;
  }
  bool operational() const { return it.backend->phase() == Phase::kOperational; }
  /// Power on, every joint in position control where it stands.
  void bring_up() {
    until([this] { return operational(); }, 20.0);
    ASSERT_TRUE(operational()) << it.backend->status_text();
    for (std::size_t k = 0; k < it.robot.joints.size(); ++k) {
      ASSERT_EQ(devices.modes.set_control_mode(k, ControlMode::kPosition), Code::kOk);
    }
    run(1.0);
  }
  void enter(ControlMode mode) {
    ASSERT_EQ(devices.modes.set_control_mode(j, mode), Code::kOk);
    ASSERT_TRUE(until([&] { return devices.modes.control_mode(j) == mode; }, 0.5))
        << "the drive never says " << to_string(mode);
  }
  void yield() {
    ASSERT_EQ(devices.interaction.set_interaction_mode(j, InteractionMode::kCompliant), Code::kOk);
    ASSERT_TRUE(until(
        [&] { return devices.interaction.interaction_mode(j) == InteractionMode::kCompliant; },
        0.5));
  }
  double position() const { return devices.encoders.position_rad(j); }

  ConformanceRobot it;
  CycleTime time;
  StateImage state;
  CommandImage command;
  ParameterImage parameters;
  Devices devices;
  CommandLimits limits;
  std::size_t j;
  Code read = Code::kOk, limited = Code::kOk, written = Code::kOk;

 private:
  int cycles(double seconds) const {
    return static_cast<int>(std::lround(seconds * 1e9 / static_cast<double>(time.period_ns)));
  }
};

class BackendConformance : public testing::TestWithParam<ConformanceCase> {
 protected:
  void SetUp() override { rig.bring_up(); }
  Rig rig{GetParam().make()};
  Devices& devices = rig.devices;
  std::size_t j = rig.j;
};

TEST_P(BackendConformance, BringUpEnablesEveryDrive) {
  for (std::size_t k = 0; k < rig.it.robot.joints.size(); ++k) {
    EXPECT_EQ(devices.amplifier.status(k), DriveState::kOperationEnabled)
        << rig.it.robot.joints[k].name;
    EXPECT_EQ(devices.amplifier.fault(k), 0U) << rig.it.robot.joints[k].name;
  }
}

TEST_P(BackendConformance, ClockCountsExactPeriods) {
  const std::uint64_t cycle = devices.clock.cycle();
  rig.run(0.1);
  EXPECT_EQ(devices.clock.cycle(), cycle + 100);
  EXPECT_EQ(devices.clock.now_ns(),
            static_cast<std::int64_t>(devices.clock.cycle()) * rig.time.period_ns);
}

TEST_P(BackendConformance, EncodersAgreeWithEachOtherOnTheMove) {
  ASSERT_EQ(devices.position.relative_move(j, rig.it.way_rad), Code::kOk);
  rig.run(0.1);
  const double before = rig.position();
  const double motor_before = devices.encoders.motor_position_rad(j);
  const double rate_before = devices.encoders.velocity_rad_s(j);
  double rate = 0.0, motor_rate = 0.0, acceleration = 0.0;
  for (int i = 0; i < 200; ++i) {
    rig.step();
    rate += devices.encoders.velocity_rad_s(j) * 1e-3;
    motor_rate += devices.encoders.motor_velocity_rad_s(j) * 1e-3;
    acceleration += devices.encoders.acceleration_rad_s2(j) * 1e-3;
  }
  const double way = rig.position() - before;
  EXPECT_GT(way, 0.005);
  EXPECT_NEAR(rate, way, 0.1 * way);
  const double motor_way = devices.encoders.motor_position_rad(j) - motor_before;
  EXPECT_NEAR(motor_way, way, 0.5 * way);
  EXPECT_NEAR(motor_rate, motor_way, 0.1 * motor_way);
  EXPECT_NEAR(acceleration, devices.encoders.velocity_rad_s(j) - rate_before, 0.05);
  EXPECT_GE(devices.encoders.timestamp_ns(j), devices.clock.now_ns() - 4 * rig.time.period_ns);
}

TEST_P(BackendConformance, EveryJointFollowsAMotion) {
  std::vector<double> target;
  for (std::size_t k = 0; k < rig.it.robot.joints.size(); ++k) {
    const JointCapabilities& limit = devices.capabilities(k);
    const double here = devices.encoders.position_rad(k);
    const double way = here + 0.02 < limit.max_position_rad ? 0.02 : -0.02;
    target.push_back(here + way);
    ASSERT_EQ(devices.position.set_ref_speed(k, std::min(0.1, limit.max_velocity_rad_s)),
              Code::kOk);
    ASSERT_EQ(devices.position.position_move(k, here + way), Code::kOk);
    EXPECT_TRUE(rig.until([&] { return devices.position.check_motion_done(k); }, 2.0));
    rig.run(0.5);
    EXPECT_NEAR(devices.encoders.position_rad(k), target[k], 0.01) << rig.it.robot.joints[k].name;
    ASSERT_EQ(devices.position.position_move(k, here), Code::kOk);
  }
}

TEST_P(BackendConformance, PositionMoveArrivesAndSaysSo) {
  const double target = rig.position() + rig.it.way_rad;
  ASSERT_EQ(devices.position.position_move(j, target), Code::kOk);
  EXPECT_FALSE(devices.position.check_motion_done(j));
  EXPECT_FALSE(devices.position.check_motion_done());
  EXPECT_EQ(devices.position.target_position_rad(j), target);
  ASSERT_TRUE(rig.until([&] { return devices.position.check_motion_done(); }, 10.0));
  rig.run(1.0);
  EXPECT_NEAR(rig.position(), target, 0.1 * rig.it.way_rad);
}

TEST_P(BackendConformance, AHalvedReferenceSpeedTakesLonger) {
  const double speed = rig.it.way_rad;
  ASSERT_EQ(devices.position.set_ref_speed(j, speed), Code::kOk);
  ASSERT_EQ(devices.position.set_ref_acceleration(j, 20.0 * speed), Code::kOk);
  ASSERT_EQ(devices.position.relative_move(j, rig.it.way_rad), Code::kOk);
  const double fast = rig.peak([&] { return devices.encoders.velocity_rad_s(j); }, 2.0);
  ASSERT_EQ(devices.position.relative_move(j, -rig.it.way_rad), Code::kOk);
  rig.run(2.0);
  ASSERT_EQ(devices.position.set_ref_speed(j, speed / 2.0), Code::kOk);
  ASSERT_EQ(devices.position.relative_move(j, rig.it.way_rad), Code::kOk);
  const double slow = rig.peak([&] { return devices.encoders.velocity_rad_s(j); }, 4.0);
  EXPECT_LT(slow, 0.75 * fast);
}

TEST_P(BackendConformance, StopEndsAMotionOnItsWay) {
  const double start = rig.position();
  ASSERT_EQ(devices.position.set_ref_speed(j, rig.it.way_rad / 2.0), Code::kOk);
  ASSERT_EQ(devices.position.relative_move(j, rig.it.way_rad), Code::kOk);
  rig.run(1.0);
  ASSERT_EQ(devices.position.stop(j), Code::kOk);
  ASSERT_TRUE(rig.until([&] { return devices.position.check_motion_done(j); }, 1.0));
  rig.run(1.0);
  EXPECT_GT(rig.position(), start + 0.1 * rig.it.way_rad);
  EXPECT_LT(rig.position(), start + 0.9 * rig.it.way_rad);
}

TEST_P(BackendConformance, PositionDirectIsFollowed) {
  const double start = rig.command.position_rad()[j];
  const std::uint32_t cut = rig.limits.counters()[j].too_fast;
  for (int i = 0; i <= 1000; ++i) {  // from rest to rest
    const double x = i / 1000.0;
    const double share = x * x * x * (10.0 + x * (6.0 * x - 15.0));
    ASSERT_EQ(devices.position_direct.set_position(j, start + rig.it.way_rad * share), Code::kOk);
    rig.step();
  }
  EXPECT_EQ(rig.limits.counters()[j].too_fast, cut) << "no more than the joint may";
  rig.run(0.5);
  EXPECT_EQ(devices.position_direct.ref_position_rad(j), start + rig.it.way_rad);
  EXPECT_NEAR(rig.position(), start + rig.it.way_rad, 0.1 * rig.it.way_rad);
}

TEST_P(BackendConformance, VelocityMoveIsFollowedAndStops) {
  rig.enter(ControlMode::kVelocity);
  const double speed = rig.it.way_rad / 2.0;
  ASSERT_EQ(devices.velocity.set_ref_acceleration(j, 10.0 * speed), Code::kOk);
  ASSERT_EQ(devices.velocity.velocity_move(j, speed), Code::kOk);
  rig.run(0.5);
  EXPECT_NEAR(rig.mean([&] { return devices.encoders.velocity_rad_s(j); }, 0.5), speed,
              0.2 * speed);
  ASSERT_EQ(devices.velocity.stop(j), Code::kOk);
  rig.run(0.7);
  EXPECT_NEAR(rig.mean([&] { return devices.encoders.velocity_rad_s(j); }, 0.3), 0.0, 0.1 * speed);
}

TEST_P(BackendConformance, TorqueReferenceShowsInTheMeasuredTorque) {
  rig.enter(ControlMode::kTorque);
  const double before = devices.torque.ref_torque_Nm(j);
  ASSERT_EQ(devices.torque.set_ref_torque(j, before + rig.it.torque_Nm), Code::kOk);
  rig.run(0.1);
  const double change = rig.mean([&] { return devices.torque.torque_Nm(j); }, 0.1) - before;
  // The joint is free: what its rotor's inertia and friction take does not reach the link.
  EXPECT_GT(change, rig.it.torque_share * rig.it.torque_Nm);
  EXPECT_LT(change, 1.3 * rig.it.torque_Nm);
}

TEST_P(BackendConformance, OpenLoopVoltageIsAppliedAndDrivesTheMotor) {
  rig.enter(ControlMode::kOpenLoop);
  const double before = devices.open_loop.ref_voltage_V(j);
  ASSERT_EQ(devices.open_loop.set_ref_voltage(j, before + rig.it.voltage_V), Code::kOk);
  const double motor = devices.encoders.motor_position_rad(j);
  rig.run(0.2);
  EXPECT_NEAR(devices.open_loop.voltage_V(j), before + rig.it.voltage_V, 0.011);
  EXPECT_GT(devices.encoders.motor_position_rad(j), motor);
}

TEST_P(BackendConformance, CurrentReferenceShowsInTheMeasuredCurrent) {
  if (!devices.capabilities(j).can(Capability::kCurrent)) {
    GTEST_SKIP() << "the joint's gains have no current loop";
  }
  rig.enter(ControlMode::kCurrent);
  const double before = devices.current.ref_current_A(j);
  ASSERT_EQ(devices.current.set_ref_current(j, before + rig.it.current_A), Code::kOk);
  rig.run(0.05);
  const double measured = rig.mean([&] { return devices.amplifier.current_A(j); }, 0.05);
  EXPECT_NEAR(measured, before + rig.it.current_A, 0.2 * rig.it.current_A + 0.01);
}

}  // namespace tandem::hal::test

#include "tests/hal/conformance_services.hpp"
