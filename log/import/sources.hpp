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
/// column's name is STEM.NAME, of the file "STEM.csv".
///
/// Errors: no such column; a column that is neither used nor ignored; a cell that is no number; and
/// what the map does not exclude: ragged rows, cells that are empty or not finite. Each with its
/// file, line and column.
[[nodiscard]] Result<Recording> read_csv_recording(std::span<const ImportFile> files,
                                                   const ImportMap& map,
                                                   const hal::RobotConfig& robot);

/// Reads the ROS 2 bags `files` (MCAP), one after the other: sensor_msgs/JointState, and for each
/// [sensor.NAME] of the map sensor_msgs/Imu or geometry_msgs/WrenchStamped, in CDR of either byte
/// order. Several publishers may share the topic of joint states.
///
/// Errors: a damaged file; no joint states, or several topics of them while none is named; a stamp
/// that is not said; a joint that is neither the robot's, named nor ignored; joints that the
/// recording lacks; a topic of another type; a frame that is not the sensor's link; a message whose
/// lists differ in length.
[[nodiscard]] Result<Recording> read_bag_recording(std::span<const ImportFile> files,
                                                   const ImportMap& map,
                                                   const hal::RobotConfig& robot);

}  // namespace tandem::log
