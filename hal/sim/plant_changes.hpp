// What of a simulated robot is other than its files say: [sim.link], [sim.joint] and
// [[sim.payload]] of an experiment. Controllers, estimators, boards and reports keep to the files.
// Layer: hal/sim.  Thread: non-RT to fill; immutable afterwards.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/fault_injection.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// The plant's own robot. Its tree has the joints, bodies and links of the described one.
struct PlantChanges {
  hal::RobotConfig robot;              ///< with the plant's actuators and passive joints
  model::Tree tree;                    ///< with the plant's masses, and what it always carries
  std::vector<double> zero_error_rad;  ///< per joint: what its encoders read too much; or empty
  std::vector<ScenarioFault> carried;  ///< kPayload: what comes and goes
  std::vector<ScenarioFault> kept;     ///< kPayload: what is carried for good; `tree` has it, too
  /// "box, 1.6 kg on panda_hand": by the `number` of those, from 1.
  std::vector<std::string> payloads;
  /// Everything, for people: "link panda_link4: mass_kg = 3", "payload box, 1.6 kg on panda_hand,
  /// from 5 s to 9 s".
  std::vector<std::string> differences;
  std::string ground;    ///< patches and terrain as tables of TOML: for the log
  Diagnostics warnings;  ///< of what is allowed, and hardly meant
};

}  // namespace tandem::sim
