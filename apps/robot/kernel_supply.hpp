// A robot's kernels for a command that needs them: found, or built first.
// Layer: apps/robot.  Thread: main.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.hpp"
#include "model/kernel_build.hpp"
#include "model/kernel_library.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {

/// What follows when no library fits a robot's files.
enum class MissingKernels : std::uint8_t {
  kRefuse,    ///< an error, with the command that builds it
  kBuild,     ///< it is built in the user's folder, and progress shown on standard error
  kQuiet,     ///< the same, and nothing shown
  kTolerate,  ///< the answer is an empty library
};

/// What --no-build and --quiet of a command say.
[[nodiscard]] constexpr MissingKernels missing_kernels(bool no_build, bool quiet) {
  if (no_build) return MissingKernels::kRefuse;
  return quiet ? MissingKernels::kQuiet : MissingKernels::kBuild;
}

/// The library that find_kernels() finds, or what `missing` says. A library that fits and lacks
/// the variant is an error, for no building mends that.
/// Errors: find_kernels()'s, user_library()'s, build_kernels()'s.
[[nodiscard]] Result<model::KernelLibrary> supply_kernels(const robot::RobotFiles& robot,
                                                          const std::string& variant,
                                                          MissingKernels missing);

/// build_kernels() of this robot, its progress on standard error: one line that is redrawn on a
/// terminal, a line for each quarter elsewhere.
[[nodiscard]] Result<model::BuildReport> build_shown(const robot::RobotFiles& robot,
                                                     model::BuildOptions options);

}  // namespace tandem::apps
