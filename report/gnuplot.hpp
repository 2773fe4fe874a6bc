// Draws figures with gnuplot: SVG for the page, PNG beside it, and one overview of them all.
// Layer: report.  Thread: non-RT only; starts one process and waits for it.
#pragma once

#include <span>
#include <string>

#include "base/result.hpp"
#include "report/figure.hpp"

namespace tandem::report {

/// Writes `folder`/NAME.svg and NAME.png of each figure, and `folder`/overview.png with all.
/// The script goes to gnuplot through a pipe; nothing else is left behind.
/// Errors: gnuplot is not installed; it refused the script (with its message); a file could
/// not be written.
[[nodiscard]] Status draw(std::span<const Figure> figures, const std::string& folder);

/// The script that draw() sends, for a look at it.
[[nodiscard]] std::string gnuplot_script(std::span<const Figure> figures,
                                         const std::string& folder);

}  // namespace tandem::report
