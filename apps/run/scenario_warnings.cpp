#include "apps/run/scenario_warnings.hpp"

#include <fmt/core.h>

#include <numbers>

namespace tandem::apps {
namespace {

/// A run ends its length after the drives' bring-up, which takes a part of a second.
constexpr double kBringUp_s = 0.5;
/// The strongest earthquakes on record have a fifth of it.
constexpr double kHardest_m_s2 = 100.0;

/// When the run ends, after the first SYNC.
double end_of(const runtime::Experiment& e) { return kBringUp_s + e.hal.settle_s + e.duration_s; }

void warn_of_rows(const runtime::Experiment& e, Diagnostics& warnings) {
  for (const runtime::DueRow& row : e.due) {
    const double end_s = end_of(e) - (row.after_enabled ? kBringUp_s : 0.0);
    if (row.at_s < end_s) continue;
    warnings.push_back(
        {.message = fmt::format(
             "{} never comes: it is due at {:.6g} s{}, and the run ends {}{:.1f} "
             "s after {}",
             row.name, row.at_s, row.after_enabled ? " after the drives are enabled" : "",
             row.after_enabled ? "" : "about ", end_s,
             row.after_enabled ? "that" : "its first cycle"),
         .hint = "give an earlier time, or a longer duration_s",
         .file = e.file,
         .line = row.line,
         .key = row.key});
  }
}

void warn_of_payloads(const runtime::Experiment& e, Diagnostics& warnings) {
  const double end_s = end_of(e);
  for (const sim::ScenarioFault& one : e.plant->carried) {
    const double from_s = static_cast<double>(one.start_ns) * 1e-9;
    const double until_s = from_s + static_cast<double>(one.duration_ns) * 1e-9;
    const bool never = from_s >= end_s;
    if (!never && (one.duration_ns < 0 || until_s < end_s)) continue;
    warnings.push_back(
        {.message = fmt::format("{} is never {}: that is due {:.6g} s after the first SYNC, and "
                                "the run ends about {:.1f} s after it",
                                e.plant->payloads[one.number - 1], never ? "picked up" : "dropped",
                                never ? from_s : until_s, end_s),
         .hint = never ? "give an earlier from_s, or a longer duration_s" : "",
         .file = e.file,
         .key = "sim.payload"});
  }
}

void warn_of_shakes(const runtime::Experiment& e, Diagnostics& warnings) {
  for (const hal::GroundShake& one : e.plant->robot.contact.terrain.shakes()) {
    const std::string key = "sim.shake." + one.name;
    const double omega = 2.0 * std::numbers::pi * one.frequency_Hz;
    const double peak = one.amplitude_m * omega * omega;
    if (!e.endless() && one.from_s >= end_of(e)) {
      warnings.push_back(
          {.message = fmt::format("the ground does not shake: that begins {:.6g} s after the first "
                                  "SYNC, and the run ends about {:.1f} s after it",
                                  one.from_s, end_of(e)),
           .hint = "give an earlier from_s, or a longer duration_s",
           .file = e.file,
           .key = key});
    }
    if (peak <= kHardest_m_s2) continue;
    warnings.push_back(
        {.message = fmt::format("the ground accelerates with {:.3g} m/s2 at its peak, {:.0f} times "
                                "gravity: (2 pi frequency_Hz)^2 amplitude_m",
                                peak, peak / 9.81),
         .hint = "are both units right? An earthquake has 1 to 20 m/s2",
         .file = e.file,
         .key = key});
  }
}

}  // namespace

void add_scenario_warnings(const runtime::Experiment& e, Diagnostics& warnings) {
  if (e.hal.backend != runtime::BackendKind::kSim) return;
  if (!e.endless()) warn_of_rows(e, warnings);
  if (e.plant == nullptr) return;
  if (!e.endless()) warn_of_payloads(e, warnings);
  warn_of_shakes(e, warnings);
}

}  // namespace tandem::apps
