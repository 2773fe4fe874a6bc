// The report of an identification: curves on held-out data, tables of parameters.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <string>

#include "base/result.hpp"
#include "identification/identify.hpp"

namespace tandem::apps {

/// Behind the identified total mass, when the data do not give it; else empty.
[[nodiscard]] std::string mass_note(const identification::Identification& result);

/// Writes `folder`/report.html and a PNG per joint. @return the page's path
/// Errors: gnuplot is missing; a file cannot be written.
[[nodiscard]] Result<std::string> write_identify_page(const identification::Identification& result,
                                                      const std::string& robot,
                                                      const std::string& folder);

}  // namespace tandem::apps
