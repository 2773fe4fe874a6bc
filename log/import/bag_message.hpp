// Messages of bags as values: of ROS 2, of ROS 1 and in JSON, compressed or not.
// Layer: log/import.  Thread: any, non-RT.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "base/result.hpp"
#include "dds/cdr.hpp"

namespace tandem::log {

/// ROS 2's name of a type, whoever wrote it: "sensor_msgs/JointState" (ROS 1),
/// "sensor_msgs::msg::dds_::JointState_" (DDS). Other names stay as they are.
[[nodiscard]] std::string ros_name(std::string_view type);

/// Whether decode_message() reads an encoding of MCAP's: cdr, ros1, json.
[[nodiscard]] bool reads_encoding(std::string_view encoding);

/// One message. In CDR it may be compressed as rosbag2 does it message by message (zstd, lz4).
/// JSON is read by the names of ROS 1 and ROS 2; a member that is missing is empty, a number that
/// is null or "NaN" is none.
///
/// @param wanted  ROS 2's name of its type, one of those that Tandem has
/// Errors: bytes that are no such message; more than bounds.hpp allows.
/// @pre reads_encoding(encoding)
[[nodiscard]] Result<dds::Value> decode_message(std::string_view encoding, std::string_view wanted,
                                                std::span<const std::byte> bytes);

}  // namespace tandem::log
