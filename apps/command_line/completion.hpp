// What a shell offers while a command line of `tandem` is typed (scripts/completion.*).
// Layer: apps/command_line.  Thread: main.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tandem::apps {

/// First word of the command that shells ask: `tandem __complete WORD…`. No help shows it.
inline constexpr char kComplete[] = "__complete";

/// A word that may stand there, and what it is.
struct Completion {
  std::string word;
  std::string doc;
};

/// What may stand for the last word.
struct Completions {
  std::vector<Completion> words;
  bool files = false;  ///< a file may, too: the shell knows which there are
};

/// Answers from the commands, flags and checks of `app`, and by the names of bundled files.
/// @param words  of the line, after the program's name; the last one as far as it is typed
[[nodiscard]] Completions completions(const CLI::App& app, const std::vector<std::string>& words);

/// A line for each word, what it is behind a tab; ":files" on a last line where a file may stand.
[[nodiscard]] std::string to_lines(const Completions& completions);

}  // namespace tandem::apps
