// Every command to a running process: its name, what it does, its arguments. A row here and a
// function that answers it (ControlRegistry::add()) are a new command: the socket, DDS, the command
// line with its help, and docs/json.md's list follow.
// Layer: apps/control.  Thread: any; plain data.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// What a command does to the process that is asked, which decides who may ask for it.
enum class ControlEffect : std::uint8_t {
  kReads,    ///< nothing
  kChanges,  ///< something: not for everybody over a network
  kEnds,     ///< it ends the process' work in order: the same, but it waits for no other
  kStops,    ///< it takes the robot to a stop, which everybody may always
};

[[nodiscard]] const char* to_string(ControlEffect effect);
/// Whether not everybody over a network may ask for it.
[[nodiscard]] constexpr bool is_guarded(ControlEffect effect) {
  return effect == ControlEffect::kChanges || effect == ControlEffect::kEnds;
}

/// A key of a command's request, beside "do", and an argument of its command line.
struct ControlKey {
  enum class Type : std::uint8_t {
    kText,
    kInteger,
    kNumber,
    kBoolean,
    kObject,
    kTexts,         ///< a list of texts
    kNumbers,       ///< a list of numbers
    kTextOrObject,  ///< TOML, or the same as an object
  };
  /// Unit that a number may have on the command line, which gives SI units; beside it, the request
  /// then has "unit": "angle" or "length", but of a time.
  enum class Unit : std::uint8_t { kNone, kPlace, kSpeed, kAcceleration, kTime };

  std::string name;
  Type type = Type::kText;
  bool required = false;
  std::string doc;  ///< one line, with unit and range
  /// "--to", or "joint" for an argument without a flag; empty: only in a request.
  std::string line{};
  bool sent = true;  ///< false: for the command line alone, it is no key of a request
  Unit unit = Unit::kNone;
  std::vector<std::string> choices{};  ///< texts that it may be; empty: any
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool or_zero = false;  ///< 0 is fine, too
};

struct CommandRow {
  std::string name;  ///< "joint.move": `tandem joint move` on the command line
  ControlEffect effect = ControlEffect::kReads;
  std::string doc;  ///< one line
  std::vector<ControlKey> keys{};
  struct More {
    bool takes_long = false;   ///< no other command waits for it, but itself
    bool on_line = true;       ///< false: only by `tandem ask`
    bool any_process = false;  ///< not only a run is asked
    bool of_group = false;     ///< `tandem input NAME`: its line is the group's, without a verb
    /// What is asked instead: the command line has two forms of one question. Empty: its name.
    std::string asks{};
    /// An [[event]] may ask for it: it ends within the cycle in which it is asked.
    bool by_event = false;
    int answer_s = 5;  ///< how long a client waits for the answer
  } more{};
};

[[nodiscard]] const std::vector<CommandRow>& command_rows();
/// The row of that name; null: there is none.
[[nodiscard]] const CommandRow* command_row(std::string_view name);

/// Whether a value of a key is of its type, one of its choices, and in its range. The error lacks a
/// subject: `is not of type text`.
[[nodiscard]] Status check_value(const ControlKey& key, const Json& value);

/// Whether `request` is one of a command's: its keys are known, there when required, and of the
/// right type. @param suggests  for nobody else it is looked what may be meant
[[nodiscard]] Status check_keys(const CommandRow& row, const Json& request, bool suggests = true);

/// Whether an [[event]] may ask for it: the command is there, may be asked so, and check_keys().
[[nodiscard]] Status check_event(const Json& request);

/// "integer, optional: 1 to 3".
[[nodiscard]] std::string words_of(const ControlKey& key);

}  // namespace tandem::apps
