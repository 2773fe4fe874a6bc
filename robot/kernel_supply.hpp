// A robot's kernels for who needs them: found, or built first.
// Layer: robot.  Thread: main.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "base/result.hpp"
#include "model/kernel_build.hpp"
#include "model/kernel_library.hpp"
#include "robot/robot_files.hpp"

namespace tandem::robot {

/// What follows when no library fits a robot's files.
enum class MissingKernels : std::uint8_t {
  kRefuse,    ///< an error, with the command that builds it
  kBuild,     ///< it is built in the user's folder
  kTolerate,  ///< the answer is an empty library
};

/// Builds kernels and shows how far it is; an empty one is model::build_kernels(), which is silent.
using BuildKernels =
    std::function<Result<model::BuildReport>(const RobotFiles&, model::BuildOptions)>;

/// The library that find_kernels() finds, or what `missing` says. A library that fits and lacks
/// the variant is an error, for no building mends that.
/// Errors: find_kernels()'s, user_library()'s, build_kernels()'s.
[[nodiscard]] Result<model::KernelLibrary> supply_kernels(const RobotFiles& robot,
                                                          const std::string& variant,
                                                          MissingKernels missing,
                                                          const BuildKernels& build = {});

}  // namespace tandem::robot
