#include "estimation/alarm_curve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::estimation {

double worst_ratio(std::span<const double> external_torque_Nm,
                   std::span<const double> threshold_Nm) {
  double ratio = 0.0;
  for (std::size_t j = 0; j < threshold_Nm.size(); ++j)
    ratio = std::max(ratio, std::abs(external_torque_Nm[j]) / threshold_Nm[j]);
  return ratio;
}

void FalseAlarms::begin_run() {
  in_block_ = 0;
  worst_ = 0.0;
}

void FalseAlarms::look(std::span<const double> external_torque_Nm) {
  worst_ = std::max(worst_, worst_ratio(external_torque_Nm, threshold_Nm_));
  if (++in_block_ < block_) return;
  blocks_.push_back(worst_);
  begin_run();
}

std::uint64_t FalseAlarms::alarms(double factor) const {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(blocks_, [factor](double ratio) { return ratio > factor; }));
}

DetectionTimes::DetectionTimes(std::span<const double> threshold_Nm,
                               std::span<const double> factors)
    : threshold_Nm_(threshold_Nm.begin(), threshold_Nm.end()),
      factors_(factors.begin(), factors.end()) {}

void DetectionTimes::begin_push() {
  found_.emplace_back(factors_.size(), std::numeric_limits<double>::infinity());
  cycle_ = 0.0;
}

void DetectionTimes::look(std::span<const double> external_torque_Nm) {
  const double ratio = worst_ratio(external_torque_Nm, threshold_Nm_);
  cycle_ += 1.0;
  for (std::size_t f = 0; f < factors_.size(); ++f)
    if (ratio > factors_[f]) found_.back()[f] = std::min(found_.back()[f], cycle_);
}

DetectionTimes::Summary DetectionTimes::with(std::size_t factor) const {
  std::vector<double> times;
  for (const auto& push : found_) times.push_back(push[factor]);
  if (times.empty()) return {};
  std::ranges::sort(times);
  return {.pushes = times.size(),
          .found = static_cast<std::size_t>(
              std::ranges::count_if(times, [](double t) { return std::isfinite(t); })),
          .median = times[times.size() / 2],
          .worst = times.back()};
}

}  // namespace tandem::estimation
