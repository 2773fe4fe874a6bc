// What a monitoring system reads of a run: Prometheus' text format 0.0.4, by a table of rows.
// Layer: apps/run.  Thread: any but the loop's, one at a time.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "apps/run/connection.hpp"
#include "log/recorder.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// Where the rows look. All outlive what reads them.
struct MetricSource {
  const WiredComposition& run;
  runtime::RobotCycle& cycle;
  const log::Recorder* recorder = nullptr;  ///< null: nothing is logged
};

/// Samples of one row, as they are written.
class MetricSamples {
 public:
  MetricSamples(std::string_view name, std::string& out) : name_(name), out_(out) {}
  /// @param labels  "phase", "running", in pairs; whatever their text
  void add(double value, std::initializer_list<std::string_view> labels = {},
           std::string_view ending = {});

 private:
  std::string_view name_;
  std::string& out_;
};

struct MetricRow {
  const char* name;  ///< ends in its unit, a counter in "_total"
  const char* type;  ///< "counter", "gauge", "histogram"
  const char* unit;  ///< for people
  const char* help;  ///< one sentence
  void (*samples)(const MetricSource& from, MetricSamples& to);
};
[[nodiscard]] std::span<const MetricRow> metric_rows();

/// The Content-Type of metrics_text().
inline constexpr char kMetricsType[] = "text/plain; version=0.0.4; charset=utf-8";
/// Every row that has samples.
[[nodiscard]] std::string metrics_text(const MetricSource& from);

}  // namespace tandem::apps
