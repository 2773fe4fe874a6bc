// What every cycle shows to whoever watches the loop from another thread.
// Layer: hal.  Thread: take() the loop's.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/backend.hpp"
#include "hal/estimate.hpp"
#include "hal/image.hpp"
#include "hal/run_phase.hpp"
#include "hal/truth.hpp"

namespace tandem::hal {

/// How long a cycle took, on the loop's clock.
struct CycleTimes {
  std::int64_t begin_ns = 0;    ///< clock time of the cycle's begin
  std::int64_t wakeup_ns = -1;  ///< from the grid point to the cycle's begin; -1: not paced
  std::int64_t bus_ns = -1;     ///< then to the bus' answers; -1: waits for none
  std::int64_t work_ns = 0;     ///< the rest, of the cycle before this one
  std::uint64_t overruns = 0;   ///< so far
  std::uint64_t skipped = 0;    ///< grid points without a cycle so far
};

/// One cycle when everything of it is done. References are good during the call.
struct CycleView {
  CycleTime time;
  RunPhase phase;
  Code read_code;  ///< of the backend's read()
  const StateImage& state;
  const CommandImage&
      command;              ///< as the log has it: what went to the drives, and wanted positions
  const TruthImage* truth;  ///< null without a simulation
  const EstimateImage* estimate;  ///< null where nothing is estimated
  CycleTimes times;
};

class CycleObserver {
 public:
  virtual ~CycleObserver() = default;
  /// The last step of every cycle.
  /// @rt wait-free: copies what it needs into a ring, and counts what does not fit.
  virtual void take(const CycleView& view) noexcept TANDEM_RT = 0;
};

}  // namespace tandem::hal
