// Child processes: a command to its end, its output in a file.
// Layer: model.  Thread: non-RT.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tandem::model {

/// Whether `program` is an executable file, or the name of one in $PATH.
[[nodiscard]] bool program_exists(const std::string& program);

/// Runs `command` in `directory`, standard output and error to `log`, and waits for it.
/// @return whether it ran and exited with 0.
[[nodiscard]] bool run_program(const std::vector<std::string>& command,
                               const std::filesystem::path& directory,
                               const std::filesystem::path& log);

}  // namespace tandem::model
