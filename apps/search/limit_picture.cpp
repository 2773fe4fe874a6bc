#include "apps/search/limit_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "sweep/pictures.hpp"

namespace tandem::apps {
namespace {

constexpr double kPanel = 240.0, kRadius = 88.0, kHead = 56.0, kFoot = 54.0, kTitle = 26.0;
constexpr std::size_t kColumns = 3;

constexpr const char* kStyle = R"(<style>
svg { background: #fff; } text { font: 11px system-ui, "DejaVu Sans", sans-serif; fill: #5b6470; }
.head { font-size: 15px; fill: #1d242c; } .name { font-size: 12px; fill: #1d242c; }
.grid { fill: none; stroke: #d5dbe2; } .between { fill: #b3261e; fill-opacity: 0.16; }
.passed { fill: #cfe0f3; stroke: #1f5fa8; stroke-width: 1.5; }
.good { fill: #1f5fa8; } .bad { fill: #b3261e; } .open { fill: #fff; stroke: #1f5fa8; }
</style>
)";

/// The numbers of "[1.0, 0.0, 0.0]"; empty: it is something else.
std::vector<double> numbers_in(const std::string& value) {
  std::vector<double> numbers;
  if (!value.starts_with('[') || !value.ends_with(']')) return numbers;
  const char* at = value.c_str() + 1;
  while (*at != ']' && *at != '\0') {
    char* end = nullptr;
    numbers.push_back(std::strtod(at, &end));
    if (end == at) return {};
    for (at = end; *at == ' ' || *at == ',';) ++at;
  }
  return numbers;
}

struct Place {
  double x = 0.0, y = 0.0;
};

/// Where in a panel something is: forwards is up, and the left is left.
struct Polar {
  double center_x = 0.0, center_y = 0.0, most = 1.0;
  [[nodiscard]] Place at(const LimitInDirection& one, double size) const {
    const double s = kRadius * size / most;
    return {center_x - one.y * s, center_y - one.x * s};
  }
};

std::string label(double x, double y, const char* anchor, const std::string& text,
                  const char* kind = "") {
  return fmt::format("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n",
                     kind, x, y, anchor, sweep::text_in_page(text));
}

std::string dot(Place at, double radius, const char* kind) {
  return fmt::format("<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"/>\n", kind,
                     at.x, at.y, radius);
}

std::string polygon(const std::vector<Place>& places, const char* kind) {
  std::string points;
  for (const Place& one : places) points += fmt::format("{:.1f},{:.1f} ", one.x, one.y);
  return fmt::format("<polygon class=\"{}\" points=\"{}\"/>\n", kind, points);
}

/// 1, 2 or 5 times a power of ten, of which three or four rings fit.
double ring_step(double most) {
  const double power = std::pow(10.0, std::floor(std::log10(most / 3.0)));
  for (const double of : {1.0, 2.0, 5.0})
    if (of * power * 4.0 >= most) return of * power;
  return 10.0 * power;
}

std::string grid(const Polar& polar, const std::string& unit) {
  std::string out;
  const double step = ring_step(polar.most);
  int rings = 1;
  for (; (rings + 1) * step <= polar.most * 1.0001;) ++rings;
  for (int i = 1; i <= rings; ++i) {
    const double r = kRadius * i * step / polar.most;
    out += dot({polar.center_x, polar.center_y}, r, "grid");
    out += label(polar.center_x + r * 0.71 + 2.0, polar.center_y + r * 0.71 + 8.0, "start",
                 fmt::format("{:g}{}", i * step, i == rings ? " " + unit : ""));
  }
  out += label(polar.center_x, polar.center_y - kRadius - 8.0, "middle", "forwards") +
         label(polar.center_x, polar.center_y + kRadius + 16.0, "middle", "backwards") +
         label(polar.center_x - kRadius - 4.0, polar.center_y - 3.0, "middle", "left") +
         label(polar.center_x + kRadius + 6.0, polar.center_y - 3.0, "middle", "right");
  return out;
}

/// Lines between directions guide the eye: dots are what was run.
std::string curves(const Polar& polar, const LimitPanel& panel, double scale) {
  std::vector<LimitInDirection> all = panel.directions;
  std::ranges::sort(all, {}, [](const auto& one) { return std::atan2(one.y, one.x); });
  std::vector<Place> passed, failed;
  std::string dots;
  for (const LimitInDirection& one : all) {
    const double most = one.passed.value_or(0.0), least = one.failed.value_or(most);
    passed.push_back(polar.at(one, scale * most));
    failed.push_back(polar.at(one, scale * least));
    if (one.failed) dots += dot(failed.back(), 1.6, "bad");
    if (one.passed) dots += dot(passed.back(), 2.4, one.failed ? "good" : "open");
  }
  if (all.size() < 3) return dots;
  return polygon(failed, "between") + polygon(passed, "passed") + dots;
}

}  // namespace

Status can_be_drawn(const sweep::Study& study, const std::string& key) {
  const auto wrong = [&](std::string message, std::string hint) {
    return std::unexpected(Error{
        .message = std::move(message), .hint = std::move(hint), .file = study.file, .key = "vary"});
  };
  if (study.vary.size() > 2)
    return wrong("a picture has directions, and one more key: a panel for each of its values",
                 "leave out --svg, or the other [[vary]]");
  for (const sweep::Vary& one : study.vary) {
    if (one.key != key) continue;
    for (const std::string& value : one.values) {
      const std::size_t size = numbers_in(value).size();
      if (size != 2 && size != 3)
        return wrong("'" + value + "' is no direction, which a picture has",
                     "leave out --svg, or give lists of three numbers");
    }
  }
  return {};
}

std::vector<LimitPanel> panels_of(
    const sweep::Study& study, const std::string& key,
    const std::vector<std::pair<std::optional<double>, std::optional<double>>>& limits) {
  std::vector<LimitPanel> panels;
  const sweep::Points points(study);
  for (std::uint64_t i = 0; i < points.size() && i < limits.size(); ++i) {
    const sweep::Point point = points.at(i);
    std::string title;
    LimitInDirection one{.passed = limits[i].first, .failed = limits[i].second};
    for (std::size_t k = 0; k < study.vary.size(); ++k) {
      if (study.vary[k].key != key) {
        title = study.vary[k].key + " = " + point.values[k];
        continue;
      }
      const std::vector<double> numbers = numbers_in(point.values[k]);
      one.x = numbers[0];
      one.y = numbers[1];
    }
    auto panel = std::ranges::find(panels, title, &LimitPanel::title);
    if (panel == panels.end())
      panel = panels.insert(panels.end(), {.title = title, .directions = {}});
    panel->directions.push_back(one);
  }
  return panels;
}

std::string unit_of_key(const std::string& key) {
  const std::size_t from = key.rfind('_');
  return from == std::string::npos || key.find('.', from) != std::string::npos
             ? std::string()
             : key.substr(from + 1);
}

std::string drawn(const LimitPicture& picture) {
  double most = 0.0;
  for (const LimitPanel& panel : picture.panels) {
    for (const LimitInDirection& one : panel.directions) {
      const double factor = std::max(one.passed.value_or(0.0), one.failed.value_or(0.0));
      most = std::max(most, picture.scale * factor * std::hypot(one.x, one.y));
    }
  }
  if (most <= 0.0) most = 1.0;
  const std::size_t columns = std::min(kColumns, std::max<std::size_t>(1, picture.panels.size()));
  const std::size_t rows = (picture.panels.size() + columns - 1) / columns;
  const double width = kPanel * static_cast<double>(std::max<std::size_t>(2, columns));
  const double height = kHead + static_cast<double>(rows) * (kPanel + kTitle) + kFoot;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" role=\"img\" aria-label=\"{2}\">\n",
      width, height, sweep::text_in_page(picture.title));
  out += kStyle;
  out += fmt::format("<rect width=\"{:.0f}\" height=\"{:.0f}\" fill=\"#fff\"/>\n", width, height);
  out += label(12.0, 22.0, "start", picture.title, "head");
  out += label(12.0, 40.0, "start", picture.below);
  for (std::size_t i = 0; i < picture.panels.size(); ++i) {
    const double left = kPanel * static_cast<double>(i % columns);
    const double top = kHead + (kPanel + kTitle) * static_cast<double>(i / columns);
    const Polar polar{
        .center_x = left + kPanel / 2.0, .center_y = top + kTitle + kPanel / 2.0, .most = most};
    out += label(polar.center_x, top + 16.0, "middle", picture.panels[i].title, "name");
    out += curves(polar, picture.panels[i], picture.scale) + grid(polar, picture.unit);
  }
  const double foot = height - kFoot + 20.0;
  out +=
      dot({18.0, foot - 4.0}, 2.4, "good") + label(26.0, foot, "start", "the greatest that passed");
  out +=
      dot({178.0, foot - 4.0}, 1.6, "bad") + label(186.0, foot, "start", "the least that failed");
  out += dot({318.0, foot - 4.0}, 2.4, "open") + label(326.0, foot, "start", "none failed");
  out += label(12.0, foot + 18.0, "start",
               "Direction: that of the force. Dots were run; lines between them guide the eye.");
  return out + "</svg>\n";
}

}  // namespace tandem::apps
