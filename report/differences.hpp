// Where two logs part: the first number of each topic that they do not share, and by how much their
// signals differ.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <string>

#include "base/result.hpp"
#include "report/page.hpp"
#include "report/recording.hpp"

namespace tandem::report {

/// What `tandem log diff` says of two logs, as a table.
/// @param letter  of the second one
/// Errors: log::compare()'s, as of a log that lost messages.
[[nodiscard]] Result<PageTable> first_differences(const std::string& a, const std::string& b,
                                                  char letter);

/// The signals that differ most from those of the first log, by the share of what they change; one
/// table for each other log. Rows without a number in one of them do not count.
[[nodiscard]] std::vector<PageTable> largest_differences(const Recording& recording);

}  // namespace tandem::report
