// The robots and experiments that come with Tandem, by name: the one place that looks for them.
// Layer: base.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace tandem {

/// What a name may stand for.
enum class Bundled : std::uint8_t {
  kRobot,              ///< "coman" is coman/robot.toml, "coman/robot_hands" another of the folder
  kExperiment,         ///< "coman/squat" is coman/squat.toml
  kRobotOrExperiment,  ///< either
  kTests,              ///< an experiment, or a folder of them: "suite"
  kStudy,              ///< what a sweep varies: "studies/coman_push"
  kScenario            ///< faults: "coman/faults/board_dies"
};

/// The folders in which names are looked for, the first first: config/ in the working directory, of
/// an installation, and of the sources that this build is of.
[[nodiscard]] std::vector<std::filesystem::path> bundled_folders();

/// Every name of this kind, in order, each once.
[[nodiscard]] std::vector<std::string> bundled_names(Bundled kind);

/// The file that `given` means: the path itself where there is such a file or folder, or where it
/// can only be a path ("./x", "/x", "x.toml" that nobody has: its reader says why); else the
/// bundled file of this name. Errors: there is neither, with the nearest name.
[[nodiscard]] Result<std::string> named_file(const std::string& given, Bundled kind);

}  // namespace tandem
