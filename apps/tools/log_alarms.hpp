// Learned collision thresholds on logs of other runs: false alarms and times to detection.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "apps/text/console.hpp"
#include "apps/tools/log_torques.hpp"
#include "base/result.hpp"
#include "estimation/alarm_curve.hpp"

namespace tandem::apps {

/// A run and its log.
struct NamedTorques {
  std::string path;
  ExternalTorques torques;
};

/// Alarms and detection times in runs that the thresholds were not learned from.
struct AlarmTable {
  std::vector<double> factors;        ///< on the thresholds, rising to 1.25
  double free_s = 0.0;                ///< before each run's first push, in whole blocks of 0.2 s
  std::vector<std::uint64_t> alarms;  ///< by factor: blocks with one
  struct Pushes {
    std::string name;  ///< the log's, without folder; with it where two are called the same
    std::vector<estimation::DetectionTimes::Summary> by_factor;  ///< times in ms
  };
  std::vector<Pushes> pushed;  ///< of logs with pushes
  [[nodiscard]] double per_hour(std::size_t factor) const;
};

/// Each push is watched for 0.2 s at most, until the next.
[[nodiscard]] AlarmTable alarm_table(const std::vector<NamedTorques>& runs,
                                     const std::vector<double>& thresholds_Nm);
void print_alarms(const AlarmTable& table, std::FILE* out);
[[nodiscard]] Json alarms_json(const AlarmTable& table);
/// Writes `folder`/report.html and PNG files. @return the page's path
/// Errors: gnuplot is missing; a file cannot be written; there is no push.
[[nodiscard]] Result<std::string> write_alarm_page(const AlarmTable& table,
                                                   const std::string& folder);

}  // namespace tandem::apps
