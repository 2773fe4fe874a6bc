#include "sweep/pictures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "base/quoting.hpp"

namespace tandem::sweep {
namespace {

constexpr double kWide = 340.0, kHigh = 180.0, kRight = 8.0, kTop = 10.0, kFoot = 22.0;
constexpr double kLetter = 6.3;  // of the labels, at most on average
constexpr std::size_t kMostDots = 1'500;
constexpr const char* kLane = "no margin";  // of those that failed

struct Span {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] bool any() const { return low <= high; }
  [[nodiscard]] double share(double value) const {
    return high > low ? (value - low) / (high - low) : 0.5;
  }
};

Span span_of_margins(const std::vector<MarginOfPoint>& points) {
  Span span;
  for (const MarginOfPoint& one : points)
    if (one.has_margin()) span.take(one.margin);
  return span;
}

/// The place of what is drawn: labels are left of it and below.
struct Plot {
  double left = 48.0, foot = kHigh - kFoot;
  [[nodiscard]] double x(double share) const { return left + share * (kWide - left - kRight); }
  [[nodiscard]] double y(double share) const { return foot - share * (foot - kTop); }
};

double width_of(const std::string& text) { return kLetter * static_cast<double>(text.size()); }

std::string label(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x, y, anchor,
                     text_in_page(text));
}

std::string line(const char* kind, double x1, double y1, double x2, double y2) {
  return fmt::format("<line class=\"{}\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>",
                     kind, x1, y1, x2, y2);
}

std::string picture_begin(const std::string& what) {
  return fmt::format("<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\">", kWide,
                     kHigh, text_in_page(what));
}

/// A value of a list below its place: the whole is its title.
std::string value_labels(const Plot& plot, const Span& x, const std::vector<std::string>& values) {
  const std::size_t most = 6, every = 1 + (values.size() - 1) / most;
  const double slot = (kWide - plot.left - kRight) /
                      static_cast<double>(std::max<std::size_t>(1, (values.size() - 1) / every));
  const auto letters = static_cast<std::size_t>(std::max(3.0, slot / kLetter / 1.3));
  std::string out;
  for (std::size_t i = 0; i < values.size(); i += every) {
    const double share = x.share(static_cast<double>(i));
    std::string text = values[i];
    if (text.size() >= 2 && text.front() == '"') text = text.substr(1, text.size() - 2);
    const std::string whole = text;
    if (text.size() > letters) text = text.substr(0, letters - 1) + "~";
    out += "<g><title>" + text_in_page(whole) + "</title>" +
           label(plot.x(share), kHigh - 6.0,
                 share < 0.1   ? "start"
                 : share > 0.9 ? "end"
                               : "middle",
                 text) +
           "</g>";
  }
  return out;
}

bool is_number(const std::string& value) {
  char* end = nullptr;
  (void)std::strtod(value.c_str(), &end);
  return !value.empty() && *end == '\0';
}

}  // namespace

std::string text_in_page(const std::string& text) { return xml_text(harmless(text)); }

std::pair<std::string, std::string> ends_in_words(double low, double high) {
  for (int digits = 3; digits < 17; ++digits) {
    std::pair ends{fmt::format("{:.{}g}", low, digits), fmt::format("{:.{}g}", high, digits)};
    const double off = std::max(std::abs(std::strtod(ends.first.c_str(), nullptr) - low),
                                std::abs(std::strtod(ends.second.c_str(), nullptr) - high));
    if (off <= 0.01 * (high - low) || low == high) return ends;
  }
  return {fmt::format("{}", low), fmt::format("{}", high)};
}

std::string histogram(const std::vector<MarginOfPoint>& points, const NamedMargin& margin) {
  constexpr std::size_t kBars = 24;
  const Span span = span_of_margins(points);
  std::array<std::array<std::size_t, 2>, kBars> counts{};
  std::size_t without = 0, most = 1;
  for (const MarginOfPoint& one : points) {
    if (!one.has_margin()) {
      most = std::max(most, ++without);
      continue;
    }
    const auto bar = std::min<std::size_t>(
        kBars - 1, static_cast<std::size_t>(span.share(one.margin) * static_cast<double>(kBars)));
    ++counts[bar][one.failed ? 0 : 1];
    most = std::max(most, counts[bar][0] + counts[bar][1]);
  }
  const Plot all;
  const Plot plot{.left = without > 0 ? all.left + 62.0 : all.left};
  std::string out = picture_begin("how many points have which margin of " + margin.name);
  out += line("axis", plot.left, plot.foot, kWide - kRight, plot.foot);
  const auto height = [&](std::size_t count) {
    return static_cast<double>(count) / static_cast<double>(most);
  };
  const auto bar_from = [&](double x, double width, double base, double high, const char* kind) {
    return fmt::format(
        "<rect class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>", kind,
        x, plot.y(base + high), width, plot.y(base) - plot.y(base + high));
  };
  for (std::size_t bar = 0; bar < kBars; ++bar) {
    double base = 0.0;
    for (const std::size_t passed : {std::size_t{0}, std::size_t{1}}) {
      const double high = height(counts[bar][passed]);
      if (high == 0.0) continue;
      out +=
          bar_from(plot.x(static_cast<double>(bar) / kBars), plot.x(1.0 / kBars) - plot.left - 1.0,
                   base, high, passed == 1 ? "good" : "bad");
      base += high;
    }
  }
  if (without > 0) {
    out += line("axis", all.left, all.foot, all.left + 44.0, all.foot) +
           bar_from(all.left + 14.0, 14.0, 0.0, height(without), "bad") +
           label(all.left - 4.0, kHigh - 6.0, "start", kLane);
  }
  if (span.low < 0.0 && span.high > 0.0)
    out += line("zero", plot.x(span.share(0.0)), kTop, plot.x(span.share(0.0)), plot.foot);
  out += label(all.left - 5.0, plot.y(1.0) + 4.0, "end", fmt::format("{}", most)) +
         label(all.left - 5.0, plot.y(0.0) + 4.0, "end", "0");
  if (span.any()) {
    const auto [low, high] = ends_in_words(span.low, span.high);
    out += label(plot.left, kHigh - 6.0, "start", low) +
           label(kWide - kRight, kHigh - 6.0, "end",
                 high + (margin.unit.empty() ? "" : " " + margin.unit));
  }
  return out + "</svg>";
}

std::string scatter(const std::vector<MarginOfPoint>& points, std::vector<double> x,
                    const NamedMargin& margin, const Vary& vary) {
  const bool logarithmic = vary.distribution != nullptr && vary.distribution->logarithmic;
  Span across, ends;
  for (double& one : x) {
    ends.take(one);
    if (logarithmic) one = std::log(one);
    across.take(one);
  }
  const Span up = span_of_margins(points);
  const bool lane = std::ranges::any_of(points, [](const auto& one) { return !one.has_margin(); });
  const auto [low, high] = up.any() ? ends_in_words(up.low, up.high) : std::pair("", "");
  const Plot plot{
      .left = std::max({48.0, 8.0 + width_of(low), 8.0 + width_of(high), lane ? 62.0 : 0.0}),
      .foot = lane ? kHigh - kFoot - 26.0 : kHigh - kFoot};
  const double lane_y = kHigh - kFoot - 8.0;
  std::string out = picture_begin("the margin of " + margin.name + " over " + vary.key);
  out += line("axis", plot.left, kHigh - kFoot, kWide - kRight, kHigh - kFoot);
  if (up.low < 0.0 && up.high > 0.0)
    out += line("zero", plot.left, plot.y(up.share(0.0)), kWide - kRight, plot.y(up.share(0.0)));
  if (lane) {
    out += line("axis", plot.left, plot.foot + 7.0, kWide - kRight, plot.foot + 7.0) +
           label(plot.left - 5.0, lane_y + 4.0, "end", kLane);
  }
  out += "<g class=\"dots\">";
  const std::size_t every = 1 + (points.size() - 1) / kMostDots;
  for (std::size_t i = 0; i < points.size(); i += every) {
    const MarginOfPoint& one = points[i];
    out += fmt::format("<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\"/>",
                       one.failed ? "bad" : "good", plot.x(across.share(x[i])),
                       one.has_margin() ? plot.y(up.share(one.margin)) : lane_y);
  }
  out += "</g>";
  if (up.any()) {
    out += label(plot.left - 5.0, plot.y(up.high > up.low ? 1.0 : 0.5) + 4.0, "end", high);
    if (up.high > up.low) out += label(plot.left - 5.0, plot.y(0.0) + 4.0, "end", low);
  }
  if (!std::ranges::all_of(vary.values, is_number)) {
    const Span places{.low = across.low, .high = across.high};
    return out + value_labels(plot, places, vary.values) + "</svg>";
  }
  const auto [first, last] = ends_in_words(ends.low, ends.high);
  if (ends.high > ends.low) out += label(plot.left, kHigh - 6.0, "start", first);
  return out +
         label(ends.high > ends.low ? kWide - kRight : plot.x(0.5), kHigh - 6.0,
               ends.high > ends.low ? "end" : "middle", last + (logarithmic ? " (log)" : "")) +
         "</svg>";
}

}  // namespace tandem::sweep
