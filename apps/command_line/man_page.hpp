// The manual pages: what --help says, for `man`.
// Layer: apps/command_line.  Thread: main.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "base/result.hpp"

namespace tandem::apps {

/// The manual page of a command with all its subcommands, as roff; of the program: its commands by
/// task. From the same tables as --help.
[[nodiscard]] std::string man_page(const CLI::App& app);

/// Writes tandem.1 and a page for each command into a folder, which is made.
/// Errors: a file that cannot be written.
[[nodiscard]] Status write_man_pages(const CLI::App& app, const std::string& folder);

}  // namespace tandem::apps
