// The figures of a run: position of one joint, force in the feet, torque of another joint, posture;
// of two or three runs, laid over each other.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/kernels.h"
#include "report/figure.hpp"
#include "report/page.hpp"
#include "report/run_data.hpp"
#include "report/subjects.hpp"

namespace tandem::report {

/// Runs that are laid over another, of the same robot.
using OtherRuns = std::vector<const RunData*>;
inline constexpr std::size_t kMostOthers = 2;

/// @param kernels  of the run's robot, for the torque that inverse dynamics gives; null: without.
/// @param others   laid over `run`; kMostOthers at most
/// @return those that have something to draw; the posture is the last one
[[nodiscard]] std::vector<Figure> figures_of(const RunData& run, const OtherRuns& others,
                                             const tandem_kernels* kernels);

/// What the times of a run's log count from, as a label.
[[nodiscard]] std::string time_label(const RunData& run);

/// Upward force [N] that a six-axis sensor measured, turned into the world by the run's posture.
[[nodiscard]] std::vector<double> vertical_force(const RunData& run, int sensor);

// parallel_figures.cpp: a robot and the one that was simulated beside it, first minus second.

/// Position and torque differences of the joints where they are largest, and the difference of the
/// vertical force in the first six-axis sensor that is shown.
[[nodiscard]] std::vector<Figure> difference_figures(const RunData& run, const RunData& second);

/// Every joint's, the largest difference of torque first.
[[nodiscard]] PageTable differences_table(const RunData& run, const RunData& second);

// wrench_figures.cpp: what a run estimated at the places of its [[estimation.wrench]].

/// Two figures of each place, "external_force_SITE" and "external_moment_SITE" (about the site's
/// origin): x, y, z in W, over the run's own rows. None where nothing was declared.
/// Errors: as log::LogFile::open() and read(), of a log that changed since the run was read.
[[nodiscard]] Result<std::vector<Figure>> wrench_figures(const RunData& run);

// signal_figures.cpp: what a run's controllers told of themselves.

/// A figure of each signal, "signal_CONTROLLER-SIGNAL", in every cycle of its controller; of a
/// signal with many numbers those that change most. What is not drawn is a remark.
/// Errors: as log::LogFile::open() and read(), of a log that changed since the run was read.
[[nodiscard]] Result<std::vector<Figure>> signal_figures(const RunData& run,
                                                         std::vector<std::string>& remarks);

}  // namespace tandem::report
