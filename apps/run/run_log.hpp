// The log of a run: where it goes, and what it says about itself.
// Layer: apps/run.  Thread: main.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/run/connection.hpp"
#include "base/result.hpp"
#include "log/recorder.hpp"

namespace tandem::apps {

/// Opens FOLDER/ROBOT-EXPERIMENT-NNN.mcap, the next free number.
///
/// @param folder  created when it is missing.
/// Errors, before anything has moved: the folder cannot be made or written; the disk has less
/// room than the run will write.
[[nodiscard]] Result<std::unique_ptr<log::Recorder>> open_log(const WiredComposition& composition,
                                                              const std::string& folder);

/// How fast the log at `path` grows, and for how long there is room: "at most 0.84 MB for each
/// second; the disk has room for 6.1 h of it".
[[nodiscard]] std::string log_growth(const WiredComposition& composition, const std::string& path);

/// "NAME SHA256 PATH" of every plugin that a host was given.
[[nodiscard]] std::vector<std::string> controller_lines(const runtime::ControllerHost& host);

}  // namespace tandem::apps
