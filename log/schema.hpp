// The ROS 2 message definition (ros2msg) of a process image, and the layout read back from one.
// Layer: log.  Thread: non-RT only.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "base/result.hpp"
#include "hal/image.hpp"
#include "log/info.hpp"

namespace tandem::log {

/// Before every CDR body: little-endian plain CDR (XCDR1), no options.
inline constexpr std::array<std::byte, 4> kCdrHeader{std::byte{0}, std::byte{1}, std::byte{0},
                                                     std::byte{0}};

/// One line per field: "float64[29] position_rad  # link side, …". A field of one element is a
/// plain member; a field without elements is left out, since ros2msg has no empty arrays.
/// The elements of a field that signal_name() tells by joint or sensor become members of a part:
/// "tandem/JointsFloat64 position_rad", whose text follows with a member for each joint. The bytes
/// are those of an array, and a viewer shows position_rad.LKneeSag instead of position_rad[3].
[[nodiscard]] std::string ros2msg_of(const hal::Layout& layout, const RunInfo& info);

/// The layout of a message of fixed-size numbers, and of parts that have numbers of one type alone.
/// Errors: a line that is no such member, or members that are not in falling order of their size
/// (their CDR would have padding).
[[nodiscard]] Result<hal::Layout> layout_of(std::string_view ros2msg);

/// Element `index` of `field` in a message's CDR body, as a double.
/// @pre index < field.count and the body has the layout's bytes.
[[nodiscard]] double element(const hal::Field& field, std::span<const std::byte> body,
                             std::size_t index) noexcept;

}  // namespace tandem::log
