// COMAN with everything on, boards, frames and controllers, on every engine: stands and squats.
// Layer: apps/bench.  Thread: main; starts this program.
#pragma once

#include <string>
#include <vector>

#include "apps/bench/engine_entries.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// COMAN on its feet, its drives holding the posture "stand".
struct StandRow {
  const EngineEntry* entry = nullptr;
  double foot_mm = 0.0, base_mm = 0.0;  ///< most that they drift within kStandTime_s
  double turn_deg = 0.0;                ///< most that the base turns then
  double force_error = 0.0;             ///< mean force on the ground against the weight, a share
  double cost_us_per_ms = 0.0;          ///< processor time: plant, firmware, frames
  std::string refusal{};                ///< the error; empty: it went well
};
inline constexpr double kStandTime_s = 20.0;
/// After as long a time to settle. Errors: COMAN or its kernels are not found.
[[nodiscard]] Result<std::vector<StandRow>> measure_stand(const std::vector<EngineEntry>& entries);

struct HumanoidRow {
  const EngineEntry* entry = nullptr;
  double slip_mm = 0.0;         ///< most that a foot slips
  double height_mm = 0.0;       ///< the base's lowest to highest
  double tilt_deg = 0.0;        ///< of the base at the end
  double force_error = 0.0;     ///< mean force on the ground against the weight, as a share
  double tracking_deg = 0.0;    ///< worst joint, largest
  double cost_us_per_ms = 0.0;  ///< wall time of a simulated millisecond, the whole loop
  std::string refusal{};        ///< the run's error, or what it ended with; empty: it went well
};

/// The bundled experiment config/coman/`experiment` for `duration_s`, in the plant's usual
/// sub-steps, by `tandem run` for each entry.
/// Errors: COMAN is not found; a file cannot be written; the program cannot be started.
[[nodiscard]] Result<std::vector<HumanoidRow>> measure_humanoid(
    const std::string& experiment, double duration_s, const std::vector<EngineEntry>& entries);

}  // namespace tandem::apps
