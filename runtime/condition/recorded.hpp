// What a number of a run was in a recorded one: [[expect]] as_in.
// Layer: runtime/condition.  Thread: read() non-RT; at() the loop's.
#pragma once

#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "runtime/condition/condition.hpp"

namespace tandem::log {
class LogFile;
}

namespace tandem::runtime {

/// Samples over time, read before the run.
class Recorded {
 public:
  /// @param log  with every sample: require_samples()
  /// Errors: the log lacks a field or an element, with the nearest; numbers of the loop
  /// itself, which are of the computer.
  [[nodiscard]] static Result<Recorded> read(const Expression& expression,
                                             const QuantityNames& names, const log::LogFile& log);

  /// At a time of the run, on a line between two samples; NaN before the first, after the last, and
  /// where it was not measured. @rt no heap, no lock
  [[nodiscard]] double at(std::int64_t time_ns) const noexcept TANDEM_RT;
  [[nodiscard]] std::int64_t first_ns() const noexcept { return time_ns_.front(); }
  [[nodiscard]] std::int64_t last_ns() const noexcept { return time_ns_.back(); }

 private:
  std::vector<std::int64_t> time_ns_;
  std::vector<double> values_;
};

}  // namespace tandem::runtime
