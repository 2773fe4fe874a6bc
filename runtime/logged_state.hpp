// States of a run in its log, and how another run goes on from one of them.
// Layer: runtime.  Thread: any, non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "log/info.hpp"
#include "log/recorder.hpp"
#include "runtime/checkpoints.hpp"

namespace tandem::runtime {

/// Attaches a state to a run's log, for beginning_at(). Not RT.
void log_state(log::Recorder& recorder, const Checkpoint& one, std::int64_t period_ns);

/// "runs/coman-squat-001.mcap@12.3s": a moment of a log, on its own time.
struct LogMoment {
  std::string log;
  double time_s = 0.0;

  /// Errors: there is no @, no time behind it.
  [[nodiscard]] static Result<LogMoment> read(const std::string& text);
};

/// How a run begins that goes on from a log.
struct Beginning {
  Checkpoint from;          ///< the last state of before the moment
  std::uint64_t next = 0;   ///< the cycle that comes first
  std::uint64_t asked = 0;  ///< for; not `next` where what came from outside cannot be played again
  log::Branch branch{};     ///< for the new log
};

/// Errors: LogFile::open()'s; the moment is before or after what the log has; it holds no state;
/// one is damaged.
[[nodiscard]] Result<Beginning> beginning_at(const LogMoment& moment);

}  // namespace tandem::runtime
