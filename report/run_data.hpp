// A run read back from its log: what was measured, what was asked for, what is known.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "log/log_file.hpp"
#include "model/tree.hpp"

namespace tandem::report {

/// Columns over the cycles in which controllers ran: [joint][row], [channel][row], …
using Columns = std::vector<std::vector<double>>;

/// How well a joint under position control followed. Of a prismatic joint: m and N.
struct Tracking {
  std::string joint;
  bool slides = false;  ///< prismatic
  double rms_rad = 0.0;
  double max_rad = 0.0;
  double max_torque_Nm = 0.0;  ///< the largest magnitude measured
};

/// What the ground did to a foot, by the simulation's truth.
struct FootFigures {
  std::string name;           ///< of its site
  double mean_force_N = 0.0;  ///< vertical
  double max_force_N = 0.0;
  double slip_m = 0.0;  ///< farthest, level, from where it last touched down
};

/// What stopped or disturbed a run, by its log's events.
struct RunFault {
  double time_s = 0.0;  ///< since the first SYNC
  std::string joint;    ///< empty: nobody's
  std::string text;     ///< one sentence, without `joint`
  bool stops = true;    ///< false: it was reported, and the run went on
};

/// A controller's parameter in a run: what it was at the start, and what became of it.
struct RunParameter {
  std::string name;         ///< "squat.depth_m"
  std::string start;        ///< of a controller that came later: then
  std::string then{};       ///< what it was set to last, and when; empty: nothing was set
  std::size_t changes = 0;  ///< how often it was set
};

/// What was done to a run, or happened in it, and is no fault: a mark in its figures.
struct RunMark {
  double time_s = 0.0;  ///< since the first SYNC
  std::string kind;     ///< "payload picked up", "payload dropped", "parameter set", "gains set",
                        ///< "limit met"
  std::string text;     ///< of the event: "payload picked up: box, 1.6 kg on panda_hand"
};

/// Faults of a run that are shown in the page, and as lines in its figures.
inline constexpr std::size_t kFaultsShown = 5;

/// A drive's error code in words.
using ErrorText = std::function<std::string(std::uint32_t code)>;

/// Times are those of the log: 0 is its first cycle, the run's first SYNC.
struct RunData {
  std::string path;
  log::RunInfo info;
  log::StringMap result;             ///< log::LogFile::shown_result()
  std::string cut_reason;            ///< log::LogFile::cut_reason(); empty: it is whole
  std::vector<std::string> remarks;  ///< log::LogFile::remarks()
  std::string data_sha256;

  hal::RobotConfig robot;  ///< as it was logged
  model::Tree tree;
  std::string position_of, torque_of, foot;  ///< the experiment's [report]; may be empty
  std::vector<std::string> wrenches;         ///< sites of its [[estimation.wrench]]

  double first_s = 0.0, last_s = 0.0;             ///< which times the log has
  std::vector<std::pair<double, double>> gaps_s;  ///< which times between them it lacks
  bool start_known = true;       ///< false: the log begins later than the drives' bring-up
  double settle_s = 0.0;         ///< from bring-up to the controllers' start
  bool controllers_ran = true;   ///< false: the rows are those in which they were waited for
  double step_s = 0.0;           ///< between rows, where none is missing
  std::vector<double> time_s;    ///< of each row; the first is the controllers' first cycle
  double drawn_later_s = 0.0;    ///< added to all times of this run in the figures,
  double drawn_slower = 1.0;     ///< after they were multiplied by this
  bool drawn_as_replay = false;  ///< so that a replay lies over its recording
  double drawn_from_s = -std::numeric_limits<double>::infinity();  ///< of the figures' times: only
  double drawn_to_s = std::numeric_limits<double>::infinity();     ///< rows in these are drawn
  std::vector<RunFault> faults;                                    ///< in the order of their times
  std::vector<RunParameter> parameters;                            ///< of its controllers
  std::vector<RunMark> marks;                                      ///< the same
  Columns position_rad, velocity_rad_s, torque_Nm;                 ///< [joint][row], measured
  Columns reference_rad;    ///< [joint][row]; NaN when not under position control
  Columns sensor;           ///< [channel][row], all sensors one after another
  Columns drive_fault;      ///< [joint][row]: error codes; empty: the log has none
  Columns base;             ///< [13][row]: position, quaternion xyzw, velocity of the base
                            ///< in its frame; by the truth or, without it, by the run's
                            ///< estimate; empty without either
  Columns foot_position_m;  ///< [3 feet][row]: origin of each foot's site in W; empty as base
  Columns foot_force_N;     ///< [3 feet][row]: of the ground on each foot, W axes; empty as base
  Columns foot_moment_Nm;   ///< [3 feet][row]: about the site's origin, W axes; empty as base
  Columns loop_error;       ///< [2 loop][row]: each loop's position error [m], then each one's
                            ///< velocity error [m/s]; empty as base
  Columns passive_rad;      ///< [passive joint][row]; empty: unknown (close_passive.hpp)

  [[nodiscard]] std::size_t rows() const { return time_s.size(); }
  /// Where a time of this run is in the figures.
  [[nodiscard]] double drawn(double at_s) const { return drawn_slower * at_s + drawn_later_s; }
  /// Whether a time of this run is within those that are drawn.
  [[nodiscard]] bool is_drawn(double at_s) const {
    return drawn(at_s) >= drawn_from_s && drawn(at_s) <= drawn_to_s;
  }
  /// The fault that stopped the run; null: none did.
  [[nodiscard]] const RunFault* stop() const;
  /// Rows until stop(), its cycle included; the others show what followed. At least 1.
  [[nodiscard]] std::size_t rows_before_stop() const;
  /// From the controllers' start to their stop, or to the end of what is here [s]; 0: none ran.
  [[nodiscard]] double ran_s() const;
  /// First channel of sensor `index` in `sensor`.
  [[nodiscard]] std::size_t first_channel(std::size_t index) const;
  /// The root link in W; upright at the origin when nobody knows.
  [[nodiscard]] model::Placement base_placement(std::size_t row) const;
  /// Every joint's position at a row, in the image's order, then the passive ones'.
  [[nodiscard]] std::vector<double> positions(std::size_t row) const;
  /// A joint's column without what its board repeats while one of its sensors gives no number
  /// (NaN).
  [[nodiscard]] std::vector<double> measured(const Columns& columns, std::size_t joint) const;
  /// Whether a joint (image) is prismatic: its columns are m, m/s and N then.
  [[nodiscard]] bool slides(std::size_t joint) const;
  bool estimated = false;  ///< base, foot forces and moments are the run's estimate

  /// Whether the log has where the base was and what the ground did.
  [[nodiscard]] bool motion_known() const { return !base.empty(); }
  /// The same, by the simulation's truth.
  [[nodiscard]] bool truth() const { return motion_known() && !estimated; }
  /// Joints that were under position control, the worst first.
  [[nodiscard]] std::vector<Tracking> tracking() const;
  /// One per foot; none when the log has no truth.
  [[nodiscard]] std::vector<FootFigures> feet() const;
};

/// The robot that was simulated beside the run's ([parallel]), over the run's own rows; its command
/// is the run's. Empty: there was none.
/// Errors: as read_run(); a log that has less of it than two of those rows.
[[nodiscard]] Result<std::optional<RunData>> read_parallel(const RunData& run);

/// Errors: as log::LogFile::open; a log without state and command; one without its robot's files.
/// @param error_text  of drives; empty: faults go by their codes
[[nodiscard]] Result<RunData> read_run(const std::string& path, const ErrorText& error_text = {});

}  // namespace tandem::report
