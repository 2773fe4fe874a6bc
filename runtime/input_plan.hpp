// Samples of an input that are known before the run: a timeline, a file of one, a log.
// Layer: runtime.  Thread: made non-RT; then plain data.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "controllers/inputs.hpp"
#include "runtime/input_source.hpp"

namespace tandem::runtime {

/// Each in the cycle in which it arrives.
struct InputPlan {
  std::vector<std::uint64_t> at;    ///< cycles, growing
  std::vector<double> values;       ///< InputBlock::values() of each
  std::vector<std::size_t> number;  ///< of each: its row in the timeline, its line in the file;
                                    ///< empty of a log
  bool of_run = false;              ///< counted from the run's first cycle, not the controller's
  std::uint64_t repeat_cycles = 0;  ///< 0: each once

  [[nodiscard]] std::span<const double> row(std::size_t index, std::size_t size) const noexcept {
    return std::span(values).subspan(index * size, size);
  }
};

/// What the plan needs to know of its input.
struct PlannedInput {
  const InputBlock& block;
  std::string controller;
  std::span<const double> without;  ///< what a component that is not given has
  std::int64_t period_ns;
  std::function<Status(std::span<const double>)> check;  ///< of a sample
};

/// The timeline, CSV file or log that `source` names. Empty for the other sources.
/// Errors, with file and line where there is one: components that the input lacks; times that fall;
/// a sample that does not pass the check; a file that cannot be read; a log without this input.
[[nodiscard]] Result<InputPlan> make_plan(const PlannedInput& input, const InputSource& source);

/// Numbers by the components' names as a sample. Errors: unknown components (the nearest is
/// suggested).
[[nodiscard]] Result<std::vector<double>> sample_of(const InputBlock& block,
                                                    std::span<const double> without,
                                                    std::span<const std::string> components,
                                                    std::span<const double> numbers);

}  // namespace tandem::runtime
