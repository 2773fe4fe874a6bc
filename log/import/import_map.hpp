// The map of `tandem log import`: what a recording's columns or topics mean (docs/import.md).
// Layer: log/import.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <expected>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::log {

/// What may be left out of a recording instead of being an error: bits of ImportMap::exclude.
enum class Trouble : std::uint8_t {
  kInvalid = 1,
  kRagged = 2,
  kDuplicates = 4,
  kBackwards = 8,
  kGaps = 16,
  kFrozen = 32,
};

/// How a cycle's value comes from the samples around it.
enum class Sampling : std::uint8_t {
  kLinear,    ///< on the line between the two
  kNearest,   ///< of the nearest
  kPrevious,  ///< of the last before it; the state says its age
};

/// One signal of every joint: a table [position], [command.torque], …
struct SignalMap {
  bool command = false;
  std::string field;                 ///< of the image, on the wire
  std::string key;                   ///< of its table, for messages
  int line = 0;                      ///< the same
  std::vector<std::string> columns;  ///< (joints) of a CSV; empty in a bag
  std::vector<std::string> unused;   ///< columns of joints that follow others: whose leaders say it
  std::vector<double> scale, offset;  ///< (joints) SI = scale * recorded + offset
  bool unwrap = false;                ///< of positions: they were kept within a turn
};

/// A sensor's table [sensor.NAME].
struct SensorMap {
  std::size_t sensor = 0;  ///< in the robot
  std::string key;
  int line = 0;
  std::vector<std::string> columns;  ///< of a CSV, in the image's order of channels
  std::vector<double> scale;         ///< (channels)
  bool no_orientation = false;       ///< an IMU's columns are rates and specific force only
  std::string topic;                 ///< in a bag
  std::string frame;                 ///< header.frame_id that is taken for the sensor's link
};

struct CsvFormat {
  char delimiter = ',';  ///< ' ' stands for any number of blanks and tabs
  char comment = '\0';   ///< lines that begin so are left out; 0: none are
  bool header = true;    ///< the first line names the columns; else c1, c2, …
  bool decimal_comma = false;
  int skip_lines = 0;          ///< before the header
  std::optional<bool> sparse;  ///< an empty cell is no sample; empty: as most rows are
};

struct ImportMap {
  std::string file;
  std::vector<std::size_t> joints;        ///< of the robot, in the order of every [signal].columns
  std::map<std::size_t, double> missing;  ///< joints that the recording lacks, and where they are
  std::vector<std::string> ignore;        ///< columns or joints that are not used; "*": all others
  std::uint8_t exclude = 0;               ///< of Trouble
  bool allow_frozen = false;              ///< columns that never change are good

  std::optional<std::string> time_column;
  std::int64_t time_unit_ns = 0;  ///< of the time column; 0: dates of ISO 8601
  bool by_rows = false;           ///< no time column: a row every period_ns
  std::int64_t period_ns = 0;     ///< of the log; 0: not said
  std::int64_t max_gap_ns = 0;    ///< longer pauses are gaps
  std::int64_t begin_ns = 0;      ///< since the recording's first sample: the rows before
  std::int64_t end_ns = 0;        ///< and after are left out; 0: none are after
  Sampling sampling = Sampling::kLinear;

  CsvFormat csv;
  std::vector<std::string> joint_topics;     ///< empty: all of their type
  std::string stamp;                         ///< "header", "log"; empty: not said
  std::map<std::string, std::size_t> names;  ///< a bag's joint -> the robot's

  std::vector<SignalMap> signals;
  std::vector<SensorMap> sensors;
  std::int8_t command_mode = 0;  ///< hal::ControlMode of the command signals

  [[nodiscard]] bool excludes(Trouble trouble) const {
    return (exclude & static_cast<std::uint8_t>(trouble)) != 0;
  }
};

/// Reads a map for recordings of `robot`.
///
/// @param bag  the recording is a bag: columns and units are not asked for
/// Errors, all of them at once: no TOML, unknown or missing keys, a joint or sensor that the robot
/// does not have, lists of other lengths than `joints`, a unit that is not one of the signal's.
[[nodiscard]] std::expected<ImportMap, Diagnostics> parse_import_map(const std::string& text,
                                                                     const std::string& file,
                                                                     const hal::RobotConfig& robot,
                                                                     bool bag);

}  // namespace tandem::log
