// [[event]], [[push]] and [[fault]] of an experiment.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include "base/keys.hpp"
#include "base/toml_reader.hpp"
#include "runtime/experiment.hpp"

namespace tandem::runtime {

/// Reads them into Experiment::faults, those whose time is known, and Experiment::events. The robot
/// and its description have been read. Names of conditions are looked up when the run is composed,
/// requests when it is opened.
/// Errors go to the document: sim::read_fault()'s; a row without a time, or with two; too many.
void read_events(TomlTable& root, Experiment& e);
/// Their keys, for docs/configuration.md.
void describe_events(KeyPage& page);

}  // namespace tandem::runtime
