// What happened once in a run, as the log's channel /tandem/event carries it.
// Layer: log.  Thread: made on the RT thread (plain data); encoded off it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/fault_kind.hpp"
#include "hal/limit_met.hpp"
#include "hal/stop_category.hpp"
#include "log/bytes.hpp"

namespace tandem::log {

/// A row each in log/event_kinds.inc.
enum class EventKind : std::uint8_t {
#define TANDEM_EVENT(name, role, words, detail, meaning) name,
#include "log/event_kinds.inc"
#undef TANDEM_EVENT
};
[[nodiscard]] const char* to_string(EventKind kind) noexcept;
/// The event of a cause of faults.
[[nodiscard]] EventKind event_of(hal::FaultCause cause) noexcept TANDEM_RT;
/// The cause that has `number` among those of `kind`; kNone: there is none.
[[nodiscard]] hal::FaultCause cause_of(EventKind kind, std::uint32_t number) noexcept;
/// Whether it is a fault, of whatever, or an emergency stop.
[[nodiscard]] bool is_fault(EventKind kind) noexcept;
struct Event;
/// Whether it is a fault that stops the robot.
[[nodiscard]] bool is_stop(const Event& event) noexcept;

/// Plain data: it crosses the ring as bytes.
struct Event {
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  std::uint32_t code = 0;   ///< the drive's error code, a Code, a count: as the kind says
  std::int32_t joint = -1;  ///< index in the image; -1: none
  EventKind kind = EventKind::kStarted;
  hal::FaultTarget target = hal::FaultTarget::kNone;  ///< of an injected fault
  std::uint8_t reported = 0;                          ///< 1: a fault that stops nothing
  std::uint8_t controller = 0;  ///< whose doing it is: 1 and its number; 0: nobody's
  /// Target of a motion; index of a lost sensor, and of an injected fault's board, sensor or bus.
  /// The log's text has it.
  float value = 0.0F;
};
static_assert(std::is_trivially_copyable_v<Event> && sizeof(Event) == 32);

/// Whose events they are, in the order of the robot's configuration.
struct EventNames {
  std::vector<std::string> joints;
  std::vector<std::string> boards{};
  std::vector<std::string> sensors{};
  std::vector<std::string> buses{};
  std::function<std::string(std::size_t)> controller{};  ///< by number; any thread's
  /// "box, 1.6 kg on panda_hand" by the event's code; any thread's.
  std::function<std::string(std::uint32_t)> payload{};
  std::function<std::string(std::uint32_t)> push{};  ///< by its row in the experiment, from 1
};

/// A controller's parameter that was set, or came with it.
struct ParameterSet {
  static constexpr std::size_t kLongestName = 200, kLongestWord = 96;

  double value = 0.0;
  std::uint32_t letters = 0;              ///< of the name, as far as it has room
  std::uint32_t word_letters = 0;         ///< of the word; 0: the value is a number
  std::array<char, kLongestName> name{};  ///< "squat.link_damping_Nms_rad"
  std::array<char, kLongestWord> word{};  ///< of a choice or a boolean
};
/// ": squat.link_damping_Nms_rad = 12.5": the shortest number that reads as the same double; of a
/// choice its word, of a boolean true or false.
[[nodiscard]] std::string describe(const ParameterSet& set);
/// What the text of an event of the kinds kParameterSet and kParameterLoaded says, bit for bit;
/// empty: it is none.
struct ParameterText {
  std::string name;
  double value = 0.0;  ///< NaN: it is a word
  std::string word{};
};
[[nodiscard]] std::optional<ParameterText> parameter_of(const std::string& event_text);

/// One line for people: "fault of LHipMot (0x7310)".
/// @param met  the command that it is about, of kLimited and of a fault by a command
[[nodiscard]] std::string describe(const Event& event, const EventNames& names,
                                   const hal::LimitMet& met = {});

/// The channel's ros2msg definition.
[[nodiscard]] const std::string& event_schema();

/// Makes `out` the event's CDR body (without header), its text last.
void encode_event(const Event& event, std::string_view text, Bytes& out);

/// An event read back.
struct EventText {
  Event event;
  std::string text;
};
[[nodiscard]] Result<EventText> decode_event(std::span<const std::byte> body);

}  // namespace tandem::log
