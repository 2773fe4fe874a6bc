// Finds, checks and opens a multibody engine, and refuses what it cannot simulate.
// Layer: hal/sim.  Thread: non-RT only.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/keys.hpp"
#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/engine.hpp"

namespace tandem::sim {

/// Tandem's own engine: the generated kernels, the plant's integrators and its ground.
inline constexpr const char* kOwnEngine = "tandem";

/// The names that `[sim] engine` knows, installed or not; kOwnEngine first. Debian's package of
/// another one is libNAME-dev.
inline constexpr const char* kEngineChoices = "tandem|mujoco|dart|bullet|ode|simbody";
[[nodiscard]] inline std::vector<std::string> known_engines() {
  return offered_words(kEngineChoices);
}
/// Those that were built with this program, in the same order, without kOwnEngine.
[[nodiscard]] std::vector<std::string> installed_engines();

/// Opens the library of engine `name`; it stays open.
/// Errors: a name that is not known; an engine that is not installed, with the Debian package that
/// it needs; a library that others may change, that cannot be loaded or is of another version.
[[nodiscard]] Result<const EnginePlugin*> load_engine(const std::string& name);

/// "2.2.2"; empty for kOwnEngine, and for one that cannot be loaded.
[[nodiscard]] std::string engine_version(const std::string& name);
/// "mujoco 2.2.2"; empty as engine_version() is.
[[nodiscard]] std::string engine_text(const std::string& name);

/// The robot in the engine `name`. @param tree  the robot's description
/// Errors: those of load_engine(); what this engine cannot do, by name: closed loops, followers,
/// rotors of rigid drives, `rk4`; what the engine says of the model.
[[nodiscard]] Result<std::unique_ptr<Engine>> make_engine(const std::string& name,
                                                          const hal::RobotConfig& robot,
                                                          const model::Tree& tree, double step_s,
                                                          bool rk4 = false);

}  // namespace tandem::sim
