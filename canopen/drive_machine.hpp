// The CiA 402 drive state machine: the drive's side, and what the master does about it.
// Layer: canopen.  Thread: any; an object belongs to one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/realtime.hpp"
#include "canopen/objects.hpp"

namespace tandem {
class Archive;
}

namespace tandem::canopen {

/// Numbered as the images and the log number them, where 0 is a drive that was not heard yet.
enum class DriveMachineState : std::uint8_t {
  kNotReadyToSwitchOn = 1,  ///< statusword x0xx 0000
  kSwitchOnDisabled,        ///< x1xx 0000
  kReadyToSwitchOn,         ///< x01x 0001
  kSwitchedOn,              ///< x01x 0011
  kOperationEnabled,        ///< x01x 0111
  kQuickStopActive,         ///< x00x 0111
  kFaultReactionActive,     ///< x0xx 1111
  kFault,                   ///< x0xx 1000
};
[[nodiscard]] const char* to_string(DriveMachineState state) noexcept;

namespace detail {
/// By a statusword's bits 0 to 3, 5 and 6.
inline constexpr std::array kDriveStates = [] {
  std::array<DriveMachineState, 0x70> states{};
  states.fill(DriveMachineState::kNotReadyToSwitchOn);
  for (const std::size_t bit_5 : {0x00U, 0x20U}) {
    states[0x40 | bit_5] = DriveMachineState::kSwitchOnDisabled;
    states[0x0F | bit_5] = DriveMachineState::kFaultReactionActive;
    states[0x08 | bit_5] = DriveMachineState::kFault;
  }
  states[0x21] = DriveMachineState::kReadyToSwitchOn;
  states[0x23] = DriveMachineState::kSwitchedOn;
  states[0x27] = DriveMachineState::kOperationEnabled;
  states[0x07] = DriveMachineState::kQuickStopActive;
  return states;
}();
}  // namespace detail

/// The state in a statusword; bits 4, 7 to 15 play no part. A pattern of no state (none
/// is sent by a conforming drive) counts as kNotReadyToSwitchOn.
[[nodiscard]] constexpr DriveMachineState drive_state(std::uint16_t statusword) noexcept TANDEM_RT {
  return detail::kDriveStates[statusword & 0x6F];
}

/// The controlword that brings a drive one transition nearer to Operation Enabled, from any state
/// but a fault; in Fault 0x0000, so that fault reset gets its rising edge.
[[nodiscard]] std::uint16_t controlword_towards_enabled(DriveMachineState state) noexcept TANDEM_RT;

/// What the drive has to do with its motor.
enum class DriveMotion : std::uint8_t {
  kNone,       ///< no torque
  kFollow,     ///< follow the mode of operation's reference
  kSlowDown,   ///< come to rest on the slow-down ramp
  kQuickStop,  ///< come to rest on the quick-stop ramp (6085)
  kShorted,    ///< brake by the shorted winding
};

/// Option codes, with the profile's defaults but for the fault reaction. -1 is ours: the winding is
/// shorted, which needs neither sensors nor gains.
struct DriveOptions {
  std::int16_t quick_stop = 2;  ///< 605A: 0 disable; 1, 2 slow, quick ramp; 5, 6 and stay; -1
  std::int16_t shutdown = 0;    ///< 605B: 0 disable; 1 slow-down ramp
  std::int16_t disable_operation = 1;  ///< 605C: 0 disable; 1 slow-down ramp
  std::int16_t halt = 1;               ///< 605D: 1 slow-down ramp; 2 quick-stop ramp
  std::int16_t fault_reaction = -1;    ///< 605E: 0 disable; 1, 2 slow, quick ramp; -1
};

/// What the drive knows when the machine is stepped.
struct DriveInputs {
  bool fault = false;            ///< a fault is present now
  bool at_rest = false;          ///< a ramp has ended; looked at only during one
  bool standstill = false;       ///< the same, and not for want of time
  bool internal_limit = false;   ///< statusword bit 11
  bool follows_command = false;  ///< statusword bit 12, shown in Operation Enabled
  bool following_error = false;  ///< statusword bit 13
  bool target_reached = false;   ///< statusword bit 10, in a mode that has a target
  bool warning = false;          ///< statusword bit 7
  bool has_brake = false;        ///< the motor has a brake
  bool brake_moved = true;       ///< it has had the time that it needs to obey brake_set()
};

/// The drive's side: transitions 0 to 16, at most one per step. A controlword with bit 7 is no
/// command, whatever the other bits say: only its rising edge counts, and halt.
///
/// Bit 10 of the statusword, target reached: cyclic modes have no target that they reach by
/// themselves. In those it is set where a stop that stays enabled has come to rest: halt, and
/// quick stop with option 5 or 6.
///
/// A quick stop ramp that ends in an open bridge leads there by the shorted winding, when there is
/// no brake: a load that the drive held then sinks, and does not fall.
///
/// A brake delays two of them. Enabling (4) holds the axis in Switched On, its bridge closed, until
/// the brake is open. A ramp that ends in an open bridge sets the brake when the axis is at rest,
/// and the bridge stays closed until the brake holds. What opens the bridge at once is not delayed:
/// it sets the brake in the same step.
class DriveMachine {
 public:
  /// Takes the controlword in force, makes the transition that it or the inputs ask for.
  /// A fault reset is a rising edge of bit 7 and works only when `inputs.fault` is gone.
  DriveMachineState step(std::uint16_t controlword, const DriveInputs& inputs,
                         const DriveOptions& options) noexcept TANDEM_RT;
  /// The loss of the connection, as option code 6007 has it: 2 disable voltage, 3 quick stop.
  void abort_connection(std::int16_t option, const DriveOptions& options) noexcept TANDEM_RT;

  [[nodiscard]] DriveMachineState state() const noexcept { return state_; }
  [[nodiscard]] DriveMotion motion() const noexcept { return motion_; }
  /// Whether the brake is to hold: its coil has no current.
  [[nodiscard]] bool brake_set() const noexcept { return brake_set_; }
  [[nodiscard]] std::uint16_t statusword() const noexcept { return statusword_; }
  /// True in the step that left Fault by a reset.
  [[nodiscard]] bool fault_was_reset() const noexcept { return fault_was_reset_; }

  /// Power-on again: transition 0.
  void reset() noexcept { *this = DriveMachine{}; }
  void archive(Archive& ar);

 private:
  void follow(std::uint16_t controlword, const DriveInputs& inputs,
              const DriveOptions& options) noexcept;
  void from_enabled(std::uint16_t controlword, const DriveInputs& inputs,
                    const DriveOptions& options) noexcept;
  void from_quick_stop(std::uint16_t controlword, const DriveInputs& inputs,
                       const DriveOptions& options) noexcept;
  void quick_stop(const DriveOptions& options) noexcept;
  void slow_down_to(DriveMachineState state, std::int16_t option) noexcept;
  void enter(DriveMachineState state) noexcept;
  [[nodiscard]] bool stop_stays(const DriveOptions& options) const noexcept;
  [[nodiscard]] bool stop_ended(const DriveInputs& inputs) noexcept;
  [[nodiscard]] bool ramp_ended(const DriveInputs& inputs) const noexcept;
  void command_brake(const DriveInputs& inputs, const DriveOptions& options) noexcept;
  void compose_statusword(const DriveInputs& inputs, const DriveOptions& options) noexcept;

  DriveMachineState state_ = DriveMachineState::kNotReadyToSwitchOn;
  DriveMachineState after_ramp_ =
      DriveMachineState::kOperationEnabled;  ///< where a ramp in progress leads
  DriveMotion motion_ = DriveMotion::kNone;
  bool last_reset_bit_ = true;  ///< a bit that is set from the beginning is no edge
  bool fault_was_reset_ = false;
  bool brake_set_ = true;
  std::uint16_t statusword_ = 0;
};

}  // namespace tandem::canopen
