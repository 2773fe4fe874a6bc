// The second half of the suite: modes, gains, impedance, amplifiers, sensors, snapshots.
// Included by conformance.hpp only.
// Layer: tests.  Thread: any.
#pragma once

#include "tests/hal/conformance.hpp"

namespace tandem::hal::test {

TEST_P(BackendConformance, EveryModeIsReachedWithoutABump) {
  for (const ControlMode mode :
       {ControlMode::kVelocity, ControlMode::kTorque, ControlMode::kPosition,
        ControlMode::kOpenLoop, ControlMode::kPosition, ControlMode::kCurrent,
        ControlMode::kPosition}) {
    if (!devices.capabilities(j).can(mode, InteractionMode::kStiff)) continue;
    const double before = rig.position();
    rig.enter(mode);
    rig.run(0.05);
    EXPECT_NEAR(rig.position(), before, 0.05 * rig.it.way_rad) << "into " << to_string(mode);
  }
}

TEST_P(BackendConformance, ACompliantJointYieldsByTorqueOverStiffness) {
  rig.yield();
  const double stiffness = devices.capabilities(j).stiffness_Nm_rad;
  const double damping = devices.capabilities(j).damping_Nms_rad;
  ASSERT_EQ(devices.impedance.set_impedance(j, {stiffness, damping}), Code::kOk);
  EXPECT_EQ(devices.impedance.impedance(j).stiffness_Nm_rad, stiffness);
  rig.run(2.0);
  const double before = rig.position();
  const double offset = 0.25 * rig.it.way_rad * stiffness;
  ASSERT_EQ(devices.impedance.set_impedance_offset(j, offset), Code::kOk);
  EXPECT_EQ(devices.impedance.impedance_offset_Nm(j), offset);
  rig.run(2.0);
  EXPECT_NEAR(rig.position() - before, offset / stiffness, 0.25 * offset / stiffness);

  // Half the stiffness, half the offset: the same deflection again.
  ASSERT_EQ(devices.impedance.set_impedance_offset(j, 0.0), Code::kOk);
  ASSERT_EQ(devices.impedance.set_impedance(j, {stiffness / 2.0, damping}), Code::kOk);
  rig.run(2.0);
  const double soft = rig.position();
  ASSERT_EQ(devices.impedance.set_impedance_offset(j, offset / 2.0), Code::kOk);
  rig.run(2.0);
  EXPECT_NEAR(rig.position() - soft, offset / stiffness, 0.3 * offset / stiffness);
}

TEST_P(BackendConformance, MoreDampingSlowsACompliantJoint) {
  rig.yield();
  const double stiffness = devices.capabilities(j).stiffness_Nm_rad;
  const double damping = devices.capabilities(j).damping_Nms_rad;
  const double offset = 0.25 * rig.it.way_rad * stiffness;
  const auto peak_with = [&](double d) {
    EXPECT_EQ(devices.impedance.set_impedance(j, {stiffness, d}), Code::kOk);
    EXPECT_EQ(devices.impedance.set_impedance_offset(j, 0.0), Code::kOk);
    rig.run(2.0);
    EXPECT_EQ(devices.impedance.set_impedance_offset(j, offset), Code::kOk);
    return rig.peak([&] { return devices.encoders.velocity_rad_s(j); }, 1.0);
  };
  // A robot's own damping is about the most that a free link on its spring can take.
  const double light = peak_with(damping / 4.0);
  EXPECT_LT(peak_with(damping), 0.95 * light);
}

TEST_P(BackendConformance, VelocityControlYieldsToo) {
  rig.enter(ControlMode::kVelocity);
  rig.yield();
  rig.run(1.0);
  const double speed = rig.it.way_rad / 2.0;
  ASSERT_EQ(devices.velocity.velocity_move(j, speed), Code::kOk);
  const double before = rig.position();
  rig.run(1.0);
  EXPECT_GT(rig.position(), before + 0.25 * speed);
}

/// The voltage's course while a loop is excited, with its proportional gain scaled.
inline std::vector<double> response(const ConformanceCase& of, PidLoop loop, double scale) {
  Rig rig(of.make());
  rig.bring_up();
  Devices& devices = rig.devices;
  PidGains gains = devices.pid.pid(rig.j, loop);
  gains.kp = gains.kp * scale + (gains.kp == 0.0 ? 0.01 * (scale - 1.0) : 0.0);
  EXPECT_EQ(devices.pid.set_pid(rig.j, loop, gains), Code::kOk);
  EXPECT_EQ(devices.pid.pid(rig.j, loop).kp, gains.kp);
  rig.run(0.2);  // by SDO
  const double bias_Nm = devices.torque.torque_Nm(rig.j);
  switch (loop) {
    case PidLoop::kPosition:
      EXPECT_EQ(devices.position_direct.set_position(rig.j, rig.position() + 0.02), Code::kOk);
      EXPECT_NEAR(devices.pid.error(rig.j, loop), 0.02, 1e-9);
      break;
    case PidLoop::kVelocity:
      rig.enter(ControlMode::kVelocity);
      EXPECT_EQ(devices.velocity.velocity_move(rig.j, 0.1), Code::kOk);
      break;
    case PidLoop::kTorque:
      rig.enter(ControlMode::kTorque);
      EXPECT_EQ(devices.torque.set_ref_torque(rig.j, bias_Nm + rig.it.torque_Nm), Code::kOk);
      break;
    case PidLoop::kCurrent:
      rig.enter(ControlMode::kCurrent);
      EXPECT_EQ(devices.current.set_ref_current(
                    rig.j, devices.current.ref_current_A(rig.j) + rig.it.current_A),
                Code::kOk);
      break;
  }
  std::vector<double> voltage;
  for (int i = 0; i < 50; ++i) {
    rig.step();
    voltage.push_back(devices.open_loop.voltage_V(rig.j));
  }
  return voltage;
}

TEST_P(BackendConformance, AGainOfEveryLoopChangesTheVoltage) {
  for (const PidLoop loop :
       {PidLoop::kPosition, PidLoop::kVelocity, PidLoop::kTorque, PidLoop::kCurrent}) {
    if (loop == PidLoop::kCurrent && !devices.capabilities(j).can(Capability::kCurrent)) continue;
    const std::vector<double> plain = response(GetParam(), loop, 1.0);
    const std::vector<double> same = response(GetParam(), loop, 1.0);
    const std::vector<double> higher = response(GetParam(), loop, 1.5);
    double repeated = 0.0, changed = 0.0;
    for (std::size_t i = 0; i < plain.size(); ++i) {
      repeated = std::max(repeated, std::abs(same[i] - plain[i]));
      changed = std::max(changed, std::abs(higher[i] - plain[i]));
    }
    EXPECT_GT(changed, repeated + 0.005) << "loop " << static_cast<int>(loop);
  }
}

TEST_P(BackendConformance, AmplifierTakesTheTorqueOffAndPutsItOnAgain) {
  ASSERT_EQ(devices.amplifier.disable(j), Code::kOk);
  ASSERT_TRUE(
      rig.until([&] { return devices.amplifier.status(j) != DriveState::kOperationEnabled; }, 0.5));
  rig.run(0.05);
  EXPECT_NEAR(devices.open_loop.voltage_V(j), 0.0, 0.011);
  EXPECT_EQ(devices.modes.control_mode(j), ControlMode::kIdle);
  ASSERT_EQ(devices.amplifier.enable(j), Code::kOk);
  ASSERT_TRUE(
      rig.until([&] { return devices.amplifier.status(j) == DriveState::kOperationEnabled; }, 1.0));
  EXPECT_TRUE(
      rig.until([&] { return devices.modes.control_mode(j) == ControlMode::kPosition; }, 0.5));
}

TEST_P(BackendConformance, AmplifierMeasuresCurrentAndTemperature) {
  const double hard = std::min(100.0, devices.capabilities(j).max_acceleration_rad_s2);
  ASSERT_EQ(devices.position.set_ref_acceleration(j, hard), Code::kOk);
  ASSERT_EQ(devices.position.relative_move(j, rig.it.way_rad), Code::kOk);
  EXPECT_GT(rig.peak([&] { return std::abs(devices.amplifier.current_A(j)); }, 0.5), 0.01);
  EXPECT_GT(devices.amplifier.temperature_C(j), 0.0);
  EXPECT_LT(devices.amplifier.temperature_C(j), 100.0);
  EXPECT_GT(devices.amplifier.max_current_A(j), 0.0);
}

TEST_P(BackendConformance, AFaultLatchesIsNamedAndIsReset) {
  ASSERT_TRUE(rig.it.provoke_fault) << "the backend's test must be able to trip a drive";
  rig.it.provoke_fault(j);
  ASSERT_TRUE(rig.until([&] { return devices.amplifier.fault(j) != 0; }, 1.0));
  EXPECT_TRUE(rig.until([&] { return devices.amplifier.status(j) == DriveState::kFault; }, 3.0))
      << "the fault reaction does not end";
  rig.run(0.5);
  EXPECT_NE(devices.amplifier.fault(j), 0U) << "a fault does not go away by itself";
  EXPECT_EQ(rig.it.backend->phase(), Phase::kFault);
  EXPECT_FALSE(rig.it.backend->status_text().empty());
  ASSERT_EQ(devices.amplifier.reset_fault(j), Code::kOk);
  EXPECT_TRUE(rig.until(
      [&] {
        return devices.amplifier.fault(j) == 0 &&
               devices.amplifier.status(j) == DriveState::kOperationEnabled;
      },
      3.0));
  rig.run(0.5);
  EXPECT_TRUE(rig.operational()) << rig.it.backend->status_text();
}

TEST_P(BackendConformance, ACommandThatIsNotFiniteNeverMovesTheRobot) {
  const double before = rig.position();
  rig.command.position_rad()[j] = std::numeric_limits<double>::quiet_NaN();
  rig.step();
  EXPECT_EQ(rig.limited, Code::kNotFinite);
  EXPECT_EQ(rig.limits.counters()[j].not_finite, 1U);
  rig.run(0.2);
  EXPECT_NEAR(rig.position(), before, 0.05 * rig.it.way_rad);
  EXPECT_TRUE(rig.operational());
}

TEST_P(BackendConformance, SensorsAreFreshAndPlausible) {
  bool force_torque = false;
  for (const SensorConfig& sensor : rig.it.robot.sensors) {
    if (sensor.type == SensorType::kForceTorque) {
      const auto wrench = devices.force_torque(sensor.name);
      ASSERT_TRUE(wrench.has_value()) << sensor.name;
      const auto f = wrench->force_N();
      const auto t = wrench->torque_Nm();
      const double force = std::hypot(f[0], f[1], f[2]);
      EXPECT_GT(force, 0.1) << sensor.name << " carries at least its own side";
      EXPECT_TRUE(std::isfinite(t[0] + t[1] + t[2])) << sensor.name;
      EXPECT_LE(wrench->age_cycles(), 4U) << sensor.name;
      force_torque = true;
    } else {
      const auto imu = devices.imu(sensor.name);
      ASSERT_TRUE(imu.has_value()) << sensor.name;
      const auto q = imu->orientation();
      const auto f = imu->specific_force_m_s2();
      const auto w = imu->angular_velocity_rad_s();
      EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1.0, 1e-3);
      EXPECT_NEAR(std::hypot(f[0], f[1], f[2]), 9.81, 0.2) << "at rest";
      EXPECT_NEAR(std::hypot(w[0], w[1], w[2]), 0.0, 0.02) << "at rest";
      EXPECT_GE(imu->timestamp_ns(), devices.clock.now_ns() - 4 * rig.time.period_ns);
    }
  }
  if (!force_torque) GTEST_SKIP() << "the robot has no force/torque sensor";
}

TEST_P(BackendConformance, ASnapshotGoesOnAsTheSameBytes) {
  ASSERT_EQ(devices.position.relative_move(j, rig.it.way_rad), Code::kOk);
  rig.run(0.1);
  const auto all = [&](Archive& ar) {
    ar(rig.state, rig.command, rig.parameters, rig.devices, rig.limits, rig.time);
    return rig.it.backend->archive(ar);
  };
  const auto kept = rig.it.backend->keep();  // what is another process'
  Archive saved;
  if (!kept || !all(saved)) GTEST_SKIP() << "this robot cannot be rewound";
  rig.run(0.3);
  const std::vector<std::byte> first(rig.state.bytes().begin(), rig.state.bytes().end());
  const Status there = rig.it.backend->go_back(*kept);
  ASSERT_TRUE(there) << there.error().to_string();
  Archive restored(saved.bytes());
  ASSERT_TRUE(all(restored));
  EXPECT_TRUE(restored.ok());
  EXPECT_TRUE(restored.at_end());
  rig.run(0.3);
  const std::vector<std::byte> again(rig.state.bytes().begin(), rig.state.bytes().end());
  EXPECT_EQ(first, again);
}

}  // namespace tandem::hal::test
