// Kinds, texts and CDR encoding of /tandem/event.
#include "log/event.hpp"

#include <cstdio>

#include "base/realtime.hpp"
#include "hal/fault_kind.hpp"
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
  }
  return "?";
}

std::string describe(const Event& event, std::span<const std::string> joints) {
  std::string text = to_string(event.kind);
  if (event.kind == EventKind::kInjected) {
    text += " " + std::string(hal::to_string(static_cast<hal::FaultKind>(event.code)));
  }
  const bool has_joint = event.joint >= 0 && static_cast<std::size_t>(event.joint) < joints.size();
  if (has_joint) text += " of " + joints[static_cast<std::size_t>(event.joint)];
  if (event.kind == EventKind::kEmergencyStop) {
    return text + (event.code == 1   ? " by a signal"
                   : event.code == 3 ? " by the watchdog"
                                     : " on request");
  }
  if (event.code == 0 || event.kind == EventKind::kInjected) return text;
  char code[32];
  if (event.kind == EventKind::kOverrun) {
    std::snprintf(code, sizeof code, ": %u cycles skipped", event.code);
  } else if (event.kind == EventKind::kFault && !has_joint) {
    std::snprintf(code, sizeof code, ": %s", tandem::to_string(static_cast<Code>(event.code)));
  } else {
    std::snprintf(code, sizeof code, " (0x%04X)", event.code);
  }
  return text + code;
}

const std::string& event_schema() {
  static const std::string text =
      "uint64 cycle\n"
      "int64 time_ns\n"
      "uint32 code  # a drive's CiA 402 error code, the loop's Code, or a count\n"
      "int32 joint  # index in the image, -1: none\n"
      "uint8 kind  # EventKind\n"
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
  in.take(3);
  found.text = in.text();
  if (!in.ok() || found.text.empty()) return fail("an event's message is too short");
  found.text.pop_back();  // CDR strings end with a zero
  return found;
}

}  // namespace tandem::log
