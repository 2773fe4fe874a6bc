// What users read of a fault: one sentence for each source, with the names of what it struck.
#include "runtime/fault_text.hpp"

#include <cstdio>
#include <iterator>

#include "estimation/collision.hpp"
#include "hal/remote_command.hpp"

namespace tandem::runtime {

namespace {

std::string emergency_text(const FaultRecord& record, const FaultContext&) {
  switch (static_cast<EmergencyInput>(record.code)) {
    case EmergencyInput::kSignal: return "emergency stop by a signal";
    case EmergencyInput::kRequest: return "emergency stop on request";
    case EmergencyInput::kWatchdog: return "emergency stop by the watchdog: the loop hung";
  }
  return {};
}

std::string owner_text(const FaultRecord& record, const FaultContext&) {
  switch (static_cast<hal::OwnerLoss>(record.code)) {
    case hal::OwnerLoss::kNone: return "the remote owner asked for a stop";
    case hal::OwnerLoss::kSilent: return "the remote owner is gone: its lease has run out";
    case hal::OwnerLoss::kStale: return "the remote owner's commands stopped, or came too late";
    case hal::OwnerLoss::kLate: return "the remote owner gave no command for this cycle in time";
  }
  return {};
}

std::string link_text(const FaultRecord& record, const FaultContext&) {
  if (static_cast<hal::LinkLoss>(record.code) == hal::LinkLoss::kStates)
    return "the link is lost: no state of the robot comes";
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

std::string drive_text(const FaultRecord& record, const FaultContext& about) {
  return about.backend.fault_text(record.cause, record.code);
}

std::string no_feedback(const FaultRecord& record, const FaultContext&) {
  return "no feedback for " + std::to_string(record.code) + " cycles";
}

std::string no_sample(const FaultRecord& record, const FaultContext&) {
  return "no sample for " + std::to_string(record.code) + " cycles";
}

std::string backend_text(const FaultRecord& record, const FaultContext&) {
  return std::string("the robot answered ") + tandem::to_string(static_cast<Code>(record.code));
}

std::string controller_text(const FaultRecord& record, const FaultContext&) {
  if (record.code > static_cast<std::uint32_t>(Code::kStopped)) {
    return "the controller gave up, with a code that there is not: " + std::to_string(record.code);
  }
  return std::string("the controller gave up: ") +
         tandem::to_string(static_cast<Code>(record.code));
}

std::string command_text(const FaultRecord&, const FaultContext&) {
  return "a controller's command was not a finite number";
}

std::string stray_text(const FaultRecord& record, const FaultContext& about) {
  return "the controller '" + about.controllers.name(record.code) +
         "' wrote to this joint, its mode or its gains without a claim, or what the joint cannot "
         "do: taken back";
}

std::string overrun_text(const FaultRecord&, const FaultContext& about) {
  return std::to_string(about.config.loop.stop_late) + " of the last " +
         std::to_string(about.config.loop.stop_window) + " cycles were late";
}

std::string bring_up_text(const FaultRecord&, const FaultContext&) {
  return "the drives were not enabled in time";
}

std::string collision_text(const FaultRecord& record, const FaultContext& about) {
  const bool force = record.index < 0 && record.index > -4;
  return std::string("collision: an external ") + (force ? "force" : "torque") + " of " +
         in_units(record, about);
}

std::string fell_text(const FaultRecord& record, const FaultContext& about) {
  return fall_text({static_cast<FallKind>(record.code), record.index}, about.config.fall);
}

std::string text_of(const FaultRecord& record, const FaultContext& about) {
  static constexpr std::string (*kTexts[])(const FaultRecord&, const FaultContext&) = {
#define TANDEM_FAULT(name, strikes, event, text, meaning) text,
#include "runtime/fault_sources.inc"
#undef TANDEM_FAULT
  };
  const auto row = static_cast<std::size_t>(record.source);
  return row < std::size(kTexts) ? kTexts[row](record, about) : std::string();
}

/// The joint, sensor or controller that the fault is about, and a joint's board.
void name_it(const FaultRecord& record, const FaultContext& about, Fault& fault) {
  const auto index = static_cast<std::size_t>(record.index);
  switch (row_of(record.source).strikes) {
    case FaultStrikes::kJoint:
      if (record.index < 0) {
        fault.joint = "base";
        break;
      }
      fault.joint = about.robot.joints[index].name;
      fault.board = about.robot.joints[index].board;
      break;
    case FaultStrikes::kSensor: fault.joint = about.robot.sensors[index].name; break;
    case FaultStrikes::kController: fault.joint = about.controllers.name(index); break;
    case FaultStrikes::kRobot: break;
  }
  const bool hung = record.source == FaultSource::kEmergencyStop &&
                    static_cast<EmergencyInput>(record.code) == EmergencyInput::kWatchdog;
  if (hung && record.index >= 0) fault.joint = about.controllers.name(index);
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
