#include "report/alarm_figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::report {
namespace {

constexpr CurveStyle kStyles[] = {CurveStyle::kMeasured, CurveStyle::kSecond, CurveStyle::kFourth,
                                  CurveStyle::kFifth,    CurveStyle::kSixth,  CurveStyle::kThird};

/// Of more there is always one: no threshold that anybody takes.
constexpr double kMostAlarms_per_hour = 3600.0;

/// What is not counted or not found interrupts the line.
Curve drawn(const AlarmCurve& one, CurveStyle style, const std::vector<double>& time_ms) {
  Curve curve{one.label, style, {}, {}};
  for (std::size_t i = 0; i < time_ms.size(); ++i) {
    const double rate = one.alarms_per_hour[i];
    const bool known = rate > 0.0 && rate <= kMostAlarms_per_hour && std::isfinite(time_ms[i]);
    constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
    curve.x.push_back(known ? rate : kGap);
    curve.y.push_back(known ? time_ms[i] : kGap);
  }
  return curve;
}

}  // namespace

std::vector<Figure> alarm_figures(const std::string& name, const std::string& title,
                                  std::span<const AlarmCurve> curves) {
  std::vector<Figure> figures(2);
  for (const bool worst : {false, true}) {
    Figure& figure = figures[worst ? 1 : 0];
    figure.name = name + (worst ? "_worst" : "_median");
    figure.title = title + (worst ? ": the worst push" : ": the median push");
    figure.x_label = "false alarms an hour, counted";
    figure.y_label = "time to detection [ms]";
    figure.log_axes = true;
    for (std::size_t c = 0; c < std::min(curves.size(), std::size(kStyles)); ++c)
      figure.curves.push_back(
          drawn(curves[c], kStyles[c], worst ? curves[c].worst_ms : curves[c].median_ms));
  }
  return figures;
}

}  // namespace tandem::report
