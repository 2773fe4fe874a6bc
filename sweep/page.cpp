#include "sweep/page.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/text/draft.hpp"
#include "base/counted.hpp"
#include "base/quoting.hpp"
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
b.no { color: var(--bad); }
@media print { .card { break-inside: avoid; } }
)";

constexpr double kWide = 340.0, kHigh = 180.0, kLeft = 48.0, kRight = 8.0, kTop = 10.0,
                 kFoot = 22.0;
constexpr std::size_t kMostDots = 1'500;

std::string text_in_page(const std::string& text) { return xml_text(harmless(text)); }

/// What a figure shows of one point.
struct Dot {
  double x = 0.0, margin = 0.0;
  bool passed = false;  // the expectation
};

struct Span {
  double low = 0.0, high = 0.0;
  [[nodiscard]] double share(double value) const {
    return high > low ? (value - low) / (high - low) : 0.5;
  }
};

template <class Of>
Span span_of(const std::vector<Dot>& dots, Of of) {
  Span span{of(dots.front()), of(dots.front())};
  for (const Dot& dot : dots) {
    span.low = std::min(span.low, of(dot));
    span.high = std::max(span.high, of(dot));
  }
  return span;
}

double x_at(double share) { return kLeft + share * (kWide - kLeft - kRight); }
double y_at(double share) { return kHigh - kFoot - share * (kHigh - kTop - kFoot); }

std::string label(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x, y, anchor,
                     text_in_page(text));
}

std::string figure_begin(const std::string& what) {
  return fmt::format(
      "<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\"><line class=\"axis\" "
      "x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>",
      kWide, kHigh, text_in_page(what), kLeft, kHigh - kFoot, kWide - kRight, kHigh - kFoot);
}

std::string ends_of_axis(const Span& span, const std::string& unit) {
  return label(kLeft, kHigh - 6.0, "start", fmt::format("{:.3g}", span.low)) +
         label(kWide - kRight, kHigh - 6.0, "end", fmt::format("{:.3g} {}", span.high, unit));
}

/// A number at a height, left of the figure.
std::string beside_axis(double value, double share) {
  return label(kLeft - 5.0, y_at(share) + 4.0, "end", fmt::format("{:.3g}", value));
}

/// How many points have which margin; those that failed in the other color.
std::string histogram(const std::vector<Dot>& dots, const NamedMargin& margin) {
  constexpr std::size_t kBars = 24;
  const Span span = span_of(dots, [](const Dot& dot) { return dot.margin; });
  std::array<std::array<std::size_t, 2>, kBars> counts{};
  std::size_t most = 1;
  for (const Dot& dot : dots) {
    const auto bar = std::min<std::size_t>(
        kBars - 1, static_cast<std::size_t>(span.share(dot.margin) * static_cast<double>(kBars)));
    ++counts[bar][dot.passed ? 1 : 0];
    most = std::max(most, counts[bar][0] + counts[bar][1]);
  }
  std::string out = figure_begin("how many points have which margin of " + margin.name);
  const auto height = [&](std::size_t count) {
    return static_cast<double>(count) / static_cast<double>(most);
  };
  for (std::size_t bar = 0; bar < kBars; ++bar) {
    double base = 0.0;
    for (const std::size_t passed : {std::size_t{0}, std::size_t{1}}) {
      const double high = height(counts[bar][passed]);
      if (high == 0.0) continue;
      const double x = x_at(static_cast<double>(bar) / kBars);
      out += fmt::format(
          "<rect class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>",
          passed == 1 ? "good" : "bad", x, y_at(base + high), x_at(1.0 / kBars) - kLeft - 1.0,
          y_at(base) - y_at(base + high));
      base += high;
    }
  }
  if (span.low < 0.0 && span.high > 0.0) {
    const double x = x_at(span.share(0.0));
    out += fmt::format(
        "<line class=\"zero\" x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{0:.1f}\" y2=\"{2:.1f}\"/>", x,
        kTop, kHigh - kFoot);
  }
  out += beside_axis(static_cast<double>(most), 1.0) + beside_axis(0.0, 0.0);
  return out + ends_of_axis(span, margin.unit) + "</svg>";
}

/// The margin over what varies: full dots failed.
std::string scatter(const std::vector<Dot>& dots, const NamedMargin& margin,
                    const std::string& key) {
  const Span x = span_of(dots, [](const Dot& dot) { return dot.x; });
  const Span y = span_of(dots, [](const Dot& dot) { return dot.margin; });
  std::string out = figure_begin("the margin of " + margin.name + " over " + key);
  if (y.low < 0.0 && y.high > 0.0) {
    out += fmt::format(
        "<line class=\"zero\" x1=\"{1:.1f}\" y1=\"{0:.1f}\" x2=\"{2:.1f}\" y2=\"{0:.1f}\"/>",
        y_at(y.share(0.0)), kLeft, kWide - kRight);
  }
  out += "<g class=\"dots\">";
  const std::size_t every = 1 + (dots.size() - 1) / kMostDots;
  for (std::size_t i = 0; i < dots.size(); i += every) {
    out += fmt::format("<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\"/>",
                       dots[i].passed ? "good" : "bad", x_at(x.share(dots[i].x)),
                       y_at(y.share(dots[i].margin)));
  }
  out += "</g>";
  out += beside_axis(y.high, 1.0) + beside_axis(y.low, 0.0);
  return out + ends_of_axis(x, "") + "</svg>";
}

std::string rate_words(const PassRate& rate) {
  const Interval interval = rate.interval();
  return fmt::format("{:.1f} % of {} passed, {:.1f} to {:.1f} %",
                     100.0 * static_cast<double>(rate.passed) /
                         static_cast<double>(std::max<std::uint64_t>(1, rate.all)),
                     rate.all, 100.0 * interval.low, 100.0 * interval.high);
}

std::string rates(const Study& study, const SweepSummary& summary) {
  std::string out = fmt::format("<p class=\"rate\">{}</p>\n<p>Wilson's interval, 95 %. ",
                                rate_words(summary.rate));
  for (const auto& [ended, count] : summary.ends)
    out += fmt::format("{} ended {}. ", count, text_in_page(ended));
  out += "</p>\n";
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
      "maximum in between.</p><div class=\"card\"><table><thead><tr><th>key</th><th class=\"text\">"
      "margin of</th><th>rank correlation</th><th>points</th></tr></thead><tbody>\n";
  for (const Sensitivity& one : summary.ranking) {
    out += fmt::format(
        "<tr><td>{}</td><td class=\"text\">{}</td><td>{:+.2f}</td><td>{}</td></tr>\n",
        text_in_page(one.key), text_in_page(one.expectation), one.rank_correlation, one.points);
  }
  return out + "</tbody></table></div>\n";
}

std::string margins(const Study& study, const Points& points,
                    const std::vector<std::optional<PointResult>>& results) {
  std::string out;
  for (const NamedMargin& margin : margins_of(results)) {
    std::vector<Dot> dots;
    std::vector<std::uint64_t> indices;
    for (std::size_t i = 0; i < results.size(); ++i) {
      const auto* one = results[i] ? expectation_in(*results[i], margin.name) : nullptr;
      if (one == nullptr || !one->margin) continue;
      dots.push_back({.x = 0.0, .margin = *one->margin, .passed = one->passed});
      indices.push_back(i);
    }
    if (dots.empty()) continue;
    out += fmt::format(
        "<h2>{}</h2>\n<div class=\"figures\"><div class=\"card\"><h3>margin{}: {}</h3>{}</div>\n",
        text_in_page(margin.name),
        margin.unit.empty() ? "" : " [" + text_in_page(margin.unit) + "]",
        dots.size() == results.size()
            ? counted(dots.size(), "point")
            : fmt::format("{} of {} points have one", dots.size(), results.size()),
        histogram(dots, margin));
    for (std::size_t k = 0; k < study.vary.size(); ++k) {
      for (std::size_t i = 0; i < dots.size(); ++i)
        dots[i].x = number_of(study.vary[k], points.at(indices[i]).values[k]);
      out += fmt::format("<div class=\"card\"><h3>margin{} over {}</h3>{}</div>\n",
                         margin.unit.empty() ? "" : " [" + text_in_page(margin.unit) + "]",
                         text_in_page(study.vary[k].key), scatter(dots, margin, study.vary[k].key));
    }
    out += "</div>\n";
  }
  return out;
}

std::string worst(const SweepSummary& summary) {
  std::string out =
      "<h2>Worst points</h2><p>Each expectation's margin is taken as a multiple of its usual size. "
      "The command repeats the point, with a log.</p><div class=\"card\"><ol>\n";
  for (const WorstPoint& one : summary.worst) {
    out += fmt::format(
        "<li>{} {}{}<code>{}</code></li>\n", one.passed ? "passed" : "<b class=\"no\">failed</b>",
        one.point, one.why.empty() ? "" : ": " + text_in_page(one.why), text_in_page(one.command));
  }
  return out + "</ol></div>\n";
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
          "<p>{2} of {3}, {4}. Blue: passed; red: failed.</p>\n",
          title, kSweepStyle, counted(points.size(), "point"), text_in_page(study.experiment),
          study.method->words) +
      rates(study, summary) + worst(summary) + ranking(summary) + margins(study, points, results) +
      "</main></body></html>\n";
  apps::Draft draft = apps::Draft::file(path);
  if (const Status written = apps::write_file(draft.path(), html); !written)
    return std::unexpected(draft.placed(written.error()));
  return draft.place();
}

}  // namespace tandem::sweep
