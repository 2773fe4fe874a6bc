// Ranges and tick distances, and margins from the widths of the texts.
#include "report/layout.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/text/columns.hpp"

namespace tandem::report {
namespace {

using apps::columns_of;

constexpr double kLetter = 0.6;      // width of a letter, over the font's size
constexpr double kTitleFont = 15.0;  // points, when others have 13
constexpr double kOtherFont = 13.0;

/// Numbers along a logarithmic axis: powers of ten; more of each decade where these are few.
std::vector<double> log_ticks(double low, double high) {
  static const std::vector<double> kSteps[] = {
      {1},
      {1, 2, 5},
      {1, 1.5, 2, 3, 4, 5, 7},
      {1, 1.2, 1.4, 1.6, 1.8, 2, 2.5, 3, 4, 5, 6, 7, 8, 9}};
  const auto first = static_cast<int>(std::floor(std::log10(low)));
  const auto end = static_cast<int>(std::ceil(std::log10(high)));
  std::vector<double> ticks;
  for (const std::vector<double>& steps : kSteps) {
    ticks.clear();
    for (int decade = first; decade < end; ++decade) {
      const double power = std::pow(10.0, decade);
      for (const double step : steps)
        if (power * step >= low && power * step <= high) ticks.push_back(power * step);
    }
    if (ticks.size() >= 4) break;
  }
  return ticks;
}

/// Both axes logarithmic: half as much again beyond the positive values.
Axes log_axes(const Figure& figure) {
  Axes axes;
  for (const Curve& curve : figure.curves) {
    for (const double value : curve.x) axes.x.include(value > 0.0 ? value : NAN);
    for (const double value : curve.y) axes.y.include(value > 0.0 ? value : NAN);
  }
  for (const Level& level : figure.levels) axes.y.include(level.y);
  if (!(axes.x.low <= axes.x.high)) axes.x = {1.0, 10.0};
  if (!(axes.y.low <= axes.y.high)) axes.y = {1.0, 10.0};
  axes.x = {axes.x.low / 1.5, axes.x.high * 1.5};
  axes.y = {axes.y.low / 1.5, axes.y.high * 1.5};
  // Beside the place of 0 there is no other number.
  axes.x_ticks = log_ticks(std::max(axes.x.low, 2.0 * figure.zero_x), axes.x.high);
  axes.y_ticks = log_ticks(axes.y.low, axes.y.high);
  for (const double tick : axes.y_ticks)
    axes.widest = std::max(axes.widest, fmt::format("{:g}", tick).size());
  return axes;
}

/// Some six numbers along y, 1, 2 or 5 times a power of ten apart, and how wide they get.
void choose_numbers(Axes& axes) {
  const double raw = (axes.y.high - axes.y.low) / 6.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double share = raw / power;
  axes.step = power * (share < 1.5 ? 1.0 : share < 3.5 ? 2.0 : share < 7.5 ? 5.0 : 10.0);
  axes.decimals = std::max(0, -static_cast<int>(std::floor(std::log10(axes.step) + 1e-9)));
  axes.lowest = std::ceil(std::max(axes.y.low, axes.lowest_drawn) / axes.step - 1e-9) * axes.step;
  axes.widest = 0;
  for (const double end : {axes.lowest, axes.y.high}) {
    axes.widest = std::max(axes.widest, fmt::format("{:.{}f}", end, axes.decimals).size());
  }
  if (axes.widest > 9) {  // as 1.2e+09
    axes.step = 0.0;
    axes.widest = 9;
  }
}

std::vector<std::string> key_texts(const Figure& figure) {
  std::vector<std::string> texts;
  for (const Curve& curve : figure.curves) texts.push_back(key_text(curve));
  for (const Level& level : figure.levels) texts.push_back(level.label);
  for (const Mark& mark : figure.marks) texts.push_back(mark.label);
  std::erase(texts, "");
  return texts;
}

}  // namespace

void Extent::include(double value) {
  if (!std::isfinite(value)) return;
  low = std::min(low, value);
  high = std::max(high, value);
}

void Extent::widen(double share) {
  if (!(low <= high)) low = high = 0.0;
  const double margin = std::max((high - low) * share, 1e-6 + 1e-3 * std::abs(high));
  low -= margin;
  high += margin;
}

Axes axes_of(const Figure& figure) {
  if (figure.log_axes) return log_axes(figure);
  Axes axes;
  Extent beyond;
  for (const Curve& curve : figure.curves) {
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      axes.x.include(curve.x[i]);
      (curve.x[i] <= figure.range_until_x ? axes.y : beyond).include(curve.y[i]);
    }
  }
  if (!(axes.y.low <= axes.y.high)) axes.y = beyond;
  if (!figure.notes.empty()) axes.lowest_drawn = axes.y.low;
  for (const Level& level : figure.levels) axes.y.include(level.y);
  for (const Note& note : figure.notes) {
    axes.x.include(note.x);
    axes.y.include(note.y);
  }
  axes.y.widen(0.08);
  if (!figure.equal_axes) axes.x.widen(0.0);
  choose_numbers(axes);
  return axes;
}

FigureLayout layout_of(const Figure& figure, const Axes& axes, const Cell& cell) {
  const double font = cell.font;
  const double line = 1.35 * font;
  FigureLayout at{};
  at.label_x = cell.left + 0.9 * font;
  at.left = at.label_x + 1.3 * font + kLetter * font * static_cast<double>(axes.widest) + font;
  at.right = cell.left + cell.width - 1.6 * font;
  at.bottom = cell.bottom + (figure.x_label.empty() ? 0.6 : 3.0) * line;
  const double letters = (at.right - at.left) / (kLetter * font);
  const auto title = static_cast<double>(columns_of(figure.title));
  at.title_font = std::clamp(kOtherFont * letters / std::max(title, 1.0), 9.0, kTitleFont);
  at.title_y = cell.bottom + cell.height - line;
  at.key_y = at.title_y - 0.8 * line;
  std::size_t longest = 0;
  const std::vector<std::string> texts = key_texts(figure);
  for (const std::string& text : texts) longest = std::max(longest, columns_of(text));
  const double fit = letters * kOtherFont / kKeyFont / (static_cast<double>(longest) + 7.0);
  at.key_columns = std::clamp<std::size_t>(static_cast<std::size_t>(fit), 1,
                                           std::max<std::size_t>(texts.size(), 1));
  const std::size_t rows = (texts.size() + at.key_columns - 1) / at.key_columns;
  at.top = at.key_y - line * static_cast<double>(rows) - 0.5 * font;
  return at;
}

void make_equal(Axes& axes, const FigureLayout& at) {
  const double aspect = (at.right - at.left) / (at.top - at.bottom);
  const double wide =
      std::max(1.12 * (axes.x.high - axes.x.low), aspect * (axes.y.high - axes.y.low));
  const double more = 0.5 * (wide - (axes.x.high - axes.x.low));
  axes.x = {axes.x.low - more, axes.x.high + more};
  axes.y.high = axes.y.low + wide / aspect;
  choose_numbers(axes);
}

}  // namespace tandem::report
