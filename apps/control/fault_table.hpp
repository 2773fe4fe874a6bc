// A run's faults for programs and for people.
// Layer: apps/control.  Thread: any, non-RT.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "apps/text/figures.hpp"
#include "runtime/fault.hpp"

namespace tandem::apps {

/// "every joint held".
[[nodiscard]] const char* reaction_text(hal::StopCategory category);

/// "category 1" of the JSON's "category1".
[[nodiscard]] std::string category_words(std::string category);

/// docs/json.md, `fault_log`
void figures(Figures& f, const runtime::FaultReport& fault);

/// "1.204 s: joint2: it is too hot", of each that is latched.
[[nodiscard]] std::vector<std::string> latched_texts(
    const std::vector<runtime::FaultReport>& faults);

/// The table of a JSON list of faults; nothing when it is empty.
void print_faults(const Json& faults, std::FILE* out);

}  // namespace tandem::apps
