// Where a command that talks DDS by itself takes part: part of the command line's options.
// Layer: apps/command_line.  Thread: main.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tandem::apps {

struct DdsPlace {
  std::optional<int> domain{};                ///< nothing: ROS_DOMAIN_ID
  std::vector<std::string> interfaces{"lo"};  ///< network interfaces
  std::string from{};  ///< TOML whose [dds] says all of it, with DDS Security; empty: none
};

}  // namespace tandem::apps
