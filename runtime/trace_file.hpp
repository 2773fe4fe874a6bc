// A run's cycles as Chrome trace events, which Perfetto's page (ui.perfetto.dev) opens.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <span>
#include <string>

#include "base/result.hpp"
#include "runtime/cycle_trace.hpp"
#include "runtime/fault.hpp"

namespace tandem::runtime {

/// Writes `trace` to `file`. Time 0 is the first cycle's begin. On the track "loop": per cycle a
/// span "cycle" and within it one of each stage and, in these, of each controller's call; the wait
/// before it, an instant where the cycle before overran, and one for each fault. Counters: wake-up
/// latency and work, in us. Errors: the file cannot be written.
[[nodiscard]] Status write_trace(const std::string& file, const std::string& robot,
                                 const CycleTrace& trace, std::span<const FaultReport> faults,
                                 const ControllerNames& controllers);

}  // namespace tandem::runtime
