// What a run amounts to: for the JSON file and for the table at its end.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "apps/control/run_figures.hpp"
#include "apps/run/connection.hpp"
#include "apps/run/cycle_thread.hpp"
#include "apps/run/dds_run.hpp"
#include "apps/run/gate.hpp"
#include "apps/run/parallel_summary.hpp"
#include "apps/text/console.hpp"
#include "hal/remote/server.hpp"
#include "internal_model/parallel_robot.hpp"
#include "log/recorder.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// "29 axes enabled after 0.211 s, …"; empty without a master, or before that.
[[nodiscard]] std::string start_text(const hal::can::DriveMaster* master);

/// What the log's record "result" tells of the master, and of a plant that is not the model.
[[nodiscard]] log::StringMap result_of(const WiredComposition& c, const runtime::RobotCycle& cycle);

struct RunSummary {
  const WiredComposition& composition;
  const runtime::RobotCycle& cycle;
  RunTimes times;
  std::optional<log::RecordingResult> log;                   ///< empty: nothing was logged
  std::optional<hal::can::FrameRecord::Result> frames;       ///< empty: none were recorded
  std::vector<std::string> faults;                           ///< the log's trouble included
  std::optional<DdsResult> dds;                              ///< empty: it was off
  std::optional<internal_model::ParallelResult> parallel;    ///< empty: there was no second robot
  const internal_model::Differences* differences = nullptr;  ///< with it
  const remote::Server* server = nullptr;         ///< null: nobody could own the robot from afar
  std::optional<std::vector<GateResult>> gate{};  ///< empty: without --gate

  /// Under the controllers, of the run that it goes on from (`--from`): this one did not make them.
  std::uint64_t cycles_before = 0;
  double begins_s = 0.0;  ///< of its own time: not 0 where it goes on from another run

  int interrupted_by = 0;  ///< the signal that asked the run to end; 0: none did

  /// Cycles under the controllers that the run was to have; 0: it has no planned end.
  [[nodiscard]] std::uint64_t planned_cycles() const;
  /// Whether a signal ended it before its planned end.
  [[nodiscard]] bool cut_short() const;
  /// How it ended: "as planned", "interrupted by SIGINT", "on request", …; "by a fault" when one is
  /// latched and nobody interrupted it.
  [[nodiscard]] std::string ended() const;
  /// Those of its figures that are no program's.
  [[nodiscard]] RunFigures run() const;
  /// Simulated here, while controllers ran.
  [[nodiscard]] double simulated_s() const;
  /// That by wall clock, while controllers ran; 0: they did not.
  [[nodiscard]] double realtime_factor() const;
  [[nodiscard]] std::optional<ParallelSummary> parallel_summary() const;
  /// Its figures.
  [[nodiscard]] Json json() const;
  void print(std::FILE* out) const;
  /// What was tolerated: missing feedback, refused values; a link that was silent at the end.
  [[nodiscard]] std::vector<std::string> warnings() const;
  /// How many faults, pushes and payloads were due after its end.
  [[nodiscard]] std::size_t never_injected() const;
};

/// docs/json.md, `tandem run`
void figures(Figures& f, const RunSummary* s);

}  // namespace tandem::apps
