// An experiment's tables, as far as they can be read without its robot.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include "base/keys.hpp"
#include "runtime/experiment.hpp"

namespace tandem::runtime {

/// Everything of the experiment but its robot, the second robot's own file and [estimation]. What
/// has to fit the robot is not looked at. Errors go to the document: unknown tables and keys,
/// missing ones, types, ranges, contradictions between them.
/// @param root  the document's; [estimation] is left in it
[[nodiscard]] Experiment read_tables(const TomlDocument& document, TomlTable& root);

/// The keys of an experiment's tables, for docs/configuration.md.
void describe_experiment(KeyPage& page);

}  // namespace tandem::runtime
