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

const char* to_string(DriveState state) noexcept {
  switch (state) {
    case DriveState::kNotReadyToSwitchOn: return "not ready to switch on";
    case DriveState::kSwitchOnDisabled: return "switch on disabled";
    case DriveState::kReadyToSwitchOn: return "ready to switch on";
    case DriveState::kSwitchedOn: return "switched on";
    case DriveState::kOperationEnabled: return "operation enabled";
    case DriveState::kQuickStopActive: return "quick stop active";
    case DriveState::kFaultReactionActive: return "fault reaction active";
    case DriveState::kFault: return "fault";
  }
  return "unknown";
}

DriveState drive_state(std::uint16_t word) noexcept TANDEM_RT {
  switch (word & 0x4F) {
    case 0x40: return DriveState::kSwitchOnDisabled;
    case 0x0F: return DriveState::kFaultReactionActive;
    case 0x08: return DriveState::kFault;
    default: break;
  }
  switch (word & 0x6F) {
    case 0x21: return DriveState::kReadyToSwitchOn;
    case 0x23: return DriveState::kSwitchedOn;
    case 0x27: return DriveState::kOperationEnabled;
    case 0x07: return DriveState::kQuickStopActive;
    default: return DriveState::kNotReadyToSwitchOn;
  }
}

std::uint16_t controlword_towards_enabled(DriveState state) noexcept TANDEM_RT {
  switch (state) {
    case DriveState::kSwitchOnDisabled: return kCommandShutdown;  // 2
    case DriveState::kReadyToSwitchOn: return kCommandSwitchOn;   // 3
    case DriveState::kSwitchedOn:                                 // 4
    case DriveState::kOperationEnabled: return kCommandEnableOperation;
    case DriveState::kNotReadyToSwitchOn:   // transition 1 is the drive's own
    case DriveState::kQuickStopActive:      // transition 12
    case DriveState::kFaultReactionActive:  // transition 14 is the drive's own
    case DriveState::kFault: return kCommandDisableVoltage;
  }
  return kCommandDisableVoltage;
}

DriveState DriveMachine::step(std::uint16_t word, const DriveInputs& inputs,
                              const DriveOptions& options) noexcept TANDEM_RT {
  fault_was_reset_ = false;
  const bool in_fault = state_ == DriveState::kFault || state_ == DriveState::kFaultReactionActive;
  if (inputs.fault && !in_fault) {  // transition 13
    const bool powered = motion_ != DriveMotion::kNone;
    enter(DriveState::kFaultReactionActive);
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
    case DriveState::kNotReadyToSwitchOn: enter(DriveState::kSwitchOnDisabled); break;  // 1
    case DriveState::kSwitchOnDisabled:
      if (shuts_down(word)) enter(DriveState::kReadyToSwitchOn);  // 2
      break;
    case DriveState::kReadyToSwitchOn:
      if (disables_voltage(word) || quick_stops(word)) {
        enter(DriveState::kSwitchOnDisabled);  // 7
      } else if (switches_on(word)) {
        enter(DriveState::kSwitchedOn);  // 3
      }
      break;
    case DriveState::kSwitchedOn:
      if (disables_voltage(word) || quick_stops(word)) {
        enter(DriveState::kSwitchOnDisabled);  // 10
      } else if (shuts_down(word)) {
        enter(DriveState::kReadyToSwitchOn);  // 6
      } else if (!enables(word)) {
        motion_ = DriveMotion::kNone;
      } else if (!inputs.has_brake || (!brake_set_ && inputs.brake_moved)) {
        enter(DriveState::kOperationEnabled);  // 4
      } else {
        motion_ = DriveMotion::kSlowDown;  // holds while the brake opens
      }
      break;
    case DriveState::kOperationEnabled: from_enabled(word, inputs, options); break;
    case DriveState::kQuickStopActive: from_quick_stop(word, inputs, options); break;
    case DriveState::kFaultReactionActive:
      if (motion_ == DriveMotion::kNone || stop_ended(inputs)) enter(DriveState::kFault);  // 14
      break;
    case DriveState::kFault:
      if ((word & kFaultReset) != 0 && !last_reset_bit_ && !inputs.fault) {
        enter(DriveState::kSwitchOnDisabled);  // 15
        fault_was_reset_ = true;
      }
      break;
  }
}

void DriveMachine::from_enabled(std::uint16_t word, const DriveInputs& inputs,
                                const DriveOptions& options) noexcept {
  if (disables_voltage(word)) {
    enter(DriveState::kSwitchOnDisabled);  // 9
  } else if (quick_stops(word)) {
    quick_stop(options);  // 11
  } else if (after_ramp_ != DriveState::kOperationEnabled) {
    if (ramp_ended(inputs)) enter(after_ramp_);  // 5 or 8 ends
  } else if (shuts_down(word)) {
    slow_down_to(DriveState::kReadyToSwitchOn, options.shutdown);  // 8
  } else if (disables_operation(word)) {
    slow_down_to(DriveState::kSwitchedOn, options.disable_operation);  // 5
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
    enter(DriveState::kSwitchOnDisabled);  // 12
  } else if (stays && enables(word)) {
    enter(DriveState::kOperationEnabled);  // 16
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
  const bool ramp = state_ == DriveState::kFaultReactionActive ||
                    (state_ == DriveState::kQuickStopActive && options.quick_stop < 5) ||
                    after_ramp_ != DriveState::kOperationEnabled;
  if (motion_ == DriveMotion::kNone || (ramp && inputs.at_rest)) {
    brake_set_ = true;
  } else if (!ramp) {
    brake_set_ = false;
  }
}

void DriveMachine::quick_stop(const DriveOptions& options) noexcept {
  if (options.quick_stop == 0) {
    enter(DriveState::kSwitchOnDisabled);
    return;
  }
  enter(DriveState::kQuickStopActive);
  switch (options.quick_stop) {
    case 1:
    case 5: motion_ = DriveMotion::kSlowDown; break;
    case -1: motion_ = DriveMotion::kShorted; break;
    default: motion_ = DriveMotion::kQuickStop; break;
  }
}

void DriveMachine::slow_down_to(DriveState state, std::int16_t option) noexcept {
  if (option == 0) {
    enter(state);
    return;
  }
  after_ramp_ = state;
  motion_ = DriveMotion::kSlowDown;
}

void DriveMachine::abort_connection(std::int16_t option,
                                    const DriveOptions& options) noexcept TANDEM_RT {
  if (state_ != DriveState::kOperationEnabled) return;
  if (option == 2) enter(DriveState::kSwitchOnDisabled);
  if (option == 3) quick_stop(options);
}

void DriveMachine::enter(DriveState state) noexcept {
  state_ = state;
  after_ramp_ = DriveState::kOperationEnabled;
  motion_ = state == DriveState::kOperationEnabled ? DriveMotion::kFollow : DriveMotion::kNone;
}

/// Halt, or a quick stop that waits for a command.
bool DriveMachine::stop_stays(const DriveOptions& options) const noexcept {
  if (state_ == DriveState::kQuickStopActive) return options.quick_stop >= 5;
  return state_ == DriveState::kOperationEnabled && motion_ != DriveMotion::kFollow &&
         after_ramp_ == DriveState::kOperationEnabled;
}

void DriveMachine::compose_statusword(const DriveInputs& inputs,
                                      const DriveOptions& options) noexcept {
  using namespace statusword;
  std::uint16_t word = kRemote | kVoltageEnabled;
  switch (state_) {
    case DriveState::kNotReadyToSwitchOn: break;
    case DriveState::kSwitchOnDisabled: word |= kSwitchOnDisabled; break;
    case DriveState::kReadyToSwitchOn: word |= kReadyToSwitchOn | statusword::kQuickStop; break;
    case DriveState::kSwitchedOn:
      word |= kReadyToSwitchOn | kSwitchedOn | statusword::kQuickStop;
      break;
    case DriveState::kOperationEnabled:
      word |= kReadyToSwitchOn | kSwitchedOn | kOperationEnabled | statusword::kQuickStop;
      break;
    case DriveState::kQuickStopActive:
      word |= kReadyToSwitchOn | kSwitchedOn | kOperationEnabled;
      break;
    case DriveState::kFaultReactionActive:
      word |= kReadyToSwitchOn | kSwitchedOn | kOperationEnabled | statusword::kFault;
      break;
    case DriveState::kFault: word |= statusword::kFault; break;
  }
  if (inputs.warning) word |= kWarning;
  if (inputs.internal_limit) word |= kInternalLimit;
  if (inputs.standstill && stop_stays(options)) word |= kTargetReached;
  if (state_ == DriveState::kOperationEnabled) {
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
