// Transitions 0 to 16 by controlword and inputs, one per call; the stop options, the brake's
// commands and the statusword's bits.
#include "canopen/drive_machine.hpp"

#include "base/archive.hpp"

namespace tandem::canopen {

namespace {

using namespace controlword;

// The commands of CiA 402, by the bits that each looks at. Bit 7 is 0 in every one.
constexpr std::uint16_t kVoltageBits = kFaultReset | kEnableVoltage;
constexpr std::uint16_t kStopBits = kVoltageBits | kQuickStop;
constexpr std::uint16_t kSwitchBits = kStopBits | kSwitchOn;
constexpr std::uint16_t kAllBits = kSwitchBits | kEnableOperation;

bool disables_voltage(std::uint16_t word) noexcept { return (word & kVoltageBits) == 0; }
bool quick_stops(std::uint16_t word) noexcept { return (word & kStopBits) == kCommandQuickStop; }
bool shuts_down(std::uint16_t word) noexcept { return (word & kSwitchBits) == kCommandShutdown; }
bool switches_on(std::uint16_t word) noexcept { return (word & kSwitchBits) == kCommandSwitchOn; }
bool enables(std::uint16_t word) noexcept { return (word & kAllBits) == kCommandEnableOperation; }
bool disables_operation(std::uint16_t word) noexcept {
  return (word & kAllBits) == kCommandSwitchOn;
}

}  // namespace

const char* to_string(DriveMachineState state) noexcept {
  switch (state) {
    case DriveMachineState::kNotReadyToSwitchOn: return "not ready to switch on";
    case DriveMachineState::kSwitchOnDisabled: return "switch on disabled";
    case DriveMachineState::kReadyToSwitchOn: return "ready to switch on";
    case DriveMachineState::kSwitchedOn: return "switched on";
    case DriveMachineState::kOperationEnabled: return "operation enabled";
    case DriveMachineState::kQuickStopActive: return "quick stop active";
    case DriveMachineState::kFaultReactionActive: return "fault reaction active";
    case DriveMachineState::kFault: return "fault";
  }
  return "unknown";
}

std::uint16_t controlword_towards_enabled(DriveMachineState state) noexcept TANDEM_RT {
  switch (state) {
    case DriveMachineState::kSwitchOnDisabled: return kCommandShutdown;  // 2
    case DriveMachineState::kReadyToSwitchOn: return kCommandSwitchOn;   // 3
    case DriveMachineState::kSwitchedOn:                                 // 4
    case DriveMachineState::kOperationEnabled: return kCommandEnableOperation;
    case DriveMachineState::kNotReadyToSwitchOn:   // transition 1 is the drive's own
    case DriveMachineState::kQuickStopActive:      // transition 12
    case DriveMachineState::kFaultReactionActive:  // transition 14 is the drive's own
    case DriveMachineState::kFault: return kCommandDisableVoltage;
  }
  return kCommandDisableVoltage;
}

DriveMachineState DriveMachine::step(std::uint16_t word, const DriveInputs& inputs,
                                     const DriveOptions& options) noexcept TANDEM_RT {
  fault_was_reset_ = false;
  const bool in_fault =
      state_ == DriveMachineState::kFault || state_ == DriveMachineState::kFaultReactionActive;
  if (inputs.fault && !in_fault) {  // transition 13
    const bool powered = motion_ != DriveMotion::kNone;
    enter(DriveMachineState::kFaultReactionActive);
    if (powered && options.fault_reaction == 1) motion_ = DriveMotion::kSlowDown;
    if (powered && options.fault_reaction == 2) motion_ = DriveMotion::kQuickStop;
    if (powered && options.fault_reaction == -1) motion_ = DriveMotion::kShorted;
  } else {
    follow(word, inputs, options);
  }
  command_brake(inputs, options);
  last_reset_bit_ = (word & kFaultReset) != 0;
  compose_statusword(inputs, options);
  return state_;
}

void DriveMachine::follow(std::uint16_t word, const DriveInputs& inputs,
                          const DriveOptions& options) noexcept {
  switch (state_) {
    case DriveMachineState::kNotReadyToSwitchOn:
      enter(DriveMachineState::kSwitchOnDisabled);
      break;  // 1
    case DriveMachineState::kSwitchOnDisabled:
      if (shuts_down(word)) enter(DriveMachineState::kReadyToSwitchOn);  // 2
      break;
    case DriveMachineState::kReadyToSwitchOn:
      if (disables_voltage(word) || quick_stops(word)) {
        enter(DriveMachineState::kSwitchOnDisabled);  // 7
      } else if (switches_on(word)) {
        enter(DriveMachineState::kSwitchedOn);  // 3
      }
      break;
    case DriveMachineState::kSwitchedOn:
      if (disables_voltage(word) || quick_stops(word)) {
        enter(DriveMachineState::kSwitchOnDisabled);  // 10
      } else if (shuts_down(word)) {
        enter(DriveMachineState::kReadyToSwitchOn);  // 6
      } else if (!enables(word)) {
        motion_ = DriveMotion::kNone;
      } else if (!inputs.has_brake || (!brake_set_ && inputs.brake_moved)) {
        enter(DriveMachineState::kOperationEnabled);  // 4
      } else {
        motion_ = DriveMotion::kSlowDown;  // holds while the brake opens
      }
      break;
    case DriveMachineState::kOperationEnabled: from_enabled(word, inputs, options); break;
    case DriveMachineState::kQuickStopActive: from_quick_stop(word, inputs, options); break;
    case DriveMachineState::kFaultReactionActive:
      if (motion_ == DriveMotion::kNone || stop_ended(inputs))
        enter(DriveMachineState::kFault);  // 14
      break;
    case DriveMachineState::kFault:
      if ((word & kFaultReset) != 0 && !last_reset_bit_ && !inputs.fault) {
        enter(DriveMachineState::kSwitchOnDisabled);  // 15
        fault_was_reset_ = true;
      }
      break;
  }
}

void DriveMachine::from_enabled(std::uint16_t word, const DriveInputs& inputs,
                                const DriveOptions& options) noexcept {
  if (disables_voltage(word)) {
    enter(DriveMachineState::kSwitchOnDisabled);  // 9
  } else if (quick_stops(word)) {
    quick_stop(options);  // 11
  } else if (after_ramp_ != DriveMachineState::kOperationEnabled) {
    if (ramp_ended(inputs)) enter(after_ramp_);  // 5 or 8 ends
  } else if (shuts_down(word)) {
    slow_down_to(DriveMachineState::kReadyToSwitchOn, options.shutdown);  // 8
  } else if (disables_operation(word)) {
    slow_down_to(DriveMachineState::kSwitchedOn, options.disable_operation);  // 5
  } else if ((word & kHalt) != 0) {
    motion_ = options.halt == 2 ? DriveMotion::kQuickStop : DriveMotion::kSlowDown;
  } else {
    motion_ = DriveMotion::kFollow;
  }
}

void DriveMachine::from_quick_stop(std::uint16_t word, const DriveInputs& inputs,
                                   const DriveOptions& options) noexcept {
  const bool stays = options.quick_stop >= 5;
  if (disables_voltage(word) || (!stays && stop_ended(inputs))) {
    enter(DriveMachineState::kSwitchOnDisabled);  // 12
  } else if (stays && enables(word)) {
    enter(DriveMachineState::kOperationEnabled);  // 16
  }
}

/// Whether a stop that opens the bridge ended. A ramp at rest goes on with the shorted winding.
bool DriveMachine::stop_ended(const DriveInputs& inputs) noexcept {
  if (!ramp_ended(inputs)) return false;
  if (motion_ != DriveMotion::kQuickStop || inputs.has_brake || !inputs.standstill) return true;
  motion_ = DriveMotion::kShorted;
  return false;
}

bool DriveMachine::ramp_ended(const DriveInputs& inputs) const noexcept {
  return inputs.has_brake ? brake_set_ && inputs.brake_moved : inputs.at_rest;
}

void DriveMachine::command_brake(const DriveInputs& inputs, const DriveOptions& options) noexcept {
  const bool ramp = state_ == DriveMachineState::kFaultReactionActive ||
                    (state_ == DriveMachineState::kQuickStopActive && options.quick_stop < 5) ||
                    after_ramp_ != DriveMachineState::kOperationEnabled;
  if (motion_ == DriveMotion::kNone || (ramp && inputs.at_rest)) {
    brake_set_ = true;
  } else if (!ramp) {
    brake_set_ = false;
  }
}

void DriveMachine::quick_stop(const DriveOptions& options) noexcept {
  if (options.quick_stop == 0) {
    enter(DriveMachineState::kSwitchOnDisabled);
    return;
  }
  enter(DriveMachineState::kQuickStopActive);
  switch (options.quick_stop) {
    case 1:
    case 5: motion_ = DriveMotion::kSlowDown; break;
    case -1: motion_ = DriveMotion::kShorted; break;
    default: motion_ = DriveMotion::kQuickStop; break;
  }
}

void DriveMachine::slow_down_to(DriveMachineState state, std::int16_t option) noexcept {
  if (option == 0) {
    enter(state);
    return;
  }
  after_ramp_ = state;
  motion_ = DriveMotion::kSlowDown;
}

void DriveMachine::abort_connection(std::int16_t option,
                                    const DriveOptions& options) noexcept TANDEM_RT {
  if (state_ != DriveMachineState::kOperationEnabled) return;
  if (option == 2) enter(DriveMachineState::kSwitchOnDisabled);
  if (option == 3) quick_stop(options);
}

void DriveMachine::enter(DriveMachineState state) noexcept {
  state_ = state;
  after_ramp_ = DriveMachineState::kOperationEnabled;
  motion_ =
      state == DriveMachineState::kOperationEnabled ? DriveMotion::kFollow : DriveMotion::kNone;
}

/// Halt, or a quick stop that waits for a command.
bool DriveMachine::stop_stays(const DriveOptions& options) const noexcept {
  if (state_ == DriveMachineState::kQuickStopActive) return options.quick_stop >= 5;
  return state_ == DriveMachineState::kOperationEnabled && motion_ != DriveMotion::kFollow &&
         after_ramp_ == DriveMachineState::kOperationEnabled;
}

void DriveMachine::compose_statusword(const DriveInputs& inputs,
                                      const DriveOptions& options) noexcept {
  using namespace statusword;
  std::uint16_t word = kRemote | kVoltageEnabled;
  switch (state_) {
    case DriveMachineState::kNotReadyToSwitchOn: break;
    case DriveMachineState::kSwitchOnDisabled: word |= kSwitchOnDisabled; break;
    case DriveMachineState::kReadyToSwitchOn:
      word |= kReadyToSwitchOn | statusword::kQuickStop;
      break;
    case DriveMachineState::kSwitchedOn:
      word |= kReadyToSwitchOn | kSwitchedOn | statusword::kQuickStop;
      break;
    case DriveMachineState::kOperationEnabled:
      word |= kReadyToSwitchOn | kSwitchedOn | kOperationEnabled | statusword::kQuickStop;
      break;
    case DriveMachineState::kQuickStopActive:
      word |= kReadyToSwitchOn | kSwitchedOn | kOperationEnabled;
      break;
    case DriveMachineState::kFaultReactionActive:
      word |= kReadyToSwitchOn | kSwitchedOn | kOperationEnabled | statusword::kFault;
      break;
    case DriveMachineState::kFault: word |= statusword::kFault; break;
  }
  if (inputs.warning) word |= kWarning;
  if (inputs.internal_limit) word |= kInternalLimit;
  if (inputs.standstill && stop_stays(options)) word |= kTargetReached;
  if (state_ == DriveMachineState::kOperationEnabled) {
    if (inputs.follows_command && motion_ == DriveMotion::kFollow) word |= kFollowsCommand;
    if (inputs.target_reached && motion_ == DriveMotion::kFollow) word |= kTargetReached;
    if (inputs.following_error) word |= statusword::kFollowingError;
  }
  statusword_ = word;
}

void DriveMachine::archive(Archive& ar) {
  ar(state_, after_ramp_, motion_, last_reset_bit_, fault_was_reset_, brake_set_, statusword_);
}

}  // namespace tandem::canopen
