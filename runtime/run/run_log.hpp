// The log of a run: where it goes, and what it says about itself.
// Layer: runtime/run.  Thread: main.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "log/recorder.hpp"
#include "runtime/run/composition.hpp"

namespace tandem::runtime {

/// "EtherCAT" when the robot has no other bus, else "CAN".
[[nodiscard]] std::string wire_name(const hal::RobotConfig& robot);

/// "sim", "can", "can lockstep", "ethercat", "dds", "dds lockstep", for logs and summaries.
[[nodiscard]] std::string hal_name(const Experiment& e);

/// What integrates the bodies' motion: "leapfrog", "Runge-Kutta 4"; of another engine, as it says.
[[nodiscard]] std::string integrator_name(const Experiment& e);
/// "leapfrog, 250 us steps", for logs and summaries.
[[nodiscard]] std::string integrator_text(const Experiment& e);

/// Makes `folder`, and room for the run's log in it: the oldest logs of runs before go, where they
/// may. Errors: open_log()'s of folder and room.
[[nodiscard]] Status make_log_room(const Composition& composition, const std::string& folder);

/// Opens FOLDER/ROBOT-EXPERIMENT-NNN.mcap, the next free number, or FOLDER/FILE.
///
/// @param folder  created when it is missing.
/// @param file    empty: as above
/// @param branch  where the run goes on from a log; of none: it does not
/// Errors, before anything has moved: the folder cannot be made or written; the disk has less
/// room than the run will write; the file is there already.
[[nodiscard]] Result<std::unique_ptr<log::Recorder>> open_log(const Composition& composition,
                                                              const std::string& folder,
                                                              const std::string& file = {},
                                                              const log::Branch& branch = {});

/// How fast the log at `path` grows, and for how long there is room: "at most 0.84 MB for each
/// second; the disk has room for 6.1 h of it".
[[nodiscard]] std::string log_growth(const Composition& composition, const std::string& path);

/// For the log's result: `loaded_controllers`, "NAME SHA256 PATH" of every plugin that a host was
/// given after the first `known`; nothing without one.
[[nodiscard]] log::StringMap loaded_later(const ControllerHost& host, std::size_t known);

}  // namespace tandem::runtime
