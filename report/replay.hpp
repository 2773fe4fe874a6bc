// Whether a run replays another one's log, and from when on: for runs that are laid over each
// other. Layer: report.  Thread: non-RT only.
#pragma once

#include <optional>
#include <vector>

#include "report/page.hpp"
#include "report/run_data.hpp"

namespace tandem::report {

/// A run of `recorded_motion` (docs/controllers.md).
struct Replay {
  std::vector<std::size_t> joints;  ///< that it leads, in the image's order
  double begin_s = 0.0;             ///< when the motion begins, of the run's time
  double speed = 1.0;               ///< times as fast as recorded
  double from_s = 0.0, to_s = 0.0;  ///< what is played, of the recording's time

  /// The run's time of a place of the recording.
  [[nodiscard]] double run_time_s(double recorded_s) const {
    return begin_s + (recorded_s - from_s) / speed;
  }
};

/// Empty: `run` does not play `recording`, by the data_sha256 that its experiment names; or its
/// references are not the recording's anywhere, at the experiment's speed. They are looked for
/// where approach_s puts them, and then in every later cycle: a run-up may be longer, and commands
/// delayed. Errors: as log::read_joint_motion().
[[nodiscard]] Result<std::optional<Replay>> find_replay(const RunData& run,
                                                        const RunData& recording);

/// Every joint's measured position in the replay minus the recording's at the same place of the
/// motion, the largest first; of the references alike, where both have them.
[[nodiscard]] PageTable replay_table(const RunData& run, const RunData& recording,
                                     const Replay& replay);

}  // namespace tandem::report
