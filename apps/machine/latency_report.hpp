// What a latency measurement amounts to: table, JSON, plots.
// Layer: apps/machine.  Thread: main.
#pragma once

#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "apps/machine/latency_measure.hpp"
#include "apps/text/figures.hpp"
#include "base/result.hpp"
#include "report/figure.hpp"
#include "report/report.hpp"

namespace tandem::apps {

/// What a percentile of ours is to cyclictest's; NaN when that is 0.
struct LatencyRatio {
  double p50, p99, p999, max;
};
[[nodiscard]] LatencyRatio ratio_of(const rt::Percentiles& ours, const rt::Percentiles& theirs);

void print_latency(const LatencyPlan& plan, std::span<const LatencySample> samples, std::FILE* out);

/// What `tandem latency` measured.
struct LatencyResult {
  LatencyPlan plan;
  std::span<const LatencySample> samples;
};
void figures(Figures& f, const LatencyResult& result);

/// Per load a histogram, and the share of wake-ups that come later than a time.
[[nodiscard]] std::vector<report::Figure> latency_figures(std::span<const LatencySample> samples);

/// Draws them as `folder`/report.html and PNG files. Errors: as report::draw() and write_page().
[[nodiscard]] Result<report::ReportFiles> draw_latency(const LatencyPlan& plan,
                                                       std::span<const LatencySample> samples,
                                                       const std::string& folder);

}  // namespace tandem::apps
