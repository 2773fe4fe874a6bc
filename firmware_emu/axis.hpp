// One axis of a board: sensors, protections, CiA 402 drive machine and joint controller.
// Layer: firmware_emu.  Thread: RT; construction non-RT.
#pragma once

#include <cstdint>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "canopen/drive_machine.hpp"
#include "canopen/object_dictionary.hpp"
#include "firmware_emu/axis_objects.hpp"
#include "firmware_emu/estimator.hpp"
#include "firmware_emu/joint_controller.hpp"
#include "firmware_emu/profile_modes.hpp"
#include "firmware_emu/protection.hpp"
#include "firmware_emu/setup.hpp"

namespace tandem::firmware {

/// What supervise() reports to the board.
struct AxisEvents {
  canopen::ErrorCode raised = canopen::ErrorCode::kNone;  ///< latched just now, or found behind it
  bool reset = false;                                     ///< a fault was cleared just now
};

/// Stepped once per control period: sample(), supervise(), control(), in this order.
class Axis final : private canopen::ObjectOwner {
 public:
  Axis(const AxisSetup& setup, const BoardSetup& board, int index, canopen::ObjectDictionary& od);
  Axis(const Axis&) = delete;
  Axis& operator=(const Axis&) = delete;

  /// Reads the sensors, runs the estimators and shows the results in the actual-value objects.
  void sample(const AxisSense& sense) noexcept TANDEM_RT;
  /// Protections, then one step of the drive machine.
  /// @param connection      kNone, or how the commands were lost
  /// @param heartbeat_lost  the master's; the reaction is 6007's
  AxisEvents supervise(canopen::ErrorCode connection, bool heartbeat_lost) noexcept TANDEM_RT;
  /// The controllers: what the bridge does until the next period.
  [[nodiscard]] AxisDrive control() noexcept TANDEM_RT;
  /// Objects and state as after power-on; the sensors' noise goes on.
  void power_on() noexcept TANDEM_RT;

  [[nodiscard]] const AxisObjects& objects() const noexcept { return objects_; }
  [[nodiscard]] const canopen::DriveParameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] const canopen::DriveMachine& machine() const noexcept { return machine_; }
  [[nodiscard]] const JointController& controller() const noexcept { return controller_; }
  [[nodiscard]] const Measurement& measured() const noexcept { return measured_; }

  void archive(Archive& ar);

 private:
  canopen::AbortCode check(const canopen::ObjectEntry& entry,
                           const std::uint8_t* bytes) noexcept TANDEM_RT override;
  void written(const canopen::ObjectEntry& entry) noexcept TANDEM_RT override;
  [[nodiscard]] canopen::AbortCode check_limits(const canopen::ObjectEntry& entry,
                                                const std::uint8_t* bytes) const noexcept;

  void apply_settings() noexcept TANDEM_RT;
  [[nodiscard]] bool supported(std::int8_t mode) const noexcept;
  /// Counts of the joint's encoder as 6064 shows them, and back.
  /// A count as a single-turn encoder tells it at power-on.
  [[nodiscard]] std::int32_t within_turn(std::int32_t count) const noexcept;
  [[nodiscard]] std::int32_t to_wire(std::int64_t counts) const noexcept;
  [[nodiscard]] std::int32_t from_wire(std::int32_t value) const noexcept;
  /// By what 6064 is off until homing has found the joint's place: shown minus true [rad].
  [[nodiscard]] double shown_shift_rad() const noexcept;
  /// The modes in which the drive makes its own way: one period of them.
  void run_profile() noexcept;
  /// Switches and index pulses, in the drive's direction.
  [[nodiscard]] HomingSenses senses() noexcept;
  void show_actual() noexcept;
  void show_controller() noexcept;
  void take_demands() noexcept;
  void seed_references() noexcept;
  void watch_stop() noexcept;
  [[nodiscard]] bool stopped() const noexcept;
  [[nodiscard]] bool has_brake() const noexcept { return parameters_.brake_fitted != 0.0; }
  /// Whether the brake has had the time that its last command takes.
  [[nodiscard]] bool brake_moved() const noexcept;
  void watch_brake(bool was_set) noexcept;
  [[nodiscard]] canopen::ErrorCode present_cause(canopen::ErrorCode connection) noexcept;
  /// By how much motor angle, link angle and the spring's torque contradict each other.
  [[nodiscard]] double mismatch_rad() const noexcept;
  [[nodiscard]] Reference reference() const noexcept;
  [[nodiscard]] BridgeAction action() const noexcept;
  [[nodiscard]] bool can_ramp() const noexcept;
  [[nodiscard]] bool powered() const noexcept {
    return machine_.motion() != canopen::DriveMotion::kNone;
  }

  static constexpr std::int64_t kNoTurn = INT64_MIN;  // not in homing mode

  double period_s_;
  std::uint32_t modes_;
  bool reversed_;
  double velocity_units_;      ///< in a count per second
  double acceleration_units_;  ///< in a count per second and second
  bool stands_in_;             ///< for a drive of another make, whose scales need not be whole
  std::int32_t zero_at_power_on_;
  std::int32_t zero_counts_;  ///< homing changes it
  std::int32_t turn_counts_;  ///< AxisSetup::turn_counts
  double home_switch_from_rad_;
  double home_switch_to_rad_;
  double index_rad_;
  double index_pitch_rad_;
  bool counts_from_power_on_;
  bool at_power_on_;  ///< no sample yet, from which it counts
  canopen::DriveParameters power_on_;
  canopen::DriveParameters parameters_;  ///< in force; of objects_
  AxisObjects objects_;
  JointController controller_;
  ProfileModes profile_;
  ProfileOutputs profiled_;  ///< of the last period
  Protection protection_;
  canopen::DriveMachine machine_;
  Encoder link_encoder_;
  Encoder motor_encoder_;
  NoisySensor torque_sensor_;
  FilteredDifference link_velocity_;
  FilteredDifference motor_velocity_;
  FilteredDifference torque_rate_;
  Measurement measured_;
  double temperature_C_ = 0.0;
  double stiffness_Nm_rad_ = 0.0;  ///< the last one that was a number and not negative
  double damping_Nms_rad_ = 0.0;
  double stopping_s_ = 0.0;                                  ///< since the stop in progress began
  double resting_s_ = 0.0;                                   ///< since the motor came to rest in it
  double slowest_rad_s_ = 0.0;                               ///< of the motor, in it
  double stalled_s_ = 0.0;                                   ///< since it last became slower
  std::int64_t brake_periods_ = 0;                           ///< since the brake's command changed
  canopen::DriveMotion stop_ = canopen::DriveMotion::kNone;  ///< the one whose rest is timed
  canopen::Mode mode_ = canopen::Mode::kNone;
  std::int64_t index_turn_ = kNoTurn;  ///< how many index pulses the motor is above index_rad_
  bool sensors_valid_ = true;
  bool settings_changed_ = false;
};

}  // namespace tandem::firmware
