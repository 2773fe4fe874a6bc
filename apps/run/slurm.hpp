// Slurm's client programs: what they are asked, and what they answer.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace tandem::apps {

/// Whether they are installed. Error: they are not.
[[nodiscard]] Status find_slurm();

/// The site's MaxArraySize: an element's index is below it.
/// Errors: scontrol fails; the site has no job arrays.
[[nodiscard]] Result<std::uint64_t> max_array_size();

/// How long a job of a partition may take, of several the longest [minutes]; infinite: nobody says
/// so. @param partitions  "long,short"; empty: the site's default
/// Errors: sinfo fails; the site has no such partition.
[[nodiscard]] Result<double> partition_minutes(const std::string& partitions);

/// Submits a script as an array. @param list  of its indices  @param argument  of the script
/// @return the job's number. Errors: sbatch fails, with what it says; it names no job.
[[nodiscard]] Result<std::uint64_t> submit_array(const std::string& script, const std::string& list,
                                                 std::uint64_t argument);

/// An element of an array of this user's that waits or runs.
struct QueuedElement {
  std::uint64_t job = 0, index = 0;
  bool runs = false;
};
/// Errors: squeue fails, with what it says.
[[nodiscard]] Result<std::vector<QueuedElement>> queued_elements();

/// Ends these jobs. Errors: scancel fails, with what it says.
[[nodiscard]] Status cancel_jobs(const std::vector<std::uint64_t>& jobs);

}  // namespace tandem::apps
