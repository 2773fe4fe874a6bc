// The report's page: one HTML file that needs nothing beside it.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "report/figure.hpp"

namespace tandem::report {

/// Name and value, in the order of the page.
using Facts = std::vector<std::pair<std::string, std::string>>;

struct PageTable {
  std::string title;
  std::string caption;  ///< what the columns mean
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  ///< the first column is text, the others numbers
};

struct Page {
  std::string title;
  std::string lead;  ///< one sentence under the title
  Facts facts;
  std::vector<Facts> heads{};  ///< of several logs, A first: at the top of the page, side by side
  std::vector<Facts> runs{};   ///< the same of the whole of their facts, below the figures
  std::vector<PageTable> tables{};
  std::string by = "tandem report";  ///< the command that writes it, for page_begin()
};

/// How the page of a command begins: by it a page is known that may be written over.
[[nodiscard]] std::string page_begin(const std::string& by);

/// Title, figures, facts and tables as HTML: what a page has in its body. Texts are escaped.
/// Errors: an SVG file cannot be read.
[[nodiscard]] Result<std::string> page_content(const Page& page, std::span<const Figure> figures,
                                               const std::string& folder);
/// The title as HTML.
[[nodiscard]] std::string page_title(const Page& page);
/// Writes `folder`/report.html. Errors: it cannot be written.
[[nodiscard]] Status write_html(const std::string& html, const std::string& folder);

/// Writes `folder`/report.html with the figures' SVG files (from draw()) inlined.
/// Errors: an SVG file or the page cannot be read or written.
[[nodiscard]] Status write_page(const Page& page, std::span<const Figure> figures,
                                const std::string& folder);

}  // namespace tandem::report
