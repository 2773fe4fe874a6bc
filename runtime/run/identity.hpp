// The identity of a run that is composed: what its files, and who opened it, make of it.
// Layer: runtime/run.  Thread: main.
#pragma once

#include <optional>

#include "log/info.hpp"
#include "runtime/run/composition.hpp"
#include "runtime/run_identity.hpp"

namespace tandem::runtime {

/// The files of the robot by their texts, the experiment by its values, and what overrides it. Not
/// what changes no bit: pace, thread, log, report, DDS, what is expected. Not the duration, which
/// only says when the run ends: it is that of the run that goes on. Not the controllers, whose host
/// names them itself, nor faults that are injected, which are in the snapshot. What
/// Overrides::change makes of the experiment is not seen.
/// @param later  Overrides' rows, which are no part of it
[[nodiscard]] RunIdentity identity_of(const Composition& c, const CycleConfig& config,
                                      std::span<const std::string> later = {});

/// What of a run is another in `c` than its log says: "robot.toml: joint[0].gains is \"stiff\"
/// there, and \"soft\" here", with a setting that makes it the same, where one does. Nothing: all
/// that the log names is the same.
[[nodiscard]] std::optional<Error> difference_from(const log::RunInfo& log, const Composition& c,
                                                   const CycleConfig& config);

}  // namespace tandem::runtime
