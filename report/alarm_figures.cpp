#include "report/alarm_figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::report {
namespace {

constexpr CurveStyle kStyles[] = {CurveStyle::kMeasured, CurveStyle::kSecond, CurveStyle::kFourth,
                                  CurveStyle::kFifth,    CurveStyle::kSixth,  CurveStyle::kThird};

/// Where no alarm stands on the logarithmic axis: left of the fewest that were counted.
double place_of_none(std::span<const AlarmCurve> curves) {
  double least = std::numeric_limits<double>::infinity();
  for (const AlarmCurve& one : curves) {
    for (const double rate : one.alarms_per_hour)
      if (rate > 0.0) least = std::min(least, rate);
  }
  return std::isfinite(least) ? least / 5.0 : 1.0;
}

/// What was not found interrupts the line.
Curve drawn(const AlarmCurve& one, CurveStyle style, const std::vector<double>& time_ms,
            double none) {
  Curve curve{one.label, style, {}, {}};
  for (std::size_t i = 0; i < time_ms.size(); ++i) {
    const double rate = one.alarms_per_hour[i];
    const double time = std::isfinite(time_ms[i]) ? time_ms[i] : NAN;
    curve.x.push_back(rate > 0.0 ? rate : none);
    curve.y.push_back(time);
  }
  return curve;
}

}  // namespace

std::vector<Figure> alarm_figures(const std::string& name, const std::string& title,
                                  std::span<const AlarmCurve> curves) {
  std::vector<Figure> figures(2);
  const double none = place_of_none(curves);
  for (const bool worst : {false, true}) {
    Figure& figure = figures[worst ? 1 : 0];
    figure.name = name + (worst ? "_worst" : "_median");
    figure.title = title + (worst ? ": the worst push" : ": the median push");
    figure.x_label = "false alarms an hour, counted";
    figure.y_label = "time to detection [ms]";
    figure.log_axes = true;
    figure.points = true;
    figure.zero_x = none;
    for (std::size_t c = 0; c < std::min(curves.size(), std::size(kStyles)); ++c)
      figure.curves.push_back(
          drawn(curves[c], kStyles[c], worst ? curves[c].worst_ms : curves[c].median_ms, none));
  }
  return figures;
}

}  // namespace tandem::report
