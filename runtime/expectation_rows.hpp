// [[expect]] of an experiment.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <vector>

#include "base/keys.hpp"
#include "base/toml_reader.hpp"
#include "runtime/condition/expectation_spec.hpp"

namespace tandem::runtime {

/// Names in it are looked up when the run is composed: Expectations::read().
/// Errors go to the document: a row that says nothing, or two things; bounds that are missing or of
/// no use; a window without room; a name twice.
[[nodiscard]] std::vector<ExpectationSpec> read_expectations(TomlTable& root);
/// Its keys, for docs/configuration.md.
void describe_expectations(KeyPage& page);

}  // namespace tandem::runtime
