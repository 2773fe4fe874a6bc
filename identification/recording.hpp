// A log made ready for identification: signals on one time grid, with NaN where they cannot be
// used, and a remark for everything that was left out.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::identification {

using Signal = std::vector<double>;  ///< a sample per grid time

/// What of a log was left out, for one reason.
struct LeftOut {
  std::string log;                                ///< its path
  std::string what;                               ///< which signal, and why
  double sum_s = 0.0;                             ///< of all its stretches
  double first_begin_s = 0.0, first_end_s = 0.0;  ///< of the first one, since the log's time 0
};

/// Joints and channels in the order of the robot's configuration, whatever the log's is.
struct Recording {
  std::string path;
  std::string data_sha256;  ///< of the log; empty: it is none
  double period_s = 0.0;
  double voltage_hold_s = 0.0;             ///< see read_recording(); 0: nothing is held
  int hold_steps = 1;                      ///< of the simulation in it
  double unknown_hold_s = 0.0;             ///< how long another one may be; 0: none
  bool out_of_step = false;                ///< see read_recording()
  bool hangs = false;                      ///< the whole log, from a hoist
  std::vector<double> time_s;              ///< since the log's time 0
  std::vector<Signal> position_rad;        ///< per joint, link side
  std::vector<Signal> torque_Nm;           ///< per joint, on the link
  std::vector<Signal> motor_position_rad;  ///< per joint; all NaN when the log lacks it
  std::vector<Signal> current_A;           ///< the same
  std::vector<Signal> reference_rad;       ///< commanded; the same. For checks only
  std::vector<Signal> sensor;              ///< per channel of all sensors
  std::vector<std::string> remarks;        ///< one sentence for everything excluded
  std::vector<LeftOut> left_out;  ///< stretches of a signal; each is among the remarks, too

  [[nodiscard]] std::size_t rows() const { return time_s.size(); }
};

/// In a simulated log the voltage of a motor is held for voltage_hold_s, in hold_steps steps of the
/// simulation, and everything is sampled at the end: by then a joint without a spring has given way
/// to the back-EMF, and its torque and its acceleration are smaller than on the hold's mean
/// (voltage_hold.hpp). Other logs have none. Those have an unknown hold of up to a control period.
/// A simulated one is out of step where the boards' control has another period than the log:
/// torques between two samples are not known then, and differ from those at the samples by more
/// than the back-EMF.
///
/// Reads the part of a log in which controllers ran, puts it on a grid and takes out what lies:
/// gaps, NaN, samples that are old, signals that stand still while the robot moves, torques that
/// are cut off. Holes of up to five samples are bridged by straight lines.
///
/// Errors: as log::LogFile; joints or sensors of another robot; time that goes backwards or stands
/// still; hardly any samples; a joint whose position is never valid; no torque of any joint, and no
/// six-axis sensor.
[[nodiscard]] Result<Recording> read_recording(const std::string& path,
                                               const hal::RobotConfig& robot);

inline constexpr std::size_t kBridge_samples = 5;  ///< that a straight line replaces

/// The checks of read_recording() on signals at hand; each answers a remark, or nothing.
/// @param recording  in: raw; out: NaN where it cannot be used
void bridge_holes(Recording& recording);
void exclude_frozen(Recording& recording, const hal::RobotConfig& robot);
void exclude_clipped(Recording& recording, const hal::RobotConfig& robot);
/// Values that a slow PDO repeats are replaced by lines between those that are new.
void undo_holds(Signal& signal);

}  // namespace tandem::identification
