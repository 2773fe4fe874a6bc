// A sweep on a cluster: `tandem sweep STUDY --slurm`, `sweep status` and `sweep cancel`.
// Layer: apps/run.  Thread: main.
#pragma once

#include <string>

#include "apps/command_line/command_line.hpp"
#include "apps/run/prepared_study.hpp"
#include "sweep/slurm_job.hpp"

namespace tandem::apps {

/// Submits the chunks of a study that miss points and are not in the queue; with `dry_run` it
/// prints the script and the commands instead.
[[nodiscard]] Exit submit_sweep(const SweepOptions& options, const sweep::Study& study,
                                const sweep::Points& points, const PreparedStudy& prepared);

/// Prints how far the sweep in a folder is, on this machine and on the cluster.
[[nodiscard]] Exit sweep_status(const SweepOptions& options);

/// Takes what it submitted out of the queue. Results stay.
[[nodiscard]] Exit cancel_sweep(const SweepOptions& options);

/// What was submitted. Errors: nothing was; it cannot be read.
[[nodiscard]] Result<sweep::SlurmJob> submitted_in(const std::string& folder);

}  // namespace tandem::apps
