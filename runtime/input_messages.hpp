// Messages of ROS 2 that bring samples of controllers' inputs.
// Layer: runtime.  Thread: any, non-RT.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "controllers/inputs.hpp"
#include "dds/types.hpp"
#include "runtime/input_source.hpp"

namespace tandem::runtime {

/// A type of message, and the kind of input whose samples it brings.
struct InputMessage {
  InputKind kind;
  bool has_frame;  ///< its numbers stand in the frame that its header names
  const dds::Type& (*type)();
  /// The numbers of an input in `message`, one of that type; its bounds are InputPort::check()'s.
  /// Errors: another number of them than the input has; joints that it has not; another frame than
  /// InputSource::frame.
  Result<std::vector<double>> (*sample)(const void* message, const InputBlock& input,
                                        const InputSource& source);
};

/// Every type; of a kind the usual one first. A new one is a row.
[[nodiscard]] std::span<const InputMessage> input_messages();

/// That of the type which the source names, else the first of the kind.
/// Errors, at the source's place: no such type of this kind (the nearest is suggested); a frame of
/// a message that names none.
[[nodiscard]] Result<const InputMessage*> message_of(InputKind kind, const InputSource& source);

}  // namespace tandem::runtime
