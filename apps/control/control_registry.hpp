// What a running process can be asked for: commands by name, whatever carries them to it.
// Layer: apps/control.  Thread: filled before it is served; then any, one thing at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
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
  kStops,    ///< it takes the robot to a stop, which everybody may always
};

[[nodiscard]] const char* to_string(ControlEffect effect);

/// Longest question [bytes].
inline constexpr std::size_t kMaxQuestion = 256 * 1024;

/// How long an emergency stop waits for its answer: who asks has to know soon that nothing stops
/// the robot. More than the longest time in which a run looks for the loop's confirmation.
inline constexpr std::chrono::milliseconds kStopAnswer{3000};
/// A key of a command's request, beside "do".
struct ControlKey {
  enum class Type : std::uint8_t {
    kText,
    kInteger,
    kNumber,
    kBoolean,
    kObject,
    kTexts,         ///< a list of texts
    kTextOrObject,  ///< TOML, or the same as an object
  };

  std::string name;
  Type type = Type::kText;
  bool required = false;
  std::string doc;  ///< one line, with unit and range
};

/// A question is a JSON object, {"do": "estop", "category": 0}. Its answer is one, too:
/// {"ok": true, …} with what the command found, or {"ok": false, "error": …, "hint": …}.
class ControlRegistry {
 public:
  /// Gets a request whose keys are known, there when required, and of the right type.
  /// @return an object: its keys follow "ok" in the answer.
  using Handler = std::function<Result<Json>(const Json& request)>;
  /// Says whether a command may be asked for; the error is the answer otherwise.
  using Gate =
      std::function<Status(const std::string& command, ControlEffect effect, const Json& request)>;

  /// The command "help" is there from the start: it lists the others.
  ControlRegistry();
  ControlRegistry(const ControlRegistry&) = delete;
  ControlRegistry& operator=(const ControlRegistry&) = delete;

  /// One handler runs at a time, except those that stop the robot: they wait for no other, so they
  /// have to be safe beside them, and they hold up who carries them until the loop has confirmed.
  /// @param doc  one line, for "help".  @pre `name` is new
  void add(std::string name, ControlEffect effect, std::string doc, std::vector<ControlKey> keys,
           Handler handler);

  /// What the command `name` does; empty when there is none.
  [[nodiscard]] std::optional<ControlEffect> effect(std::string_view name) const;

  /// The answer to `question`, a JSON text. Answered as errors: what is longer than
  /// kMaxQuestion, or no JSON object, a key twice, an unknown command or key (with the nearest), a
  /// missing key, a wrong type, and whatever a handler says or throws.
  /// @param gate  of who asks; empty: everything may be asked for
  [[nodiscard]] Json answer(std::string_view question, const Gate& gate = {}) const;
  /// Whether `question` asks for a command that stops the robot.
  [[nodiscard]] bool stops(std::string_view question) const;

 private:
  struct Command {
    std::string name;
    ControlEffect effect;
    std::string doc;
    std::vector<ControlKey> keys;
    Handler handler;
  };
  [[nodiscard]] Result<Json> run(std::string_view question, const Gate& gate) const;
  [[nodiscard]] Result<const Command*> find(const Json& request) const;
  [[nodiscard]] Json help() const;

  std::vector<Command> commands_;
  mutable std::mutex working_;
};

}  // namespace tandem::apps
