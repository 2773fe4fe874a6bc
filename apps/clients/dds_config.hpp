// What the command line says of DDS, as a participant needs it.
// Layer: apps/clients.  Thread: main.
#pragma once

#include "apps/command_line/dds_place.hpp"
#include "base/result.hpp"
#include "dds/config.hpp"

namespace tandem::apps {

/// Errors: the TOML that `place` names cannot be read, has no [dds], or an error in it (the first).
[[nodiscard]] Result<dds::Config> dds_config(const DdsPlace& place);

}  // namespace tandem::apps
