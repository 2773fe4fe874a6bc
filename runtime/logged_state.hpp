// States of a run in its log, and how another run goes on from one of them.
// Layer: runtime.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.hpp"
#include "log/attachments.hpp"
#include "log/info.hpp"
#include "log/recorder.hpp"
#include "runtime/checkpoints.hpp"
#include "runtime/time_machine.hpp"

namespace tandem::runtime {

/// Attaches states, and the cycles that cannot be played again, to a run's log, which outlives what
/// is returned; for beginning_at(). Not RT.
[[nodiscard]] TimeMachine::StateLog states_to(log::Recorder& recorder, std::int64_t period_ns);

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
  log::RunInfo info{};      ///< of the other one
};

/// Errors: LogFile::open()'s; the moment is before or after what the log has; it holds no state;
/// one is damaged.
[[nodiscard]] Result<Beginning> beginning_at(const LogMoment& moment);

}  // namespace tandem::runtime
