// Which running process a command asks, and by which way: part of the command line's options.
// Layer: apps/command_line.  Thread: main.
#pragma once

#include <optional>
#include <string>

#include "apps/command_line/dds_place.hpp"

namespace tandem::apps {

struct ControlTarget {
  std::string socket{};                     ///< of the process; empty: the only one of this user
  bool dds = false;                         ///< ask over DDS instead
  DdsPlace place{};                         ///< of DDS
  std::optional<std::string> name_space{};  ///< "left"; empty: the only process of the domain
};

}  // namespace tandem::apps
