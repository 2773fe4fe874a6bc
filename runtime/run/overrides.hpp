// What a caller, or the command line, says instead of an experiment.
// Layer: runtime/run.  Thread: plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/toml_setting.hpp"

namespace tandem::runtime {

struct Experiment;

struct Overrides {
  /// Values of the experiment's file, and of its robot's below "robot", that are others.
  std::vector<TomlSetting> settings = {};
  std::optional<std::uint64_t> seed = std::nullopt;
  std::optional<double> duration_s = std::nullopt;
  std::optional<double> rate = std::nullopt;  ///< 1: real time, 0: as fast as it goes
  bool start_paused = false;                  ///< true: whatever the experiment says
  std::string kernel_variant = {};            ///< empty: the best that this CPU runs
  bool no_build = false;                      ///< missing kernels are an error
  std::string hal = {};                       ///< "sim", "can", "ethercat", "dds"
  bool lockstep = false;                      ///< true: whatever the experiment says
  std::vector<std::string> interfaces = {};   ///< "can0=vcan0"
  std::string scenario = {};                  ///< faults to inject into the simulation
  std::optional<std::uint32_t> delay_cycles = std::nullopt;
  /// The robot is a log: nothing is simulated, connected or expected, only controllers are made.
  bool from_log = false;
  bool serves = false;  ///< no controllers of its own, and no end
  std::optional<bool> dds = std::nullopt;
  std::optional<int> domain = std::nullopt;  ///< of DDS
  std::string on_fault = {};                 ///< "end", "wait"
  /// No limit of the wall clock ends anything: for work in a debugger. Simulation only.
  bool debug = false;
  std::size_t trace_cycles = 0;  ///< the last whose stages' times are kept
  /// Rows of what happens, such as "push[0]", or "push" of all of a kind, that may have other
  /// values in a run that goes on from a state of this one: they are no part of what it is.
  std::vector<std::string> later = {};
  /// Any other change of what was read, before it is checked. Robot and period stay valid.
  std::function<void(Experiment&)> change = {};
};

}  // namespace tandem::runtime
