// Kinds, texts and CDR encoding of /tandem/event.
#include "log/event.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <iterator>
#include <limits>
#include <numbers>
#include <string>

#include "base/realtime.hpp"
#include "log/cdr_writer.hpp"

namespace tandem::log {

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
    default: break;
  }
  const bool carries = event.kind == EventKind::kPickedUp || event.kind == EventKind::kDropped;
  return carries ? "" : named(" of ", names.joints, event.joint);
}

// What a text says of an event's code and value: the column `detail` of the table.

/// ": to 0.5 rad (28.65 deg)", ": to 0.02 m".
std::string target(const Event& event, const EventNames&) {
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

std::string nothing(const Event&, const EventNames&) { return ""; }

std::string given_up(const Event& event, const EventNames&) {
  static constexpr const char* kWhy[] = {
      "",
      ": the shadow did not agree in time",
      ": a joint is another's by now",
      ": that was asked for",
      ": one to start is no shadow any more",
      ": one to stop is not active any more",
  };
  return kWhy[event.code < std::size(kWhy) ? event.code : 0];
}

std::string afresh(const Event&, const EventNames&) { return ": it starts afresh"; }

std::string hex_code(const Event& event, const EventNames&) {
  char code[16];
  std::snprintf(code, sizeof code, " (0x%04X)", event.code);
  return code;
}

std::string cycles_skipped(const Event& event, const EventNames&) {
  return ": " + std::to_string(event.code) + " cycles skipped";
}

std::string cycles_missing(const Event& event, const EventNames&) {
  return ": " + std::to_string(event.code) + " cycles missing";
}

std::string for_cycles(const Event& event, const EventNames&) {
  return " for " + std::to_string(event.code) + " cycles";
}

std::string cause(const Event& event, const EventNames&) {
  const hal::CauseRow row = hal::row_of(cause_of(event.kind, event.code));
  const char* const why = *row.brief != 0 ? row.brief : row.words;
  if (*why == 0) return "";
  return (event.kind == EventKind::kEmergencyStop ? " " : ": ") + std::string(why);
}

std::string limited(const Event& event, const EventNames&) {
  switch (static_cast<Code>(event.code)) {
    case Code::kOk: return ": it is followed as fast as the joint's limits allow";
    case Code::kNotFinite: return ": it was not finite";
    default: return ": it was out of range";
  }
}

std::string payload(const Event& event, const EventNames& names) {
  const std::string what = names.payload ? names.payload(event.code) : "";
  if (event.kind == EventKind::kPickedUp || what.empty()) return what.empty() ? "" : ": " + what;
  return ": " + what.substr(0, what.rfind(", "));  // its name, which says enough then
}

bool has_joint(const Event& event, const EventNames& names) {
  return event.joint >= 0 && static_cast<std::size_t>(event.joint) < names.joints.size();
}

std::string fault_code(const Event& event, const EventNames& names) {
  if (has_joint(event, names)) return hex_code(event, names);
  return std::string(": ") + tandem::to_string(static_cast<Code>(event.code));
}

std::string collision(const Event& event, const EventNames& names) {
  const bool of_joint = has_joint(event, names);
  const bool force = !of_joint && event.value >= -3.0F;  // -1 to -6: of the base
  char torque[64];
  std::snprintf(torque, sizeof torque, "%s: an external %s of %.3g %s",
                of_joint ? "" : " of the base", force ? "force" : "torque", 1e-3 * event.code,
                force ? "N" : "Nm");
  return torque;
}

struct EventRow {
  enum Role : std::uint8_t { note, fault } role;
  const char* words;
  std::string (*detail)(const Event&, const EventNames&);
};
constexpr EventRow kRows[] = {
#define TANDEM_EVENT(name, role, words, detail, meaning) {EventRow::role, words, detail},
#include "log/event_kinds.inc"
#undef TANDEM_EVENT
};

/// Null of a kind that a file of another program has.
const EventRow* row_of(EventKind kind) {
  const auto index = static_cast<std::size_t>(kind);
  return index < std::size(kRows) ? &kRows[index] : nullptr;
}

std::string what_happened(const Event& event, const EventNames& names, const hal::LimitMet& met) {
  std::string text = to_string(event.kind);
  if (event.kind == EventKind::kInjected || event.kind == EventKind::kEnded) {
    const auto kind = static_cast<hal::FaultKind>(event.code);
    text += " " + std::string(hal::to_string(kind));
    if (kind == hal::FaultKind::kPush && event.value >= 1.0F) {
      const auto number = static_cast<std::uint32_t>(event.value);
      text += " '" + (names.push ? names.push(number) : std::to_string(number)) + "'";
    }
  }
  text += whose(event, names);
  if (met.kind != hal::LimitKind::kNone) return text + ": " + hal::in_words(met);
  const EventRow* row = row_of(event.kind);
  if (row == nullptr) return text;
  // A motion's 0 is a unit, and that of a limit its speed.
  const bool tells = event.code != 0 || row->detail == target || row->detail == limited;
  return tells ? text + row->detail(event, names) : text;
}

}  // namespace

const char* to_string(EventKind kind) noexcept {
  const EventRow* row = row_of(kind);
  return row == nullptr ? "?" : row->words;
}

EventKind event_of(hal::FaultCause cause) noexcept TANDEM_RT {
  static constexpr EventKind kEvents[] = {
#define TANDEM_FAULT_CAUSE(name, strikes, category, event, number, brief, words, advice) \
  EventKind::event,
#include "hal/fault_causes.inc"
#undef TANDEM_FAULT_CAUSE
  };
  const auto row = static_cast<std::size_t>(cause);  // bytes of a snapshot are anybody's
  return row < std::size(kEvents) ? kEvents[row] : EventKind::kFault;
}

hal::FaultCause cause_of(EventKind kind, std::uint32_t number) noexcept {
  for (std::size_t i = 0; i < std::size(hal::kCauseRows); ++i) {
    const auto cause = static_cast<hal::FaultCause>(i);
    if (event_of(cause) == kind && hal::kCauseRows[i].number == number) return cause;
  }
  return hal::FaultCause::kNone;
}

bool is_fault(EventKind kind) noexcept {
  const EventRow* row = row_of(kind);
  return row != nullptr && row->role == EventRow::fault;
}

bool is_stop(const Event& event) noexcept { return is_fault(event.kind) && event.reported == 0; }

std::string describe(const Event& event, const EventNames& names, const hal::LimitMet& met) {
  std::string who;
  if (event.controller != 0 && names.controller)
    who = ", controller '" + names.controller(event.controller - 1U) + "'";
  return what_happened(event, names, met) + who + (event.reported != 0 ? ", reported" : "");
}

std::string describe(const ParameterSet& set) {
  const std::size_t letters = std::min<std::size_t>(set.letters, set.name.size());
  const std::string named = ": " + std::string(set.name.data(), letters) + " = ";
  const std::size_t word = std::min<std::size_t>(set.word_letters, set.word.size());
  if (word > 0) return named + std::string(set.word.data(), word);
  std::array<char, 32> number{};
  const auto end = std::to_chars(number.data(), number.data() + number.size(), set.value).ptr;
  return named + std::string(number.data(), end);
}

std::optional<ParameterText> parameter_of(const std::string& event_text) {
  const std::size_t begin = event_text.find(": ") + 2, equals = event_text.rfind(" = ");
  const bool is_one = std::ranges::any_of(
      std::array{EventKind::kParameterSet, EventKind::kParameterLoaded},
      [&](EventKind kind) { return event_text.starts_with(std::string(to_string(kind)) + ": "); });
  if (!is_one || equals == std::string::npos || equals < begin) return std::nullopt;
  ParameterText found{.name = event_text.substr(begin, equals - begin)};
  const char *first = event_text.data() + equals + 3, *last = event_text.data() + event_text.size();
  const auto [end, error] = std::from_chars(first, last, found.value);
  if (error == std::errc() && end == last) return found;
  found.value = std::numeric_limits<double>::quiet_NaN();
  found.word = event_text.substr(equals + 3);
  return found.word.empty() ? std::nullopt : std::optional(found);
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
