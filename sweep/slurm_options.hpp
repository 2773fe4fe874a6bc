// Options of sbatch that somebody gives beside those that a sweep sets itself.
// Layer: sweep.  Thread: any.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace tandem::sweep {

/// Errors: what is no long option of sbatch, one that the sweep itself sets, or that would part it
/// from its jobs, with what to give instead; one twice.
[[nodiscard]] Status check_sbatch(const std::vector<std::string>& options);

/// The value of the option `name`; none: it was not given.
[[nodiscard]] std::optional<std::string> sbatch_value(const std::vector<std::string>& options,
                                                      std::string_view name);

/// Minutes of a time as Slurm writes one: "90", "1:30:00", "2-12", "infinite". None: it is no time.
[[nodiscard]] std::optional<double> slurm_minutes(const std::string& text);

}  // namespace tandem::sweep
