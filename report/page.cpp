// Tables and inlined SVG with escaped texts; identifiers are made unique per figure.
#include "report/page.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <functional>

#include "base/open_file.hpp"
#include "base/quoting.hpp"

namespace tandem::report {
namespace {

const char kStyle[] = R"(
:root { color-scheme: light dark; --ink: #1d242c; --soft: #5b6470; --line: #e3e7ec;
        --desk: #f5f7f9; --card: #fff; }
@media screen and (prefers-color-scheme: dark) {
  :root { --ink: #e3e7ec; --soft: #a7b0bb; --line: #343c46; --desk: #14181d; --card: #1d232a; }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--desk); color: var(--ink);
       font: 15px/1.5 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 32px 20px 64px; }
h1 { font-size: 26px; margin: 0 0 4px; }
h2 { font-size: 18px; margin: 36px 0 8px; }
p { margin: 0 0 16px; color: var(--soft); }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 14px;
        overflow-x: auto; }
.figures .card { background: #fff; }  /* they are drawn in dark ink */
.figures { display: grid; gap: 16px; grid-template-columns: repeat(auto-fit, minmax(480px, 1fr)); }
.figures svg { width: 100%; height: auto; display: block; }
dl { display: grid; grid-template-columns: repeat(auto-fill, minmax(250px, 1fr)); gap: 10px 24px;
     margin: 0; }
dt { color: var(--soft); font-size: 13px; }
dd { margin: 0; font-variant-numeric: tabular-nums; overflow-wrap: anywhere; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: 4px 10px; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; }
th { color: var(--soft); font-weight: 600; }
.logs td { text-align: left; overflow-wrap: anywhere; }
.logs .differs td { font-weight: 600; }
@media (max-width: 560px) { .figures { grid-template-columns: 1fr; } }
@media print { body { background: #fff; } .card { break-inside: avoid; } }
)";

/// The SVG element of a file, with identifiers made unique: several stand in one page.
Result<std::string> inline_svg(const std::string& file, const std::string& name) {
  Result<std::string> svg_read = read_file(file, "draw it again", kMostOtherBytes);
  if (!svg_read) return svg_read;
  std::string svg = harmless(*svg_read);  // names are in it
  svg.erase(0, svg.find("<svg"));
  for (const char* id :
       {"gnuplot_plot_", "gnuplot_canvas", "gpDot", "gpPt", "greybox", "textbox"}) {
    const std::string unique = name + "_" + id;
    for (std::size_t at = 0; (at = svg.find(id, at)) != std::string::npos; at += unique.size()) {
      svg.replace(at, std::strlen(id), unique);
    }
  }
  return svg;
}

/// In the page, whoever wrote it.
std::string page_text(std::string_view text) { return xml_text(harmless(text)); }

/// All values of a name, since some stand there more than once.
std::string value_in(const Facts& facts, const std::string& name) {
  std::string text;
  for (const auto& [key, value] : facts)
    if (key == name && !value.empty()) text += (text.empty() ? "" : "; ") + value;
  return text;
}

/// Facts of several logs beside each other, a column each; what is not the same is marked.
std::string logs_table(const std::vector<Facts>& logs) {
  std::string out = "<div class=\"card\"><table class=\"logs\">\n<thead><tr><td></td>";
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const char letter = static_cast<char>('A' + i);
    out += fmt::format(
        "<th scope=\"col\"><span class=\"log-line\" data-log=\"{0}/\"></span>{0}</th>", letter);
  }
  out += "</tr></thead>\n<tbody>\n";
  std::vector<std::string> names;
  for (const Facts& facts : logs)
    for (const auto& [name, value] : facts)
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  for (const std::string& name : names) {
    std::vector<std::string> values;
    for (const Facts& facts : logs) values.push_back(value_in(facts, name));
    if (std::ranges::all_of(values, &std::string::empty)) continue;
    const bool same = std::ranges::adjacent_find(values, std::not_equal_to<>()) == values.end();
    out += fmt::format("<tr{}><th scope=\"row\">{}</th>", same ? "" : " class=\"differs\"",
                       page_text(name));
    if (same)
      out += fmt::format("<td colspan=\"{}\">{}</td>", logs.size(), page_text(values.front()));
    for (const std::string& value : values)
      if (!same) out += "<td>" + page_text(value) + "</td>";
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string html_table(const PageTable& table) {
  std::string out = fmt::format("<h2>{}</h2>\n<p>{}</p>\n<div class=\"card\"><table>\n<thead><tr>",
                                page_text(table.title), page_text(table.caption));
  for (const std::string& cell : table.header) out += "<th>" + page_text(cell) + "</th>";
  out += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (const std::string& cell : row) out += "<td>" + page_text(cell) + "</td>";
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

}  // namespace

std::string page_begin(const std::string& by) {
  return "<!doctype html>\n<!-- Written by `" + by + "`. -->\n";
}

Result<std::string> page_content(const Page& page, std::span<const Figure> figures,
                                 const std::string& folder) {
  std::string html =
      fmt::format("<h1>{}</h1>\n<p>{}</p>\n", page_text(page.title), page_text(page.lead));
  if (!page.heads.empty()) html += logs_table(page.heads);
  html += "<div class=\"figures\">\n";
  for (const Figure& figure : figures) {
    const Result<std::string> svg = inline_svg(folder + "/" + figure.name + ".svg", figure.name);
    if (!svg) return svg;
    html += "<figure class=\"card\" style=\"margin:0\">" + *svg + "</figure>\n";
  }
  html += page.runs.empty() ? "</div>\n<h2>Run</h2>\n" : "</div>\n<h2>Runs</h2>\n";
  if (!page.runs.empty()) html += logs_table(page.runs);
  html += "<div class=\"card\"><dl>\n";
  for (const auto& [name, value] : page.facts) {
    html += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", page_text(name), page_text(value));
  }
  html += "</dl></div>\n";
  for (const PageTable& table : page.tables) html += html_table(table);
  return html;
}

std::string page_title(const Page& page) { return page_text(page.title); }

Status write_html(const std::string& html, const std::string& folder) {
  const std::string file = folder + "/report.html";
  const Result<Descriptor> out = open_output(file);
  const std::string why = !out                         ? out.error().message
                          : write_all(*out, html) != 0 ? std::strerror(errno)
                                                       : "";
  if (why.empty()) return {};
  return std::unexpected(Error{.message = "cannot write the report: " + why,
                               .hint = "check the folder's permissions and the disk's free space",
                               .file = file,
                               .key = {}});
}

Status write_page(const Page& page, std::span<const Figure> figures, const std::string& folder) {
  const Result<std::string> content = page_content(page, figures, folder);
  if (!content) return std::unexpected(content.error());
  return write_html(
      page_begin(page.by) +
          fmt::format("<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n"
                      "</body>\n</html>\n",
                      page_title(page), kStyle, *content),
      folder);
}

}  // namespace tandem::report
