// Readers of recordings: files of others become series, in SI and in the image's signs.
// Layer: log/import.  Thread: any, non-RT.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "base/open_file.hpp"
#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "log/import/import_map.hpp"
#include "log/import/recording.hpp"

namespace tandem::log {

/// A file, held open, and of a table its whole text.
struct ImportFile {
  std::string path;
  std::shared_ptr<const Descriptor> file;
  std::string text;
};

/// Reads tables of text. Several are laid side by side: row by row they belong together, and a
/// column's name is STEM.NAME, of the file "STEM.csv". In a sparse table each column has the times
/// of the rows in which it has a cell.
///
/// Errors: no such column; a column that is neither used nor ignored; a cell that is no number; and
/// what the map does not exclude: ragged rows, cells that are empty or not finite. Each with its
/// file, line and column.
[[nodiscard]] Result<ImportedRecording> read_csv_recording(std::span<const ImportFile> files,
                                                           const ImportMap& map,
                                                           const hal::RobotConfig& robot);

/// Reads the bags `files` (MCAP), one after the other: sensor_msgs/JointState, and for each
/// [sensor.NAME] of the map sensor_msgs/Imu or geometry_msgs/WrenchStamped, as decode_message()
/// reads them. Several publishers may share a topic of joint states, and several topics the joints.
///
/// Errors: a damaged file; no joint states; a joint in two topics or twice in a message; a stamp
/// that is not said; a joint that is neither the robot's, named nor ignored; joints that the
/// recording lacks; a topic of another type; a frame that is not the sensor's link; a message whose
/// lists differ in length.
[[nodiscard]] Result<ImportedRecording> read_bag_recording(std::span<const ImportFile> files,
                                                           const ImportMap& map,
                                                           const hal::RobotConfig& robot);

}  // namespace tandem::log
