// A study whose files, kernels and controllers are read: what its points are made of.
// Layer: apps/run.  Thread: main.
#pragma once

#include <expected>
#include <memory>
#include <string>
#include <vector>

#include "apps/command_line/command_line.hpp"
#include "apps/run/connection.hpp"
#include "base/open_file.hpp"
#include "sweep/results.hpp"
#include "sweep/study.hpp"

namespace tandem::apps {

/// Everything that the points are made of, read once: kernels and plugins stay loaded, so a process
/// that is forked from this one has them.
struct PreparedStudy {
  TextsInstead::Texts texts;                              ///< of the files, as they stand there
  std::vector<std::unique_ptr<WiredComposition>> worlds;  ///< the first point of each variant
  std::string kernel_variant;  ///< of every point, on any CPU; empty: the study's settings say it
  sweep::SweepHead head;
};

/// One run whose files, kernels and controllers are loaded, for others that are forked from here.
struct LoadedRun {
  TextsInstead::Texts texts{};
  std::unique_ptr<WiredComposition> world{};  ///< null: it cannot be run with these values
};
[[nodiscard]] LoadedRun load_run(const RunOptions& options);

/// @param kernel_variant  empty: the best that this CPU runs
/// Errors: those of the experiment with the first values of each variant.
[[nodiscard]] std::expected<PreparedStudy, Diagnostics> prepare_study(
    const sweep::Study& study, const sweep::Points& points, const std::string& kernel_variant,
    bool quiet);

/// The kernel variant of the sweep in a folder; empty: none is there, or its study says it.
/// Errors: those of head_in().
[[nodiscard]] Result<std::string> kernel_variant_in(const std::string& folder);

}  // namespace tandem::apps
