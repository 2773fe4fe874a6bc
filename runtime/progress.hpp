// Where a run stands, for whoever watches it from another thread.
// Layer: runtime.  Thread: written by the loop, read by any.
#pragma once

#include <atomic>
#include <cstdint>

#include "hal/run_phase.hpp"

namespace tandem::runtime {

using hal::RunPhase;
using hal::to_string;

/// Each value is current by itself; together they may be of neighbouring cycles.
struct Progress {
  std::atomic<RunPhase> phase{RunPhase::kBringUp};
  std::atomic<std::uint64_t> cycles{0};          ///< done, all phases
  std::atomic<std::int64_t> time_ns{0};          ///< of the newest of them
  std::atomic<std::uint64_t> running_cycles{0};  ///< of the phase kRunning
  std::atomic<std::uint64_t> total_cycles{0};    ///< that kRunning will have; 0: until stopped
  std::atomic<std::uint64_t> overruns{0};
  std::atomic<std::uint64_t> dropped{0};  ///< messages the log lost
  std::atomic<std::uint64_t> latched{0};  ///< faults
  std::atomic<std::uint64_t> resets{0};   ///< that were carried out
  std::atomic<std::uint64_t> failed_resets{0};
  std::atomic<std::uint64_t> travels{0};    ///< how often time went to another moment
  std::atomic<std::int64_t> went_to_ns{0};  ///< the time there; stored before `travels`
  /// The cycle after the last one that stopped the robot; 0: none did. Who asks for a reset says by
  /// it which stops they know.
  std::atomic<std::uint64_t> stopped_before{0};
};

}  // namespace tandem::runtime
