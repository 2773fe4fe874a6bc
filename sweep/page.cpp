#include "sweep/page.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "apps/text/draft.hpp"
#include "base/counted.hpp"
#include "sweep/pictures.hpp"
#include "sweep/table.hpp"

namespace tandem::sweep {
namespace {

const char kSweepStyle[] = R"(
:root { --ink: #1d242c; --soft: #5b6470; --line: #d5dbe2; --ground: #f5f7f9; --card: #fff;
        --good: #1f5fa8; --bad: #b3261e; color-scheme: light dark; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ed; --soft: #a4adb8; --line: #39414b; --ground: #14181d; --card: #1c2127;
          --good: #7fb2ee; --bad: #ff8a80; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink);
       font: 15px/1.5 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 32px 20px 64px; }
h1 { font-size: 26px; margin: 0 0 4px; overflow-wrap: anywhere; }
h2 { font-size: 18px; margin: 36px 0 8px; }
h3 { font-size: 15px; margin: 0 0 6px; overflow-wrap: anywhere; }
p { margin: 0 0 12px; color: var(--soft); }
.card { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 14px;
        overflow-x: auto; }
.figures { display: grid; gap: 16px;
           grid-template-columns: repeat(auto-fill, minmax(min(340px, 100%), 1fr)); }
svg { width: 100%; height: auto; display: block; }
svg text { fill: var(--soft); font: 11px system-ui, "DejaVu Sans", sans-serif; }
.axis { stroke: var(--line); } .zero { stroke: var(--soft); stroke-dasharray: 4 3; }
.good { fill: var(--good); } .bad { fill: var(--bad); }
.dots circle { fill-opacity: 0.6; }
.dots .good { fill: none; stroke: var(--good); }
.rate { font-size: 22px; color: var(--ink); font-variant-numeric: tabular-nums; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: 4px 10px; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child, .text { text-align: left; }
th { color: var(--soft); font-weight: 600; }
ol { margin: 0; padding-left: 26px; } li { margin-bottom: 10px; }
code { display: block; white-space: pre-wrap; overflow-wrap: anywhere; font-size: 13px; }
code.in { display: inline; } a { color: var(--good); }
.ranks td:first-child, .ranks td.text { overflow-wrap: anywhere; }
@media (max-width: 600px) { main { padding: 20px 12px 40px; } .card { padding: 10px; }
  th, td { padding: 4px; font-size: 13px; } }
b.no { color: var(--bad); }
@media print { .card { break-inside: avoid; } }
)";

std::string rate_words(const PassRate& rate) {
  const Interval interval = rate.interval();
  const std::string refused = rate.refused == 0
                                  ? ""
                                  : fmt::format("{} of {} were refused; of those that ran ",
                                                rate.refused, rate.all + rate.refused);
  return refused + fmt::format("{:.1f} % of {} passed, {:.1f} to {:.1f} %",
                               100.0 * static_cast<double>(rate.passed) /
                                   static_cast<double>(std::max<std::uint64_t>(1, rate.all)),
                               rate.all, 100.0 * interval.low, 100.0 * interval.high);
}

std::string rates(const Study& study, const SweepSummary& summary) {
  std::string out = fmt::format("<p class=\"rate\">{}</p>\n<p>Wilson's interval, 95 %. ",
                                rate_words(summary.rate));
  for (const auto& [ended, count] : summary.ends)
    out += fmt::format("{} ended {}. ", count, text_in_page(ended));
  if (!summary.refused_why.empty()) out += "Refused, such as: " + text_in_page(summary.refused_why);
  out += "</p>\n";
  if (summary.seeds_alike) {
    out += fmt::format(
        "<p><b class=\"no\">The {} change nothing</b>: results are the same to the last bit, so "
        "each value counts once. Set <code class=\"in\">sim.noise=true</code>, or leave "
        "<code class=\"in\">seeds</code> out.</p>\n",
        counted(study.seeds.size(), "seed"));
  }
  if (study.variants.empty()) return out;
  out +=
      "<h2>Variants</h2><div class=\"card\"><table><thead><tr><th>variant</th><th>passed</th>"
      "</tr></thead><tbody>\n";
  for (const PassRate& one : summary.variants)
    out += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", text_in_page(one.variant),
                       rate_words(one));
  out += "</tbody></table></div>\n";
  for (const Comparison& one : summary.comparisons) {
    out += fmt::format(
        "<p>{0} against {1}, on the same points: {2} passed with {0} alone, {3} with {1} alone, "
        "{4} "
        "with both, {5} with neither. Without a difference so uneven a split has the probability "
        "{6:.3g} (McNemar's exact test).</p>\n",
        text_in_page(one.other), text_in_page(one.first), one.only_other, one.only_first, one.both,
        one.neither, one.p());
  }
  return out;
}

std::string ranking(const SweepSummary& summary) {
  if (summary.ranking.empty()) return {};
  std::string out =
      "<h2>What margins hang on</h2><p>Spearman's rank correlation of a margin with what varies: 1 "
      "when it always rises with it, -1 when it always falls; near 0 it may still have a "
      "maximum in between. A failure without a margin counts as the least.</p><div "
      "class=\"card\"><table class=\"ranks\"><thead><tr><th>key</th>"
      "<th class=\"text\">margin of</th><th>rank "
      "correlation</th><th>points</th></tr></thead><tbody>\n";
  for (const Sensitivity& one : summary.ranking) {
    out += fmt::format(
        "<tr><td>{}</td><td class=\"text\">{}</td><td>{:+.2f}</td><td>{}{}</td></tr>\n",
        text_in_page(one.key), text_in_page(one.expectation), one.rank_correlation, one.points,
        one.without_margin == 0 ? "" : fmt::format(", {} without", one.without_margin));
  }
  return out + "</tbody></table></div>\n";
}

std::string margins(const Study& study, const Points& points,
                    const std::vector<std::optional<PointResult>>& results) {
  std::string out;
  for (const NamedMargin& margin : margins_of(results)) {
    const std::vector<MarginOfPoint> of_points = margins_in(results, margin.name);
    if (of_points.empty()) continue;
    const auto count = [&](const auto& is) {
      return static_cast<std::uint64_t>(std::ranges::count_if(of_points, is));
    };
    const std::uint64_t with = count([](const auto& one) { return one.has_margin(); });
    out += fmt::format(
        "<h2>{}</h2>\n<p>{} of {} have a margin. It failed in {}, {} of them without a "
        "margin.</p>\n<div class=\"figures\"><div class=\"card\"><h3>margin{}"
        "</h3>{}</div>\n",
        text_in_page(margin.name), with, counted(results.size(), "point"),
        count([](const auto& one) { return one.failed; }), of_points.size() - with,
        margin.unit.empty() ? "" : " [" + text_in_page(margin.unit) + "]",
        histogram(of_points, margin));
    for (std::size_t k = 0; k < study.vary.size(); ++k) {
      std::vector<double> x;
      for (const MarginOfPoint& one : of_points)
        x.push_back(number_of(study.vary[k], points.at(one.index).values[k]));
      out += fmt::format("<div class=\"card\"><h3>margin{} over {}</h3>{}</div>\n",
                         margin.unit.empty() ? "" : " [" + text_in_page(margin.unit) + "]",
                         text_in_page(study.vary[k].key),
                         scatter(of_points, std::move(x), margin, study.vary[k]));
    }
    out += "</div>\n";
  }
  return out;
}

std::string worst(const Study& study, const SweepSummary& summary) {
  std::string out = fmt::format(
      "<h2>Worst points</h2><p>Failures without a margin come first, then the least margins, each "
      "as a multiple of its expectation's usual size; a row for each set of values. The command "
      "repeats the point, with a log, in the folder <code class=\"in\">{}</code>.</p>"
      "<div class=\"card\"><ol>\n",
      text_in_page(summary.directory));
  for (const WorstPoint& one : summary.worst) {
    std::error_code ignored;
    const std::string log = "logs/" + one.point;
    out += fmt::format("<li>{} {}{}{}{}<code>{}</code></li>\n",
                       one.passed ? "passed" : "<b class=\"no\">failed</b>", one.point,
                       one.more_text(study), one.why.empty() ? "" : ": " + text_in_page(one.why),
                       std::filesystem::exists(summary.folder + "/" + log, ignored)
                           ? fmt::format(" (<a href=\"{}/\">log</a>)", log)
                           : "",
                       text_in_page(one.command));
  }
  return out + "</ol></div>\n";
}

/// The files beside the page.
std::string links(const SweepSummary& summary) {
  std::string out = "<p>";
  for (const char* file : {"results.csv", "results.sqlite", "times.csv", "logs"}) {
    std::error_code ignored;
    if (std::filesystem::exists(summary.folder + "/" + file, ignored))
      out += fmt::format("<a href=\"{0}\">{0}</a> ", file);
  }
  return out + "</p>\n";
}

}  // namespace

Status write_page(const std::string& path, const Study& study, const Points& points,
                  const std::vector<std::optional<PointResult>>& results,
                  const SweepSummary& summary) {
  const std::string title = text_in_page(study.file);
  const std::string html =
      fmt::format(
          "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
          "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"
          "<title>{0}</title><style>{1}</style></head><body><main>\n<h1>{0}</h1>\n"
          "<p>{2} of {3}, {4}. In pictures blue is where the expectation passed, "
          "red where it failed.</p>\n",
          title, kSweepStyle, counted(points.size(), "point"), text_in_page(study.experiment),
          study.method->words) +
      links(summary) + rates(study, summary) + worst(study, summary) + ranking(summary) +
      margins(study, points, results) + "</main></body></html>\n";
  apps::Draft draft = apps::Draft::file(path);
  if (const Status written = apps::write_file(draft.path(), html); !written)
    return std::unexpected(draft.placed(written.error()));
  return draft.place();
}

}  // namespace tandem::sweep
