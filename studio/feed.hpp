// What a run tells the studio beside its images, and how the studio asks it: functions of the run's
// own, so that the studio knows neither a loop nor a registry.
// Layer: studio.  Thread: called on the studio's, unless it says otherwise.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hal/mark_block.hpp"
#include "hal/parallel_source.hpp"
#include "hal/signal_block.hpp"
#include "studio/http_rules.hpp"
#include "studio/tap.hpp"

namespace tandem::studio {

/// Something that happened: a line on the time axis.
struct Event {
  enum class Level : std::uint8_t { kInfo, kWarn, kError };

  double time_s = 0.0;
  std::uint64_t cycle = 0;
  Level level = Level::kInfo;
  std::string who;  ///< controller or joint; empty: the run
  std::string text;

  /// Whether it is a command that somebody asked for.
  [[nodiscard]] bool is_request() const { return who.empty() && text.starts_with(kRequest); }
  static constexpr std::string_view kRequest = "request ";
};

/// What happens in a run.
struct Feed {
  using Signals = std::pair<std::string, std::shared_ptr<const hal::SignalBlock>>;

  using Marks = std::pair<std::string, std::shared_ptr<const hal::MarkBlock>>;

  std::function<std::uint64_t()> loads{};             ///< another number: controllers came or went
  std::function<std::vector<Signals>()> signals{};    ///< of every loaded controller, by its name
  std::function<std::vector<Marks>()> marks{};        ///< of those that have some
  std::function<void(std::vector<Event>&)> events{};  ///< appends what has happened since
  std::function<bool()> time_stands{};                ///< simulated time is paused
  std::function<void(const Tap::Cycle&)> cycle{};     ///< gets every cycle of the tap
  hal::ParallelSource* parallel = nullptr;            ///< null: there is none
  std::vector<Served> served{};                       ///< beside the page
};

/// Who asks, as far as the rules go.
struct Rights {
  bool token = false;    ///< knows the run's token
  bool control = false;  ///< has taken control of the joints
};

/// A question to the run: a JSON object, as docs/json.md has them.
struct Question {
  std::uint64_t asker = 0;  ///< a client's number; 0: the studio itself
  std::int64_t number = 0;  ///< for the answer
  std::string text;
  Rights rights;
};

struct Answer {
  std::uint64_t asker = 0;
  std::int64_t number = 0;
  std::string text;  ///< JSON, in a line
};

/// The run's registry of commands.
struct Asker {
  /// Does not wait. What `rights` do not allow is answered so.
  std::function<void(Question)> ask{};
  /// Drops what `asker` has asked for and has not begun, but stops and ends.
  std::function<void(std::uint64_t asker)> drop{};
  std::function<std::vector<Answer>()> take{};
  /// Whether `question` stops the robot, or ends the run.
  std::function<bool(const std::string& question)> is_urgent{};
  /// Whether `command` reads at once, and needs no more than its name.
  std::function<bool(const std::string& command)> only_reads{};
};

}  // namespace tandem::studio
