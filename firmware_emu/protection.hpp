// What an axis must not survive: each cause of a drive fault, with its timer and its way back.
// Layer: firmware_emu.  Thread: RT only.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/realtime.hpp"
#include "base/swing_watch.hpp"
#include "canopen/drive_parameters.hpp"
#include "canopen/objects.hpp"

namespace tandem::firmware {

struct ProtectionInputs {
  double link_position_rad = 0.0;
  double position_error_rad = 0.0;
  double current_A = 0.0;
  double temperature_C = 0.0;
  double bus_voltage_V = 0.0;
  /// Motor angle less link angle less what the spring's torque accounts for.
  double mismatch_rad = 0.0;
  double motor_torque_Nm = 0.0;  ///< N K i
  double link_velocity_rad_s = 0.0;
  double motor_velocity_rad_s = 0.0;
  double torque_Nm = 0.0;  ///< measured, of the link
  // Inputs from loops that follow a motion; see SwingWatch.
  double deviation_rad_s = 0.0;
  double asked_torque_Nm = 0.0;
  bool follows_motion = false;    ///< the last two mean something
  bool sensors_valid = true;      ///< every reading is a number
  bool powered = false;           ///< the bridge is on
  bool drives = false;            ///< it is, and does not merely short the winding
  bool follows_position = false;  ///< CSP: position_error_rad means something
};

/// Finds the first cause of a fault that is present, and warns before.
///
/// I2t is a first-order model of the winding: x' = (i^2 - x) / T, fault at x >= Ic^2, which a
/// steady current I reaches from cold after T ln(I^2 / (I^2 - Ic^2)).
///
/// A joint that is powered beyond its position limits may stand there or come in: the limits are
/// where it was powered, and follow it in, until they are the configured ones.
///
/// Oscillation is what a loop does whose gains are too high: the motor's torque u = N K i swings to
/// and fro and moves little. Its fast part is u less its own low-pass at f = 10 Hz, and x the mean
/// of that part's square,
///
///     s' = 2 pi f (u - s),    x' = ((u - s)^2 - x) / T,    fault at x >= limit^2,
///
/// in every mode of operation, because the current is measured in each. A swing of amplitude a is
/// found after -T ln(1 - limit^2 / r^2), with r = a for a square wave and a / sqrt(2) for a sine
/// (less below f: r is multiplied by F / sqrt(F^2 + f^2) at the frequency F); one step of the
/// torque by d adds no more than d^2 / (4 pi f T) to x. A shorted winding is not watched: its
/// torque only brakes. Slower swings are SwingWatch's.
///
/// Motion beyond the joint's limits: the faster of link and motor, the link's torque, and the power
/// that it gives or takes (torque times velocity), each for longer than excess_time_s more than it
/// was within since: shorter ones are impacts. A winding that is shorted only brakes, and a bridge
/// that is open does nothing.
class Protection {
 public:
  /// Share of a limit from which the statusword warns, and to which I2t must fall before a reset.
  static constexpr double kWarningShare = 0.9;
  static constexpr double kTemperatureHysteresis_K = 5.0;
  /// f above.
  static constexpr double kFastTorque_Hz = 10.0;
  /// n of SwingWatch.
  static constexpr std::size_t kHalfSwings = 4;

  /// @return kNone, or the first of: position sensor, sensor mismatch, I2t, temperature,
  ///         under-voltage, oscillation, velocity, torque, power, following error, position limit.
  canopen::ErrorCode update(const canopen::DriveParameters& config, const ProtectionInputs& in,
                            double dt_s) noexcept TANDEM_RT {
    using canopen::ErrorCode;
    if (!in.sensors_valid) return ErrorCode::kPositionSensor;
    const bool leaves = leaves_limits(config, in);
    state_.heat_A2 += (in.current_A * in.current_A - state_.heat_A2) *
                      std::min(1.0, dt_s / config.thermal_time_s);
    hysteresis(state_.overload, load(config), 1.0, kWarningShare);
    hysteresis(state_.overheated, in.temperature_C, config.temperature_limit_C,
               config.temperature_limit_C - kTemperatureHysteresis_K);
    state_.warm = in.temperature_C > kWarningShare * config.temperature_limit_C ? 1 : 0;
    const bool lags = in.powered && in.follows_position && config.following_window_rad > 0.0 &&
                      std::abs(in.position_error_rad) > config.following_window_rad;
    state_.lagging_s = lags ? state_.lagging_s + dt_s : 0.0;
    const bool contradicts =
        config.mismatch_window_rad > 0.0 && std::abs(in.mismatch_rad) > config.mismatch_window_rad;
    state_.mismatch_s = contradicts ? state_.mismatch_s + dt_s : 0.0;
    watch_oscillation(config, in, dt_s);
    const bool swings = swings_slowly(config, in, dt_s);
    const ErrorCode excess = watch_excess(config, in, dt_s);

    if (state_.mismatch_s > config.mismatch_timeout_s) return ErrorCode::kSensorMismatch;
    if (state_.overload != 0) return ErrorCode::kI2t;
    if (state_.overheated != 0) return ErrorCode::kDriveTemperature;
    if (in.bus_voltage_V < config.undervoltage_V) return ErrorCode::kVoltage;
    if (oscillation(config) >= 1.0 || swings) return ErrorCode::kOscillation;
    if (excess != ErrorCode::kNone) return excess;
    if (lags && state_.lagging_s > config.following_timeout_s) return ErrorCode::kFollowingError;
    if (leaves) return ErrorCode::kPositionLimit;
    return ErrorCode::kNone;
  }

  /// I2t as a share of what trips it; 0 when not watched.
  [[nodiscard]] double load(const canopen::DriveParameters& config) const noexcept {
    const double bearable = config.continuous_current_A * config.continuous_current_A;
    return bearable > 0.0 ? state_.heat_A2 / bearable : 0.0;
  }
  /// The mean square of the fast torque as a share of what trips it; 0 when not watched.
  [[nodiscard]] double oscillation(const canopen::DriveParameters& config) const noexcept {
    const double limit = config.oscillation_limit_Nm * config.oscillation_limit_Nm;
    return limit > 0.0 ? state_.fast_Nm2 / limit : 0.0;
  }
  [[nodiscard]] bool warning(const canopen::DriveParameters& config) const noexcept {
    return state_.warm != 0 || load(config) > kWarningShare;
  }
  /// True while the following error is beyond its window, time-out or not.
  [[nodiscard]] bool lagging() const noexcept { return state_.lagging_s > 0.0; }

 private:
  struct State {  // wide flags: no padding in a snapshot
    double heat_A2 = 0.0;
    double lagging_s = 0.0;
    double mismatch_s = 0.0;
    double lower_rad = 0.0;  // position limits in force
    double upper_rad = 0.0;
    double slow_Nm = 0.0;   ///< s above
    double fast_Nm2 = 0.0;  ///< x above
    double too_fast_s = 0.0;
    double too_strong_s = 0.0;
    double too_powerful_s = 0.0;
    std::int64_t overload = 0;
    std::int64_t overheated = 0;
    std::int64_t warm = 0;
  };

  void watch_oscillation(const canopen::DriveParameters& config, const ProtectionInputs& in,
                         double dt_s) noexcept {
    if (!in.drives) {
      state_.slow_Nm = in.motor_torque_Nm;
      state_.fast_Nm2 = 0.0;
      return;
    }
    // By the trapezoidal rule: no gain beyond 1 at half the control rate.
    const double half = std::numbers::pi * kFastTorque_Hz * dt_s;
    const double fast = (in.motor_torque_Nm - state_.slow_Nm) / (1.0 + half);
    state_.slow_Nm += 2.0 * half * fast;
    state_.fast_Nm2 +=
        (fast * fast - state_.fast_Nm2) * std::min(1.0, dt_s / config.oscillation_time_s);
  }
  bool swings_slowly(const canopen::DriveParameters& config, const ProtectionInputs& in,
                     double dt_s) noexcept {
    if (in.drives && in.follows_motion) {
      return swing_.update(in.deviation_rad_s, in.asked_torque_Nm, config.swing_limit_rad_s,
                           kHalfSwings, dt_s);
    }
    swing_.restart();
    return false;
  }
  canopen::ErrorCode watch_excess(const canopen::DriveParameters& config,
                                  const ProtectionInputs& in, double dt_s) noexcept {
    const double share = 1.0 + config.excess_share;
    const auto lasts = [&](double& since_s, double value, double limit) {
      const bool watched = in.drives && config.excess_share > 0.0 && limit > 0.0;
      const bool beyond = watched && value > limit;
      since_s = std::max(0.0, since_s + (beyond ? dt_s : -dt_s));
      return since_s > config.excess_time_s;
    };
    const double speed =
        std::max(std::abs(in.link_velocity_rad_s), std::abs(in.motor_velocity_rad_s));
    const double power_W = std::abs(in.torque_Nm * in.link_velocity_rad_s);
    const bool fast = lasts(state_.too_fast_s, speed, share * config.velocity_limit_rad_s);
    const bool strong =
        lasts(state_.too_strong_s, std::abs(in.torque_Nm), share * config.torque_limit_Nm);
    const bool powerful = lasts(state_.too_powerful_s, power_W,
                                share * config.velocity_limit_rad_s * config.torque_limit_Nm);
    return fast       ? canopen::ErrorCode::kVelocityControl
           : strong   ? canopen::ErrorCode::kExcessTorque
           : powerful ? canopen::ErrorCode::kExcessPower
                      : canopen::ErrorCode::kNone;
  }
  static void hysteresis(std::int64_t& flag, double value, double on, double off) noexcept {
    if (value >= on) flag = 1;
    if (value < off) flag = 0;
  }
  bool leaves_limits(const canopen::DriveParameters& config, const ProtectionInputs& in) noexcept {
    const double position = in.link_position_rad;
    if (!in.powered) state_.lower_rad = state_.upper_rad = position;
    state_.lower_rad = std::min(config.min_position_rad, std::max(state_.lower_rad, position));
    state_.upper_rad = std::max(config.max_position_rad, std::min(state_.upper_rad, position));
    return in.powered && (position > state_.upper_rad + config.position_margin_rad ||
                          position < state_.lower_rad - config.position_margin_rad);
  }

  State state_;
  SwingWatch swing_;
};

}  // namespace tandem::firmware
