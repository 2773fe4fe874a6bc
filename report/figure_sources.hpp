// Figures as signals of the studio's page: each curve over the rows of a recording.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "report/figure.hpp"
#include "report/spans.hpp"
#include "studio/signal_table.hpp"

namespace tandem::report {

/// The curves of a figure that are of one log, and its levels with those of the first.
struct FigurePart {
  const Figure* figure = nullptr;
  std::vector<const Curve*> curves{};
  std::vector<Level> levels{};
  std::string prefix{};        ///< before the name of its source, as RecordedLog::prefix
  studio::SignalId first = 0;  ///< where its signals begin
};
[[nodiscard]] std::vector<FigurePart> parts_of(const Figure& figure);

/// Adds a part as a source, "B/report/joint_position": its curves and levels are signals. So the
/// page draws them as it does the same signal of several logs.
/// @return their full names. Errors: SignalTable::add()'s.
[[nodiscard]] Result<std::vector<std::string>> add_source(const FigurePart& part,
                                                          studio::SignalTable& table);
/// The numbers of a part into its signals.
void add_curves(const FigurePart& part, Spans& spans);

}  // namespace tandem::report
