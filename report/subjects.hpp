// Which joints and sensors of a run its figures show.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <string>
#include <vector>

#include "report/run_data.hpp"

namespace tandem::report {

/// Which joints and sensor the figures show.
struct Subjects {
  int position_of = -1;           ///< joint in the image
  int torque_of = -1;             ///< the same
  std::vector<int> foot_sensors;  ///< force/torque sensors in the image, the chosen one first
};

/// What the experiment's [report] says. Where it is silent: the first two pitch joints of the
/// first foot's leg, and the force/torque sensors of the legs; on a robot without such legs the
/// two joints that move most. So it is where the joint of the first figure stands while others
/// move.
[[nodiscard]] Subjects subjects_of(const RunData& run);

/// Whether the robot has feet.
[[nodiscard]] inline bool legged(const RunData& run) { return !run.robot.contact.feet.empty(); }

/// Which links lie beyond a joint, away from the root.
[[nodiscard]] std::vector<bool> links_beyond(const RunData& run, const std::string& joint);

}  // namespace tandem::report
