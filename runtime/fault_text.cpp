// What users read of a fault: one sentence for each source, with the names of what it struck.
#include "runtime/fault_text.hpp"

#include "hal/remote_command.hpp"

namespace tandem::runtime {

Fault in_words(const FaultRecord& record, std::int64_t cleared_ns, const FaultContext& about) {
  Fault fault;
  fault.cycle = record.cycle;
  fault.time_s = static_cast<double>(record.time_ns) * 1e-9;
  fault.category = record.category;
  fault.latched = cleared_ns == FaultLog::kLatched;
  fault.cleared_s = fault.latched ? 0.0 : static_cast<double>(cleared_ns) * 1e-9;
  const auto index = static_cast<std::size_t>(record.index);
  const char* code = tandem::to_string(static_cast<Code>(record.code));
  switch (record.source) {
    case FaultSource::kDrive:
      fault.text = about.backend.fault_text(record.cause, record.code);
      break;
    case FaultSource::kJointLost:
      fault.text = "no feedback for " + std::to_string(record.code) + " cycles";
      break;
    case FaultSource::kSensorLost:
      fault.joint = about.robot.sensors[index].name;
      fault.text = "no sample for " + std::to_string(record.code) + " cycles";
      break;
    case FaultSource::kBackend: fault.text = "the robot answered " + std::string(code); break;
    case FaultSource::kController:
      fault.joint = about.controllers.name(index);
      fault.text = "the controller gave up: " + std::string(code);
      break;
    case FaultSource::kCommand:
      fault.text = "a controller's command was not a finite number";
      break;
    case FaultSource::kStray:
      fault.text = "the controller '" + about.controllers.name(record.code) +
                   "' wrote to this joint, or its mode, without a claim: taken back";
      break;
    case FaultSource::kOverrun:
      fault.text = std::to_string(about.config.loop.stop_late) + " of the last " +
                   std::to_string(about.config.loop.stop_window) + " cycles were late";
      break;
    case FaultSource::kBringUp: fault.text = "the drives were not enabled in time"; break;
    case FaultSource::kEmergencyStop:
      switch (static_cast<EmergencyInput>(record.code)) {
        case EmergencyInput::kSignal: fault.text = "emergency stop by a signal"; break;
        case EmergencyInput::kRequest: fault.text = "emergency stop on request"; break;
        case EmergencyInput::kWatchdog:
          if (record.index >= 0) fault.joint = about.controllers.name(index);
          fault.text = "emergency stop by the watchdog: the loop hung";
          break;
      }
      break;
    case FaultSource::kOwner:
      switch (static_cast<hal::OwnerLoss>(record.code)) {
        case hal::OwnerLoss::kNone: fault.text = "the remote owner asked for a stop"; break;
        case hal::OwnerLoss::kSilent:
          fault.text = "the remote owner is gone: its lease has run out";
          break;
        case hal::OwnerLoss::kStale:
          fault.text = "the remote owner's commands stopped, or came too late";
          break;
        case hal::OwnerLoss::kLate:
          fault.text = "the remote owner gave no command for this cycle in time";
          break;
      }
      break;
    case FaultSource::kFall:
      fault.text = fall_text({static_cast<FallKind>(record.code), record.index}, about.config.fall);
      break;
  }
  if (record.source == FaultSource::kDrive || record.source == FaultSource::kJointLost ||
      record.source == FaultSource::kCommand || record.source == FaultSource::kStray) {
    fault.joint = about.robot.joints[index].name;
    fault.board = about.robot.joints[index].board;
  }
  return fault;
}

}  // namespace tandem::runtime
