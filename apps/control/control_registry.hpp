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

#include "apps/control/command_rows.hpp"
#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// In whose turn a question is answered. Each transport has a thread for each.
enum class ControlTurn : std::uint8_t {
  kUrgent,    ///< a stop or an end: at once
  kOrdinary,  ///< one after another
  kLong,      ///< what takes its time and nothing waits for: predictions
};
inline constexpr std::size_t kControlTurns = 3;

/// Longest question [bytes]; longest that is looked at before its turn, and so can be urgent;
/// longest of who is not known, who may only look and stop.
inline constexpr std::size_t kMaxQuestion = 256 * 1024;
inline constexpr std::size_t kMaxUrgentQuestion = 1024;
inline constexpr std::size_t kMaxStrangersQuestion = 4096;

/// How long an emergency stop waits for its answer: who asks has to know soon that nothing stops
/// the robot. More than the longest time in which a run looks for the loop's confirmation.
inline constexpr std::chrono::milliseconds kStopAnswer{3000};

/// A question is a JSON object, {"do": "estop", "category": 0}. Its answer is one, too:
/// {"ok": true, …} with what the command found, or {"ok": false, "error": …, "hint": …}.
class ControlRegistry {
 public:
  /// Gets a request whose keys are known, there when required, and of the right type.
  /// @return an object: its keys follow "ok" in the answer.
  using Handler = std::function<Result<Json>(const Json& request)>;
  /// The same, which wants to know Asked::after_stop.
  using AskedHandler = std::function<Result<Json>(const Json& request, std::uint64_t after_stop)>;
  /// Says whether a command may be asked for; the error is the answer otherwise.
  using Gate =
      std::function<Status(const std::string& command, ControlEffect effect, const Json& request)>;
  /// Who asks, and when.
  struct Asked {
    std::uint64_t after_stop = 0;  ///< last_stop() when the question came
    bool known = true;  ///< else kMaxStrangersQuestion, and nobody looks for what was meant
    Gate gate = {};     ///< empty: everything may be asked for
    /// Called while another handler works, by the thread that one may wait for; empty: it blocks.
    std::function<void()> meanwhile = {};
  };

  /// The command "help" is there from the start: it lists the others.
  ControlRegistry();
  ControlRegistry(const ControlRegistry&) = delete;
  ControlRegistry& operator=(const ControlRegistry&) = delete;

  /// One handler runs at a time, except those that stop or end: they wait for no other, so they
  /// have to be safe beside them, and a stop holds up who carries it until the loop has confirmed.
  /// @pre its name is new
  void add(CommandRow row, Handler handler);
  void add(CommandRow row, AskedHandler handler);
  /// The command `name` of command_rows(): a row there, its function here. @pre the row is there
  void add(std::string_view name, Handler handler) { add(*command_row(name), std::move(handler)); }
  /// Who counts the stops of the robot: what changes something and was asked before one is refused.
  void stops_by(std::function<std::uint64_t()> last_stop) { last_stop_ = std::move(last_stop); }
  [[nodiscard]] std::uint64_t last_stop() const { return last_stop_ ? last_stop_() : 0; }

  /// `told` gets each command that does more than read, and its answer; on any thread. One
  /// listener, which is set before anything is asked.
  void tell(std::function<void(const std::string& question, const Json& answer)> told) {
    told_ = std::move(told);
  }

  /// What the command `name` does; empty when there is none.
  [[nodiscard]] std::optional<ControlEffect> effect(std::string_view name) const;

  /// The answer to `question`, a JSON text. Answered as errors: what is longer than
  /// kMaxQuestion, or no JSON object, a key twice, an unknown command or key (with the nearest), a
  /// missing key, a wrong type, a stop that came after it, and whatever a handler says or throws.
  [[nodiscard]] Json answer(std::string_view question, const Asked& asked) const;
  /// The same, asked now.
  [[nodiscard]] Json answer(std::string_view question, const Gate& gate = {}) const {
    return answer(question, {.after_stop = last_stop(), .gate = gate});
  }
  /// What `question` asks for, as far as that is known before its turn: empty when it is longer
  /// than kMaxUrgentQuestion, or names no command. No more is parsed than that.
  [[nodiscard]] std::optional<ControlEffect> effect_of(std::string_view question) const;
  [[nodiscard]] ControlTurn turn_of(std::string_view question) const;

 private:
  struct Command : CommandRow {
    AskedHandler handler;
  };
  [[nodiscard]] Result<Json> run(const Json& request, const Asked& asked) const;
  [[nodiscard]] const Command* named(std::string_view question) const;
  [[nodiscard]] Result<const Command*> find(const Json& request, bool known) const;
  [[nodiscard]] Status check_stops(const Command& command, const Asked& asked) const;
  [[nodiscard]] Json help() const;

  std::vector<Command> commands_;
  std::function<std::uint64_t()> last_stop_;
  std::function<void(const std::string&, const Json&)> told_;
  mutable std::mutex working_, working_long_;
};

}  // namespace tandem::apps
