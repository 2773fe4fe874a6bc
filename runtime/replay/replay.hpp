// A run played again from its log: the same cycle, controllers, limits and hand-overs on what was
// read then.
// Layer: runtime/replay.  Thread: main.
#pragma once

#include <cstdint>
#include <expected>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "runtime/replay/command_comparison.hpp"
#include "runtime/replay/recorded_run.hpp"
#include "runtime/robot_cycle.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

struct ReplayOptions {
  /// Libraries instead of the recorded ones, by the controllers' names.
  std::map<std::string, std::string> plugins{};
  std::string output{};                 ///< log of what it commands; empty: none
  std::optional<std::int64_t> to_ns{};  ///< the last cycle is not later
  KernelSupply kernels{};
  std::function<bool()> goes_on{};  ///< asked before each cycle; empty: it does
  /// Called before the first cycle, on the thread of replay(). What it returns lives as long as
  /// there are cycles.
  std::function<std::shared_ptr<void>(RobotCycle&, const Composition&)> guard{};
};

struct ReplayResult {
  std::uint64_t cycles = 0;    ///< that were played
  std::uint64_t compared = 0;  ///< of them: the log has their commands
  std::uint64_t differ = 0;    ///< of these
  std::int64_t end_ns = 0;     ///< of the last one
  std::optional<CommandDifference> first{};
  std::vector<CommandSpread> spreads{};
  /// Why it ends before the log does: what happened then is in no log; empty: it does not.
  std::string why_short{};
  std::vector<std::string> changed{};  ///< controllers that ran from another library by option
  Diagnostics notes{};                 ///< what is not as recorded
  double seconds = 0.0;                ///< of the cycles, on the wall clock
  std::string log{};                   ///< that was written; empty: none

  /// Every command of the log is the same, to its end.
  [[nodiscard]] bool equal() const { return !first && why_short.empty(); }
};

/// Plays the whole log. Errors: RecordedRun::open()'s; compose()'s; a robot in another process, a
/// controller that acts on predictions or was part of a program; a log that cannot be written.
[[nodiscard]] std::expected<ReplayResult, Diagnostics> replay(const std::string& log,
                                                              const ReplayOptions& options);

}  // namespace tandem::runtime
