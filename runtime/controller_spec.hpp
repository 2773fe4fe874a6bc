// A controller as an experiment names it.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <string>

#include "base/toml_reader.hpp"

namespace tandem::runtime {

/// [[controller]]
struct ControllerSpec {
  std::string plugin;    ///< "squat", or a path to a shared library
  std::string name;      ///< unique; default: the plugin's
  bool active = true;    ///< false: it waits until it is started while the run goes on
  TomlTable parameters;  ///< for ControllerSetup; its errors go to `document`
};

}  // namespace tandem::runtime
