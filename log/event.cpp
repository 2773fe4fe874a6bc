// Kinds, texts and CDR encoding of /tandem/event.
#include "log/event.hpp"

#include <cstdio>
#include <iterator>
#include <numbers>
#include <string>

#include "base/realtime.hpp"
#include "hal/homing.hpp"
#include "log/cdr_writer.hpp"

namespace tandem::log {

const char* to_string(EventKind kind) noexcept {
  switch (kind) {
    case EventKind::kStarted: return "started";
    case EventKind::kBringUpDone: return "bring-up done";
    case EventKind::kControllersDone: return "controllers done";
    case EventKind::kFault: return "fault";
    case EventKind::kSensorLost: return "sensor lost";
    case EventKind::kLimited: return "command limited";
    case EventKind::kOverrun: return "overrun";
    case EventKind::kStopRequested: return "stop requested";
    case EventKind::kShutDown: return "shut down";
    case EventKind::kInjected: return "injected";
    case EventKind::kEmergencyStop: return "emergency stop";
    case EventKind::kResetRequested: return "reset requested";
    case EventKind::kResetDone: return "reset done";
    case EventKind::kResetFailed: return "reset failed";
    case EventKind::kControllersSwitched: return "controllers switched";
    case EventKind::kJointSet: return "mode or impedance set";
    case EventKind::kGainsSet: return "gains set";
    case EventKind::kFeedbackLost: return "fault: no feedback";
    case EventKind::kUnclaimed: return "fault: unclaimed write";
    case EventKind::kBringUpFailed: return "fault: the drives were not enabled in time";
    case EventKind::kTooLate: return "fault: too many late cycles";
    case EventKind::kOwnerLost: return "fault: the remote owner is gone, or late";
    case EventKind::kFell: return "fault: the robot fell";
    case EventKind::kMotionRequested: return "motion requested";
    case EventKind::kMotionStopped: return "motion stopped";
    case EventKind::kRecoveryRequested: return "recovery requested";
    case EventKind::kCollision: return "fault: collision";
    case EventKind::kGap: return "gap in the recording";
    case EventKind::kHomingRequested: return "homing requested";
    case EventKind::kHomed: return "homed";
    case EventKind::kHomingFailed: return "homing failed";
    case EventKind::kLinkLost: return "link lost";
    case EventKind::kLinkBack: return "link back";
  }
  return "?";
}

bool is_fault(EventKind kind) noexcept {
  return kind == EventKind::kFault || kind == EventKind::kEmergencyStop ||
         kind == EventKind::kCollision ||
         (kind >= EventKind::kFeedbackLost && kind <= EventKind::kFell);
}

bool is_stop(const Event& event) noexcept { return is_fault(event.kind) && event.reported == 0; }

namespace {

/// `before` and the name at `index`; empty where there is none.
std::string named(const char* before, const std::vector<std::string>& names, double index) {
  if (!(index >= 0.0) || index >= static_cast<double>(names.size())) return "";
  return before + names[static_cast<std::size_t>(index)];
}

/// " of knee", " of board leg_1"; empty where the event names nobody.
std::string whose(const Event& event, const EventNames& names) {
  if (event.kind == EventKind::kSensorLost) return named(": ", names.sensors, event.value);
  switch (event.target) {
    case hal::FaultTarget::kBoard: return named(" of board ", names.boards, event.value);
    case hal::FaultTarget::kSensor: return named(" of sensor ", names.sensors, event.value);
    case hal::FaultTarget::kBus: return named(" of bus ", names.buses, event.value);
    default: return named(" of ", names.joints, event.joint);
  }
}

/// ": to 0.5 rad (28.65 deg)", ": to 0.02 m".
std::string target_text(const Event& event) {
  char text[64];
  const double target = event.value;
  if (event.code == 1) {
    std::snprintf(text, sizeof text, ": to %.4g m", target);
  } else {
    std::snprintf(text, sizeof text, ": to %.4g rad (%.4g deg)", target,
                  target * 180.0 / std::numbers::pi);
  }
  return text;
}

/// What follows the name of an event whose code is not 0: the code in words, or as a number.
std::string text_of(const Event& event, bool has_joint) {
  switch (event.kind) {
    case EventKind::kOverrun: return ": " + std::to_string(event.code) + " cycles skipped";
    case EventKind::kGap: return ": " + std::to_string(event.code) + " cycles missing";
    case EventKind::kSensorLost:
    case EventKind::kFeedbackLost: return " for " + std::to_string(event.code) + " cycles";
    case EventKind::kInjected:
    case EventKind::kUnclaimed:
    case EventKind::kBringUpFailed:
    case EventKind::kTooLate:
    case EventKind::kOwnerLost: return "";
    case EventKind::kLinkLost:
      return event.code == 1 ? ": the robot follows no command" : ": no state comes";
    case EventKind::kCollision: {
      const bool force = !has_joint && event.value >= -3.0F;  // -1 to -6: of the base
      char torque[64];
      std::snprintf(torque, sizeof torque, "%s: an external %s of %.3g %s",
                    has_joint ? "" : " of the base", force ? "force" : "torque", 1e-3 * event.code,
                    force ? "N" : "Nm");
      return torque;
    }
    case EventKind::kHomingFailed:
      return std::string(": ") + hal::to_string(static_cast<hal::HomingError>(event.code));
    case EventKind::kFell: {
      constexpr const char* kHow[] = {"",
                                      ": its base is tilted",
                                      ": its base is low",
                                      ": its base is high",
                                      ": no foot touches the ground",
                                      ": a foot is below the ground"};
      return event.code < std::size(kHow) ? kHow[event.code] : "";
    }
    case EventKind::kLimited:
      return event.code == static_cast<std::uint32_t>(Code::kNotFinite) ? ": it was not finite"
                                                                        : ": it was out of range";
    case EventKind::kFault:
      if (!has_joint) {
        return std::string(": ") + tandem::to_string(static_cast<Code>(event.code));
      }
      [[fallthrough]];
    default: break;
  }
  char code[16];
  std::snprintf(code, sizeof code, " (0x%04X)", event.code);
  return code;
}

std::string what_happened(const Event& event, const EventNames& names) {
  std::string text = to_string(event.kind);
  if (event.kind == EventKind::kInjected) {
    text += " " + std::string(hal::to_string(static_cast<hal::FaultKind>(event.code)));
  }
  text += whose(event, names);
  const bool has_joint =
      event.joint >= 0 && static_cast<std::size_t>(event.joint) < names.joints.size();
  if (event.kind == EventKind::kEmergencyStop) {
    return text + (event.code == 1   ? " by a signal"
                   : event.code == 3 ? " by the watchdog"
                                     : " on request");
  }
  if (event.kind == EventKind::kMotionRequested) return text + target_text(event);
  if (event.code == 0) return text;
  return text + text_of(event, has_joint);
}

}  // namespace

std::string describe(const Event& event, const EventNames& names) {
  return what_happened(event, names) + (event.reported != 0 ? ", reported" : "");
}

const std::string& event_schema() {
  static const std::string text =
      "uint64 cycle\n"
      "int64 time_ns\n"
      "uint32 code  # a drive's CiA 402 error code, the loop's Code, a count, a unit\n"
      "int32 joint  # index in the image, -1: none\n"
      "uint8 kind  # EventKind\n"
      "uint8 reported  # 1: a fault that stops nothing\n"
      "string text\n";
  return text;
}

void encode_event(const Event& event, std::string_view text, Bytes& out) {
  CdrWriter cdr(out);
  cdr.number(event.cycle);
  cdr.number(static_cast<std::uint64_t>(event.time_ns));
  cdr.number(event.code);
  cdr.number(static_cast<std::uint32_t>(event.joint));
  cdr.number(static_cast<std::uint8_t>(event.kind));
  cdr.number(event.reported);
  cdr.text(text);
}

Result<EventText> decode_event(std::span<const std::byte> body) {
  ByteReader in(body);
  EventText found;
  found.event.cycle = in.number<std::uint64_t>();
  found.event.time_ns = static_cast<std::int64_t>(in.number<std::uint64_t>());
  found.event.code = in.number<std::uint32_t>();
  found.event.joint = static_cast<std::int32_t>(in.number<std::uint32_t>());
  found.event.kind = static_cast<EventKind>(in.number<std::uint8_t>());
  found.event.reported = in.number<std::uint8_t>();  // 0, too, in logs without this field
  in.take(2);
  found.text = in.text();
  if (!in.ok() || found.text.empty()) return fail("an event's message is too short");
  found.text.pop_back();  // CDR strings end with a zero
  return found;
}

}  // namespace tandem::log
