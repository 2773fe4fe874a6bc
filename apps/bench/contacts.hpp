// Engines compared on the ground: a block on a slope about the friction cone's edge, and one that
// is dropped.
// Layer: apps/bench.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "apps/bench/subjects.hpp"

namespace tandem::apps {

/// A slope of a block's sole, of tan(angle) = kSlope in the direction of an axis or diagonal.
struct Slope {
  std::string title;   ///< "along an axis, holds (0.99 of the cone)"
  double share = 0.0;  ///< tan(angle) over the friction's coefficient: below 1 it has to hold
  bool diagonal = false;
};

struct SlopeResult {
  double step_ms = 0.0;
  double error_mm = 0.0;     ///< how far from where Coulomb's law has it after kSlopeTime_s
  double sideways_mm = 0.0;  ///< how far beside the line of the slope
  double cost_us_per_ms = 0.0;
};
struct SlopeRow {
  const EngineEntry* entry = nullptr;
  std::vector<SlopeResult> steps{};  ///< the longest first; empty: the engine refused
  std::string refusal{};
};

inline constexpr double kSlope = 0.5;          ///< tan(angle)
inline constexpr double kSlopeSettle_s = 0.2;  ///< after it was put down, not measured
inline constexpr double kSlopeTime_s = 1.0;    ///< what the block slides or holds for

[[nodiscard]] const std::vector<Slope>& slopes();
/// Errors: those of make_block().
[[nodiscard]] Result<std::vector<SlopeRow>> measure(const Slope& slope,
                                                    const std::vector<EngineEntry>& entries);

/// A block that falls 50 mm onto its sole.
struct DropRow {
  const EngineEntry* entry = nullptr;
  double step_ms = 0.0;
  double rebound_mm = 0.0;      ///< how high its sole comes after the first touch
  double settled_s = 0.0;       ///< until it is slower than 1 mm/s for good; negative: never
  double depth_mm = 0.0;        ///< in the ground, at the end
  double energy_gain_mJ = 0.0;  ///< most above what it had at the start
  double cost_us_per_ms = 0.0;
  std::string refusal{};
};
/// Steps of 1 and 1/4 ms. Errors: those of make_block().
[[nodiscard]] Result<std::vector<DropRow>> measure_drop(const std::vector<EngineEntry>& entries);

}  // namespace tandem::apps
