// Where kernel libraries stand, and which of them fits a robot.
// Layer: apps.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "apps/robot_files.hpp"
#include "base/result.hpp"
#include "model/kernel_library.hpp"

namespace tandem::apps {

/// Folders in which `tandem` looks for libraries, in this order: lib/models and
/// lib/tandem/models beside the program's folder, then the user's cache
/// ($XDG_CACHE_HOME/tandem/models, or ~/.cache/tandem/models).
[[nodiscard]] std::vector<std::string> model_folders();

/// The user's folder, where `tandem model build` writes when nothing else is said.
[[nodiscard]] std::string user_model_folder();

/// The robot's library from the first folder that has one that fits its files.
///
/// @param variant  empty: the best that this CPU runs.
/// Errors: no library, or none made from these files (with the command that makes it); a variant
/// that the library or this CPU lacks.
[[nodiscard]] Result<model::KernelLibrary> find_kernels(const RobotFiles& robot,
                                                        const std::string& variant);

/// The same for a robot that is known by name and hash only, as a log knows it.
[[nodiscard]] Result<model::KernelLibrary> find_kernels(const std::string& robot,
                                                        const std::string& hash,
                                                        const std::string& variant);

}  // namespace tandem::apps
