// Where kernel libraries stand, and which of them fits a robot.
// Layer: robot.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/kernel_library.hpp"
#include "robot/robot_files.hpp"

namespace tandem::robot {

/// Digits of the description's hash in the name of a library in the user's folder.
inline constexpr std::size_t kHashDigits = 16;

/// Folders in which `tandem` looks for libraries, in this order: those of TANDEM_MODELS (separated
/// by
/// ':'), lib/models and lib/tandem/models beside the program's folder, then the user's folder, if
/// there is one.
[[nodiscard]] std::vector<std::string> model_folders();

/// The user's folder: $XDG_CACHE_HOME/tandem/models, or ~/.cache/tandem/models.
///
/// Error: neither XDG_CACHE_HOME nor HOME holds an absolute path.
[[nodiscard]] Result<std::string> user_model_folder();

/// The library of a robot in a folder: ROBOT-HASH_kernels.so.
/// Errors: a robot's name that is no file name.
[[nodiscard]] Result<std::string> library_in(const std::string& folder, const std::string& robot,
                                             const std::string& hash);

/// Where `tandem model build` writes when nothing else is said: ROBOT-HASH_kernels.so in the
/// user's folder. So two robots of one name, and two versions of a robot, stand side by side.
///
/// @param hash  description_hash(); its first kHashDigits are used.
/// Errors: user_model_folder()'s; a robot's name that is no file name.
[[nodiscard]] Result<std::string> user_library(const std::string& robot, const std::string& hash);

/// The robot's library from the first folder that has one that fits its files, under the name
/// that user_library() gives it or as ROBOT_kernels.so.
///
/// @param variant  empty: the best that this CPU runs.
/// Errors: no library, or none made from these files (with the command that makes it); a variant
/// that the library or this CPU lacks; a robot's name that is no file name.
[[nodiscard]] Result<model::KernelLibrary> find_kernels(const RobotFiles& robot,
                                                        const std::string& variant);

/// The same for a robot that is known by name and hash only, as a log knows it.
[[nodiscard]] Result<model::KernelLibrary> find_kernels(const std::string& robot,
                                                        const std::string& hash,
                                                        const std::string& variant);

}  // namespace tandem::robot
