// When the controllers of a logged run ran.
// Layer: log.  Thread: non-RT only.
#pragma once

#include <vector>

#include "base/result.hpp"
#include "base/toml_reader.hpp"
#include "log/event.hpp"
#include "log/mcap_format.hpp"

namespace tandem::log {

/// [s] A log counts whole nanoseconds: two of its times in seconds are the same one when they
/// differ by less than this.
inline constexpr double kHalfNanosecond = 0.5e-9;

/// Times of the log [s]; what did not happen is far away.
struct RunWindow {
  double bring_up_s = -1e300;  ///< its end
  double begin_s = -1e300;     ///< of the controllers
  double end_s = 1e300;        ///< of the controllers
  double fault_s = 1e300;      ///< the first, also one that was only reported
  double stop_s = 1e300;       ///< the first fault that stopped the robot
};

/// How long every joint was held before the controllers started, as the experiment says or by
/// default (docs/configuration.md, [hal] settle_s).
[[nodiscard]] double settle_time_s(TomlTable& experiment);

/// The same of the experiment among a log's files; 0 when there is none.
[[nodiscard]] double settle_time_s(const StringMap& configuration);

/// When controllers ran, by the events: after bring-up and `settle_s`.
[[nodiscard]] RunWindow run_window(const std::vector<EventText>& events, double settle_s);

}  // namespace tandem::log
