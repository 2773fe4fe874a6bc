// The log of a run: where it goes, and what it says about itself.
// Layer: apps/run.  Thread: main.
#pragma once

#include <memory>
#include <string>

#include "apps/run/composition.hpp"
#include "base/result.hpp"
#include "log/recorder.hpp"

namespace tandem::apps {

/// Opens FOLDER/ROBOT-EXPERIMENT-NNN.mcap, the next free number.
///
/// @param folder  created when it is missing.
/// Errors, before anything has moved: the folder cannot be made or written; the disk has less
/// room than the run will write.
[[nodiscard]] Result<std::unique_ptr<log::Recorder>> open_log(const Composition& composition,
                                                              const std::string& folder);

}  // namespace tandem::apps
