// What users read of a fault: one sentence for each source, with the names of what it struck.
#include "runtime/fault_text.hpp"

#include <cstdio>

#include "estimation/collision.hpp"
#include "hal/remote_command.hpp"

namespace tandem::runtime {

namespace {

std::string emergency_text(EmergencyInput input) {
  switch (input) {
    case EmergencyInput::kSignal: return "emergency stop by a signal";
    case EmergencyInput::kRequest: return "emergency stop on request";
    case EmergencyInput::kWatchdog: return "emergency stop by the watchdog: the loop hung";
  }
  return {};
}

std::string owner_text(hal::OwnerLoss loss) {
  switch (loss) {
    case hal::OwnerLoss::kNone: return "the remote owner asked for a stop";
    case hal::OwnerLoss::kSilent: return "the remote owner is gone: its lease has run out";
    case hal::OwnerLoss::kStale: return "the remote owner's commands stopped, or came too late";
    case hal::OwnerLoss::kLate: return "the remote owner gave no command for this cycle in time";
  }
  return {};
}

std::string link_text(hal::LinkLoss loss) {
  if (loss == hal::LinkLoss::kStates) return "the link is lost: no state of the robot comes";
  return "the link is lost: states of the robot come, but it follows no command";
}

/// "12.3 Nm"
std::string in_units(const FaultRecord& record, const FaultContext& about) {
  const auto joint = static_cast<std::size_t>(record.index);
  char text[64];
  if (record.index < 0) {  // the base
    const int channel = -1 - record.index;
    std::snprintf(text, sizeof text, "%.3g %s (%s)", 1e-3 * record.code, channel < 3 ? "N" : "Nm",
                  estimation::kBaseChannels[static_cast<std::size_t>(channel)]);
    return text;
  }
  std::snprintf(text, sizeof text, "%.3g %s", 1e-3 * record.code,
                about.robot.joints[joint].slides ? "N" : "Nm");
  return text;
}

std::string not_homed_text(const FaultRecord& record, const FaultContext& about) {
  const auto error = static_cast<hal::HomingError>(record.code);
  const auto& homing = about.robot.joints[static_cast<std::size_t>(record.index)].homing;
  if (error == hal::HomingError::kNone || !homing) {
    return std::string("it was not homed, for which the controllers waited: tandem joint home") +
           (homing && homing->at_start ? ", or a longer run" : ", or homing.at_start = true");
  }
  return "its homing (method " + std::to_string(homing->method) +
         ") failed: " + hal::to_string(error) + "; " + hal::next_step(error);
}

std::string text_of(const FaultRecord& record, const FaultContext& about) {
  const std::string count = std::to_string(record.code);
  const char* code = tandem::to_string(static_cast<Code>(record.code));
  switch (record.source) {
    case FaultSource::kDrive: return about.backend.fault_text(record.cause, record.code);
    case FaultSource::kJointLost: return "no feedback for " + count + " cycles";
    case FaultSource::kSensorLost: return "no sample for " + count + " cycles";
    case FaultSource::kBackend: return "the robot answered " + std::string(code);
    case FaultSource::kController:
      return record.code > static_cast<std::uint32_t>(Code::kStopped)
                 ? "the controller gave up, with a code that there is not: " + count
                 : "the controller gave up: " + std::string(code);
    case FaultSource::kCommand: return "a controller's command was not a finite number";
    case FaultSource::kStray:
      return "the controller '" + about.controllers.name(record.code) +
             "' wrote to this joint, its mode or its gains without a claim, or what the joint "
             "cannot do: taken back";
    case FaultSource::kOverrun:
      return std::to_string(about.config.loop.stop_late) + " of the last " +
             std::to_string(about.config.loop.stop_window) + " cycles were late";
    case FaultSource::kBringUp: return "the drives were not enabled in time";
    case FaultSource::kNotHomed: return not_homed_text(record, about);
    case FaultSource::kEmergencyStop:
      return emergency_text(static_cast<EmergencyInput>(record.code));
    case FaultSource::kOwner: return owner_text(static_cast<hal::OwnerLoss>(record.code));
    case FaultSource::kLink: return link_text(static_cast<hal::LinkLoss>(record.code));
    case FaultSource::kCollision:
      return std::string("collision: an external ") +
             (record.index < 0 && record.index > -4 ? "force" : "torque") + " of " +
             in_units(record, about);
    case FaultSource::kFall:
      return fall_text({static_cast<FallKind>(record.code), record.index}, about.config.fall);
  }
  return {};
}

/// The joint, sensor or controller that the fault is about, and a joint's board.
void name_it(const FaultRecord& record, const FaultContext& about, Fault& fault) {
  const auto index = static_cast<std::size_t>(record.index);
  switch (record.source) {
    case FaultSource::kDrive:
    case FaultSource::kJointLost:
    case FaultSource::kCommand:
    case FaultSource::kStray:
    case FaultSource::kCollision:
    case FaultSource::kNotHomed:
      if (record.index < 0) {
        fault.joint = "base";
        break;
      }
      fault.joint = about.robot.joints[index].name;
      fault.board = about.robot.joints[index].board;
      break;
    case FaultSource::kSensorLost: fault.joint = about.robot.sensors[index].name; break;
    case FaultSource::kController: fault.joint = about.controllers.name(index); break;
    case FaultSource::kEmergencyStop:
      if (static_cast<EmergencyInput>(record.code) == EmergencyInput::kWatchdog &&
          record.index >= 0) {
        fault.joint = about.controllers.name(index);
      }
      break;
    default: break;
  }
}

}  // namespace

Fault in_words(const FaultRecord& record, std::int64_t cleared_ns, const FaultContext& about) {
  Fault fault;
  fault.cycle = record.cycle;
  fault.time_s = static_cast<double>(record.time_ns) * 1e-9;
  fault.category = record.category;
  fault.latched = cleared_ns == FaultLog::kLatched;
  fault.cleared_s = fault.latched ? 0.0 : static_cast<double>(cleared_ns) * 1e-9;
  fault.text = text_of(record, about);
  name_it(record, about, fault);
  return fault;
}

}  // namespace tandem::runtime
