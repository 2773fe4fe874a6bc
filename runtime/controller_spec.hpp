// A controller as an experiment names it.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <string>
#include <vector>

#include "base/toml_reader.hpp"
#include "runtime/input_source.hpp"

namespace tandem::runtime {

/// [[controller]]
struct ControllerSpec {
  std::string plugin;    ///< "squat", or a path to a shared library
  std::string name;      ///< unique; default: the plugin's
  bool active = true;    ///< false: it waits until it is started while the run goes on
  TomlTable parameters;  ///< for ControllerSetup; its errors go to `document`
  std::vector<InputSource> inputs = {};  ///< those that the experiment says something of
};

}  // namespace tandem::runtime
