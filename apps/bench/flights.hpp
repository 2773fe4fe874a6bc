// Engines compared without contact: error, drift and cost of one motion over a sweep of steps.
// Layer: apps/bench.  Thread: main.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/bench/subjects.hpp"

namespace tandem::apps {

/// A motion of a subject from a state of its own, under torques that are held for kHold_ns.
struct Flight {
  static constexpr std::int64_t kHold_ns = 4'000'000;

  std::string name;   ///< of its figure's file
  std::string title;  ///< of its section
  std::string text;   ///< what happens, in a sentence or two
  const BenchRobot* subject = nullptr;
  double duration_s = 1.0;
  bool keeps_energy = true;    ///< no torques: energy is conserved
  bool keeps_momentum = true;  ///< no gravity and a free base: momentum is conserved
  /// Fills the joints' torques at a time; empty: there are none.
  std::function<void(double time_s, std::vector<double>& torque_Nm)> torques = {};
  std::function<void(std::vector<double>& q, std::vector<double>& v)> start = {};
};

/// What one engine made of it in steps of one length.
struct FlightResult {
  std::int64_t step_ns = 0;
  double error_rad = 0.0;       ///< the worst joint, or the base's turn, at the end; NaN: diverged
  double base_error_mm = 0.0;   ///< of a floating base's place at the end; NaN: diverged
  double energy_drift = 0.0;    ///< largest, as a share of the kinetic energy's largest
  double momentum_drift = 0.0;  ///< largest of the angular one, as a share
  double cost_us_per_ms = 0.0;  ///< processor time of a simulated millisecond
};

struct FlightRow {
  const EngineEntry* entry = nullptr;
  std::vector<FlightResult> steps{};  ///< the longest first; empty: the engine refused
  std::string refusal{};              ///< why it refused
};

/// Every entry over steps of 4, 2, 1, 1/2, 1/4 and 1/8 ms. The truth is Tandem's own engine with
/// rk4 in steps of 1/64 ms.
/// @param truth_error_rad  out: that against steps of 1/32 ms
/// Errors: those of Plant::create() for the truth.
[[nodiscard]] Result<std::vector<FlightRow>> measure(const Flight& flight,
                                                     const std::vector<EngineEntry>& entries,
                                                     double& truth_error_rad);

/// Accelerations at 1,000 random states, against the kernels'.
struct AccelerationRow {
  const EngineEntry* entry = nullptr;
  double worst = 0.0;     ///< difference over the largest acceleration of the state
  double cost_us = 0.0;   ///< processor time of one evaluation, the state's conversion included
  std::string refusal{};  ///< why it refused; empty: it did not
};
[[nodiscard]] std::vector<AccelerationRow> measure_accelerations(
    const BenchRobot& subject, const std::vector<EngineEntry>& entries);

/// Processor time of the calling thread [s].
[[nodiscard]] double thread_time_s();
/// What has passed of it since `before_s`, less what reading the clock takes, which is a system
/// call and may be more than a short step.
[[nodiscard]] double thread_time_since_s(double before_s);

}  // namespace tandem::apps
