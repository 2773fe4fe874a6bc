// What a controller tells beside its signals, as ROS 2's messages: words for /rosout, marks.
// Layer: log.  Thread: the recorder's.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/mark_block.hpp"
#include "hal/text_event.hpp"
#include "log/bytes.hpp"

namespace tandem::log {

inline constexpr char kRosoutType[] = "rcl_interfaces/msg/Log";
[[nodiscard]] std::string rosout_definition();
/// Makes `out` a body of kRosoutType: the controller is its `name`, the cycle its `function`.
void encode_rosout(const hal::TextEvent& event, std::int64_t stamp_ns, Bytes& out);

inline constexpr char kMarksType[] = "visualization_msgs/msg/MarkerArray";
[[nodiscard]] std::string marks_definition();
/// Makes `out` a body of kMarksType: what is shown is added, the rest deleted.
/// @param controller  the markers' `ns` begins with it
/// @param state       bytes of a hal::MarkBlock::State
void encode_marks(const std::string& controller, const std::vector<hal::MarkInfo>& marks,
                  std::int64_t stamp_ns, std::span<const std::byte> state, Bytes& out);

}  // namespace tandem::log
