// Time to detection of collisions against false alarms an hour.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "report/figure.hpp"

namespace tandem::report {

/// Pushes of one kind: a point for each threshold, all of equal length.
struct AlarmCurve {
  std::string label;                    ///< "50 N"
  std::vector<double> alarms_per_hour;  ///< counted; 0 stands at the left end
  std::vector<double> median_ms;        ///< not finite: fewer than half were found
  std::vector<double> worst_ms;         ///< not finite: one was not found
};

/// Two figures with a curve for each kind, up to six: of the median push, of the worst.
/// @param name   of the files, followed by _median and _worst
/// @param title  what is pushed, and where
[[nodiscard]] std::vector<Figure> alarm_figures(const std::string& name, const std::string& title,
                                                std::span<const AlarmCurve> curves);

}  // namespace tandem::report
