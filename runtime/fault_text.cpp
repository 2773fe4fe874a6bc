// What users read of a fault: one sentence for each source, with the names of what it struck.
#include "runtime/fault_text.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "estimation/collision.hpp"
#include "log/event.hpp"

namespace tandem::runtime {

using hal::FaultCause;
using hal::FaultStrikes;

namespace {

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

std::string not_homed(const FaultRecord& record, const FaultContext& about) {
  const auto& homing = about.robot.joints[static_cast<std::size_t>(record.index)].homing;
  if (record.code == 0 || !homing) {
    return std::string("it was not homed, for which the controllers waited: tandem joint home") +
           (homing && homing->at_start ? ", or a longer run" : ", or homing.at_start = true");
  }
  const hal::CauseRow why = hal::row_of(log::cause_of(log::EventKind::kHomingFailed, record.code));
  return fmt::format("its homing (method {}) failed: {}; {}", homing->method, why.words,
                     why.advice);
}

std::string name_of(const FaultRecord& record, const FaultContext& about) {
  return record.controller < 0
             ? std::string()
             : about.controllers.name(static_cast<std::size_t>(record.controller));
}

/// What the words of a cause have besides its code.
std::string detail_of(const FaultRecord& record, const FaultContext& about) {
  const bool is_code = record.code <= static_cast<std::uint32_t>(Code::kStopped);
  const char* const code = is_code ? tandem::to_string(static_cast<Code>(record.code)) : "";
  switch (record.cause) {
    case FaultCause::kBackend: return code;
    case FaultCause::kController:
      return is_code ? std::string(": ") + code
                     : ", with a code that there is not: " + std::to_string(record.code);
    case FaultCause::kStray: return about.controllers.name(record.code);
    case FaultCause::kOverrun:
      return fmt::format("{} of the last {}", about.config.loop.stop_late,
                         about.config.loop.stop_window);
    case FaultCause::kCollision: {
      const bool force = record.index < 0 && record.index > -4;
      return std::string(force ? "force" : "torque") + " of " + in_units(record, about);
    }
    case FaultCause::kNotHomed: return not_homed(record, about);
    default: return {};
  }
}

std::string text_of(const FaultRecord& record, const FaultContext& about) {
  if (hal::is_of_drive(record.cause) && record.cause != FaultCause::kJointLost) {
    return about.backend.fault_text(record.cause, record.code);
  }
  if (record.cause == FaultCause::kCommand && record.met.kind != hal::LimitKind::kNone) {
    const std::string whose =
        record.controller < 0 ? "a controller" : "the controller '" + name_of(record, about) + "'";
    const bool is_mode = record.met.field >= hal::CommandField::kMode;
    return "the command of " + whose +
           (is_mode ? " has what does not exist: " : " was not a finite number: ") +
           hal::value_in_words(record.met);
  }
  if (log::event_of(record.cause) == log::EventKind::kFell) {
    return fall_text({record.cause, record.index}, about.config.fall);
  }
  std::string text =
      fmt::format(fmt::runtime(hal::sentence_of(record.cause)), fmt::arg("code", record.code),
                  fmt::arg("detail", detail_of(record, about)));
  if (record.cause == FaultCause::kOverrun && record.controller >= 0)
    text += "; in the last of them the controller '" + name_of(record, about) + "' took longest";
  return text;
}

/// The joint, sensor or controller that the fault is about, and a joint's board.
void name_it(const FaultRecord& record, const FaultContext& about, FaultReport& fault) {
  const auto index = static_cast<std::size_t>(record.index);
  switch (hal::row_of(record.cause).strikes) {
    case FaultStrikes::kDrive:
    case FaultStrikes::kBoard:
    case FaultStrikes::kJoint:
      if (record.index < 0) {
        fault.joint = "base";
        break;
      }
      fault.joint = about.robot.joints[index].name;
      fault.board = about.robot.joints[index].board;
      break;
    case FaultStrikes::kSensor: fault.joint = about.robot.sensors[index].name; break;
    case FaultStrikes::kController:
      if (record.index >= 0) fault.joint = about.controllers.name(index);
      break;
    case FaultStrikes::kRobot: break;
  }
}

}  // namespace

FaultReport in_words(const FaultRecord& record, std::int64_t cleared_ns,
                     const FaultContext& about) {
  FaultReport fault;
  fault.cycle = record.cycle;
  fault.time_s = static_cast<double>(record.time_ns) * 1e-9;
  fault.cause = record.cause;
  fault.category = record.category;
  fault.latched = cleared_ns == FaultLog::kLatched;
  fault.cleared_s = fault.latched ? 0.0 : static_cast<double>(cleared_ns) * 1e-9;
  fault.text = text_of(record, about);
  fault.controller = name_of(record, about);
  name_it(record, about, fault);
  return fault;
}

}  // namespace tandem::runtime
