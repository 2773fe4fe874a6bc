// A recording of another program as a log of ours. Start here.
// Layer: log/import.  Thread: one at a time, non-RT.
#pragma once

#include <expected>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "log/import/import_map.hpp"
#include "log/import/recording.hpp"
#include "log/import/sampling.hpp"
#include "log/recorder.hpp"

namespace tandem::log {

struct ImportRequest {
  std::vector<std::string> files;  ///< tables of text side by side, or bags one after the other
  std::string map;                 ///< path of the import map
  std::string output;              ///< path of the log
};

/// A recording, read and cleaned.
struct Imported {
  ImportMap map;
  std::string map_text;
  ImportedRecording recording;
  bool bag = false;
  std::string sha256;  ///< of the files' bytes, one after another
};

/// Reads the files and the map.
/// Errors: those of parse_import_map, of the sources and of clean(); files of two kinds, or of one
/// that is not read.
[[nodiscard]] std::expected<Imported, Diagnostics> read_recording(const ImportRequest& request,
                                                                  const hal::RobotConfig& robot);

/// What became of a recording.
struct ImportSummary {
  bool bag = false;
  std::uint64_t cycles = 0;  ///< in the log
  std::int64_t period_ns = 0;
  std::int64_t begin_ns = 0;  ///< of cycle 0, on the recording's clock
  std::vector<Spacing> series;
  Exclusions excluded;
  std::vector<std::string> fields;   ///< "position_rad", "command torque_nm": what is filled
  std::vector<std::string> missing;  ///< joints that the recording lacks
  std::vector<std::string> notes;    ///< what was taken how
  RecordingResult log;
};

/// Reads recordings and writes them as a log of `robot`: /tandem/state and, when the map has
/// [command], /tandem/command. A pause that was left out is an event.
///
/// @param robot  completed from its description
/// @param info   of the log: version, robot, joints, sensors, configuration; period and the map's
///               text are added
/// @param urdf   the description's text, for viewers; may be empty
/// Errors: read_recording()'s, before there is a log; a log that cannot be written.
[[nodiscard]] std::expected<ImportSummary, Diagnostics> import_log(const ImportRequest& request,
                                                                   const hal::RobotConfig& robot,
                                                                   RunInfo info,
                                                                   const std::string& urdf);

}  // namespace tandem::log
