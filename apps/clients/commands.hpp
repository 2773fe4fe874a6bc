// The commands of `tandem` that talk to running processes. Each prints for people, writes JSON when
// asked, and answers the exit status.
// Layer: apps/clients.  Thread: main.
#pragma once

#include "apps/command_line/command_line.hpp"

namespace tandem::apps {

/// A command of command_rows(). Exit::kFault: a cause is still there; a motion that was waited for
/// ended elsewhere; a stop is not confirmed.
[[nodiscard]] Exit asked_command(const AskedOptions& options);
/// Asks a running process one thing and prints its answer.
[[nodiscard]] Exit ask_command(const AskOptions& options);
/// Lets a running process open its studio, and prints the address.
[[nodiscard]] Exit attach_studio(const StudioCommandOptions& options);
/// Topics of a DDS domain: a list, samples as text, rates.
[[nodiscard]] Exit topic_command(const TopicOptions& options);

}  // namespace tandem::apps
