// A sweep on a cluster: `tandem sweep STUDY --slurm`, `sweep status` and `sweep cancel`.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/command_line/command_line.hpp"
#include "apps/run/prepared_study.hpp"
#include "apps/text/figures.hpp"
#include "sweep/slurm_job.hpp"

namespace tandem::apps {

/// Submits the chunks of a study that miss points and are not in the queue; with `dry_run` it
/// prints the script and the commands instead.
[[nodiscard]] Exit submit_sweep(const SweepOptions& options, const sweep::Study& study,
                                const sweep::Points& points, const PreparedStudy& prepared);

/// Chunks that miss points and are not in the queue, by what they said last.
struct EndedEarly {
  std::string words;
  std::uint64_t chunks = 0, first = 0;
};

/// How far a sweep is.
struct SweepStatus {
  std::string folder;
  std::uint64_t points = 0, done = 0, failed = 0;
  bool submitted = false, queue_known = false;
  std::optional<std::uint64_t> running{}, waiting{};  ///< chunks; none: nobody knows
  std::optional<double> points_a_second{}, left_s{};
  std::vector<EndedEarly> ended_early{};
  std::string again{};  ///< the command that submits what is missing; empty: nothing is
};
void figures(Figures& f, const EndedEarly& one);
void figures(Figures& f, const SweepStatus& status);
/// Errors: there is no sweep; squeue fails.
[[nodiscard]] Result<SweepStatus> status_of_sweep(const std::string& folder);

/// Prints how far the sweep in a folder is, on this machine and on the cluster.
[[nodiscard]] Exit sweep_status(const SweepOptions& options);

/// Takes what it submitted out of the queue. Results stay.
[[nodiscard]] Exit cancel_sweep(const SweepOptions& options);

/// What was submitted. Errors: nothing was; it cannot be read.
[[nodiscard]] Result<sweep::SlurmJob> submitted_in(const std::string& folder);

}  // namespace tandem::apps
