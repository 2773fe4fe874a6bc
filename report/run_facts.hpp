// What the page says of a run, beside its figures.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <string>

#include "report/page.hpp"
#include "report/run_data.hpp"

namespace tandem::report {

/// One sentence: when its controllers started, or why nobody knows.
[[nodiscard]] std::string start_text(const RunData& run);

/// @param side  behind each name, when several runs stand in the page: " A"
void add_facts(const RunData& run, const std::string& side, Facts& facts);

/// Those that have a row: what of the plant is other, tracking, feet, loops, parameters.
void add_tables(const RunData& run, const std::string& side, Page& page);

}  // namespace tandem::report
