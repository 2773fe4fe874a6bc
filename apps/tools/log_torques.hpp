// External torques of a log, where its robot was under control.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <vector>

#include "base/result.hpp"
#include "log/log_file.hpp"

namespace tandem::apps {

struct ExternalTorques {
  std::vector<double> time_s;
  std::vector<std::vector<double>> torque_Nm;  ///< by felt_channels(), as long as time_s
  /// When an injected push began, while the robot moved: none after a stop, of which a collision
  /// may be the cause.
  std::vector<double> push_s;
  /// Rows before the first push: motion that touched nothing.
  [[nodiscard]] std::size_t free_rows() const;
  /// Torques of all channels. @param row  of time_s
  [[nodiscard]] std::vector<double> at(std::size_t row) const;
};

/// What of the robot has thresholds: its joints and, of a log with the base's external wrench,
/// estimation::kBaseChannels.
[[nodiscard]] std::vector<std::string> felt_channels(const log::LogFile& file);

/// From the bring-up, or `from_s` of the log's time, to the controllers' end, a request to stop, or
/// the first fault; but a collision, which may have been warned of only.
/// Errors: no external torques in the log; torques that are not finite; a log cut in the middle.
[[nodiscard]] Result<ExternalTorques> read_external_torques(const log::LogFile& file,
                                                            double from_s);

}  // namespace tandem::apps
