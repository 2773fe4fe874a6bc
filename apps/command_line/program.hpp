// What the main() of both programs does around a command: streams, errors, exit status.
// Layer: apps/command_line.  Thread: main.
#pragma once

#include <functional>

#include "apps/command_line/command_line.hpp"

namespace tandem::apps {

/// An overloaded function of several.
template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};

/// Reads the command line, performs the command and prints what went wrong; with --json it writes
/// that there, too. Call it first.
/// @return the exit status
[[nodiscard]] int run_program(int argc, const char* const* argv,
                              const std::function<Exit(const Command&)>& perform);

}  // namespace tandem::apps
