// `tandem eds show`: what a drive is and can, by its data sheet.
// Layer: apps/tools.  Thread: main.
#pragma once

#include "apps/command_line/command_line.hpp"

namespace tandem::apps {

/// Prints it for people, and writes the JSON that was asked for.
[[nodiscard]] Exit eds_show(const EdsOptions& options);

}  // namespace tandem::apps
