// A robot's kernels are built, and somebody watches.
// Layer: apps/robot.  Thread: main.
#pragma once

#include "robot/kernel_supply.hpp"

namespace tandem::apps {

/// build_kernels() of this robot, its progress on standard error: one line that is redrawn on a
/// terminal, a line for each quarter elsewhere.
[[nodiscard]] Result<model::BuildReport> build_shown(const robot::RobotFiles& robot,
                                                     model::BuildOptions options);

/// The same for a run's first start, with what it is for and how long it took.
[[nodiscard]] Result<model::BuildReport> build_once(const robot::RobotFiles& robot,
                                                    model::BuildOptions options);

/// What --no-build and --quiet of a command say.
[[nodiscard]] constexpr robot::MissingKernels missing_kernels(bool no_build) {
  return no_build ? robot::MissingKernels::kRefuse : robot::MissingKernels::kBuild;
}
/// Builds nothing: makes this empty file, by which others know that it is to be done.
[[nodiscard]] robot::BuildKernels not_built(const std::string& file);
[[nodiscard]] inline robot::BuildKernels builder(bool quiet) {
  return quiet ? robot::BuildKernels() : build_once;
}

}  // namespace tandem::apps
