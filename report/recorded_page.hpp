// The report of logs as one HTML file: the studio's page, what it shows, and the report's facts.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "base/result.hpp"
#include "report/figure.hpp"
#include "report/page.hpp"
#include "report/recording.hpp"

namespace tandem::report {

/// The file has less [bytes].
inline constexpr std::size_t kMostReportBytes = 5'000'000;

/// Whether the program has the studio's page: it was built with node.
[[nodiscard]] bool has_studio_page();

/// The page with `recording`. Facts, tables and pictures are there without scripts, too.
/// @param pictures  figures whose SVG files (from draw()) are inlined: those that are no plots
/// @param folder    of the SVG files
/// @pre has_studio_page()
/// Errors: an SVG file cannot be read.
[[nodiscard]] Result<std::string> recorded_page(Page page, std::span<const Figure> pictures,
                                                const std::string& folder,
                                                const Recording& recording);

/// The same for a server that has the page's files: facts, tables and recording alone.
[[nodiscard]] Result<std::string> served_document(const Page& page, const Recording& recording);
/// The page's "/" that takes its data from "/log".
[[nodiscard]] std::string served_index();

}  // namespace tandem::report
