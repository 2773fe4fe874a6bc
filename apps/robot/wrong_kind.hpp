// Names on the command line that are of another kind than the command takes.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <optional>
#include <string>

#include "base/result.hpp"

namespace tandem::apps {

enum class Takes { kExperiment, kRobot, kEither };

/// The error for a folder, for a robot where an experiment belongs, or the other way round: what
/// was given, what was meant, and, to be typed, what stands beside it. Nothing for any other file.
///
/// @param command  as typed: "tandem model info"
[[nodiscard]] std::optional<Error> wrong_kind(const std::string& file, Takes takes,
                                              const std::string& command);

}  // namespace tandem::apps
