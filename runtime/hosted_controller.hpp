// A controller as the host keeps it: where it is from, what it declared and claims.
// Layer: runtime.  Thread: made non-RT; its members say whose they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/toml_reader.hpp"
#include "controllers/controller.hpp"
#include "controllers/plugin_loader.hpp"
#include "runtime/controller_shadow.hpp"
#include "runtime/controller_succession.hpp"
#include "runtime/controller_times.hpp"
#include "runtime/cycle_request.hpp"
#include "runtime/input_port.hpp"

namespace tandem::runtime {

/// The code of a controller: which file it came from.
struct ControllerCode {
  std::string name, sha256, path;
};

/// A controller, and where it is from.
struct ControllerSource {
  template <class Pointer>  // to one of this program
  ControllerSource(Pointer made) : controller(std::move(made)) {}
  ControllerSource(LoadedController plugin);  ///< keeps its library open

  std::shared_ptr<Controller> controller;
  ControllerCode code = {};    ///< of a plugin; else empty
  bool lacks_archive = false;  ///< a plugin has members, and no archive()
};

/// A configured controller.
struct HostedController {
  std::string name;
  std::string plugin;                              ///< its library's path; empty: it has none
  std::string sha256;                              ///< of its library; empty: it has none
  std::shared_ptr<ControllerIo> io;                ///< what it declared
  std::shared_ptr<Controller> controller;          ///< a plugin's shares its library's life
  std::int32_t signal_channel = -1;                ///< of the log; -1: none
  std::int32_t mark_channel = -1;                  ///< the same
  std::vector<std::shared_ptr<InputPort>> inputs;  ///< the ways to its inputs
  std::vector<ControllerSetup::Claim> claims;
  std::vector<ControllerSetup::Plan> plans;
  std::vector<std::uint8_t> claimed;       ///< by joint
  std::vector<std::uint8_t> strayed;       ///< by joint: something was taken back, and reported
  std::uint32_t id = 0;                    ///< of its name, for the fault log: enter()
  std::shared_ptr<ControllerTimes> times;  ///< of its calls in the cycle
  bool lacks_archive = false;              ///< it has members, and no archive()
  bool of_experiment = true;               ///< not loaded while the run went on
  bool leaves = false;                     ///< the asking side's: the loop was asked to let it go
  std::optional<TomlDocument> document;    ///< where its parameters are; none: it has no document
  std::string parameters;                  ///< the path of their table there
  std::unique_ptr<HostedController> next;  ///< the asking side's: the loop was asked to replace it
  std::vector<ParameterChange> loaded;     ///< for the log: what it came with during a run
  std::size_t told = 0;                    ///< the loop's: of these
  std::unique_ptr<Succession> succession;  ///< of one that replaces another, until that is done
  std::unique_ptr<Shadow> shadow;          ///< what it wants while it commands nothing
};

}  // namespace tandem::runtime
