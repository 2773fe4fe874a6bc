// How a run goes: its lengths, and what it does about stops.
// Layer: runtime.  Thread: plain data.
#pragma once

#include <cstdint>

#include "hal/stop_category.hpp"
#include "rt/cyclic_loop.hpp"
#include "runtime/after_stop.hpp"
#include "runtime/fall_watch.hpp"

namespace tandem::runtime {

struct CycleConfig {
  rt::CyclicLoopConfig loop{};
  std::uint64_t running_cycles = 0;  ///< that controllers run; 0: until stopped
  std::uint64_t bring_up_cycles =
      20'000;                       ///< at most, then the run ends in a fault; of a reset, too
  std::uint64_t settle_cycles = 0;  ///< every joint is held, from enabled to kRunning
  std::uint64_t shut_down_cycles = 2'000;  ///< at most
  AfterStop after_stop = AfterStop::kEnd;
  AfterReset after_reset = AfterReset::kHold;
  /// Reaction to a controller that writes what it has not claimed, which never reaches a drive.
  hal::StopCategory on_stray = hal::StopCategory::kWarn;
  std::uint64_t retreat_cycles = 5'000;  ///< at most, in a stop of category 2
  std::uint32_t lost_after_cycles = 10;  ///< feedback older than this is a lost joint or sensor
  std::uint32_t delay_cycles = 0;        ///< between the controllers and the limits
  FallLimits fall = {};                  ///< watched where there is truth
  std::size_t trace_cycles = 0;          ///< the last that trace() keeps: 6 clock reads each
};

}  // namespace tandem::runtime
