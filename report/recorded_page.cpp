#include "report/recorded_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "base/sha256.hpp"
#include "report/packing.hpp"
#include "studio/page.hpp"

namespace tandem::report {
namespace {

constexpr std::size_t kMostFrame = 4'000;  // bytes of the file beside its parts

/// A file of the studio's page.
std::string page_file(std::string_view path) {
  const auto assets = studio::assets();
  const auto asset = std::ranges::find(assets, path, &studio::Asset::path);
  if (asset == assets.end()) return {};
  return asset->gzip ? unzip(asset->bytes) : std::string(asset->bytes);
}

/// A script as the text of its element: within strings "<\/script" is the same.
std::string inline_script(std::string script) {
  for (const std::string_view tag : {"</script", "<!--", "<script"}) {
    for (std::size_t at = 0; (at = script.find(tag, at)) != std::string::npos; at += 2)
      script.insert(at + 1, "\\");
  }
  return script;
}

/// What a policy calls a script: its SHA-256 in base64.
std::string script_hash(const std::string& script) {
  const std::string digits = sha256(script);
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2)
    bytes.push_back(static_cast<std::byte>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  return base64(bytes);
}

/// What the plots have of the logs.
std::string resolution_text(const Grid& grid) {
  if (grid.cycles == 1)
    return fmt::format("every cycle ({} of {:.4g} ms)", grid.rows, 1e3 * grid.period_s);
  return fmt::format("least and largest of each {:.4g} ms ({} cycles): {} rows",
                     1e3 * grid.step_s(), grid.cycles, grid.rows);
}

}  // namespace

bool has_studio_page() { return !page_file("/studio.js").empty(); }

Result<std::string> recorded_page(Page page, std::span<const Figure> pictures,
                                  const std::string& folder, const Recording& recording) {
  const std::string script = inline_script(page_file("/studio.js"));
  const std::string style = page_file("/studio.css");
  const Result<std::string> bare = page_content(page, pictures, folder);
  if (!bare) return bare;
  const std::size_t taken = script.size() + style.size() + bare->size() + kMostFrame;
  const Recording::Text data = recording.text(kMostReportBytes - std::min(taken, kMostReportBytes));
  page.facts.emplace_back("plots show", resolution_text(data.grid));
  page.facts.emplace_back("their numbers have",
                          "16 bits between a signal's own least and largest; whole numbers all");
  const Result<std::string> content = page_content(page, pictures, folder);
  if (!content) return content;
  return page_begin(page.by) +
         fmt::format(
             "<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
             "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
             "script-src 'sha256-{}'; style-src 'unsafe-inline'; img-src data: blob:; "
             "base-uri 'none'; form-action 'none'\">\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
             "<meta name=\"color-scheme\" content=\"light dark\">\n"
             "<title>{}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>{}</style>\n</head>\n"
             "<body data-state=\"recorded\">\n<article id=\"report\" class=\"report\">\n{}"
             "</article>\n"
             "<noscript>Plots and 3D view need JavaScript.</noscript>\n",
             script_hash(script), page_title(page), style, *content) +
         "<script type=\"application/json\" id=\"recording\">" + data.json + "</script>\n<script>" +
         script + "</script>\n</body>\n</html>\n";
}

Result<std::string> served_document(const Page& page, const Recording& recording) {
  const Result<std::string> content = page_content(page, {}, {});
  if (!content) return content;
  return "<!doctype html>\n<article id=\"report\" class=\"report\">\n" + *content +
         "</article>\n<script type=\"application/json\" id=\"recording\">" +
         recording.text(kMostReportBytes).json + "</script>\n";
}

std::string served_index() {
  std::string index = page_file("/");
  const std::string_view body = "<body ";
  const std::size_t at = index.find(body);
  if (at != std::string::npos) index.insert(at + body.size(), "data-log=\"/log\" ");
  return index;
}

}  // namespace tandem::report
