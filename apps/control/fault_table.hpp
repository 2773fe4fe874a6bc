// A run's faults for programs and for people.
// Layer: apps/control.  Thread: any, non-RT.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "apps/text/console.hpp"
#include "runtime/fault.hpp"

namespace tandem::apps {

/// "every joint held".
[[nodiscard]] const char* reaction_text(hal::StopCategory category);

/// "category 1" of the JSON's "category1".
[[nodiscard]] std::string category_words(std::string category);

/// A list of objects: docs/json.md, `fault_log`.
[[nodiscard]] Json faults_json(const std::vector<runtime::Fault>& faults);

/// The table of such a list; nothing when it is empty.
void print_faults(const Json& faults, std::FILE* out);

}  // namespace tandem::apps
