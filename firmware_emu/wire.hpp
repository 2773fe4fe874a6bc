// What boards and sensor nodes share at their end of the wire.
// Layer: firmware_emu.  Thread: RT, but for the archive.
#pragma once

#include <cstddef>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "canopen/frame.hpp"
#include "canopen/objects.hpp"

namespace tandem::firmware {

/// Whether `frame` is a data frame that CAN or CAN FD could have carried: an 11-bit identifier,
/// a length that exists, neither a remote request nor a driver's error frame.
[[nodiscard]] inline bool is_data_frame(const canopen::Frame& frame) noexcept TANDEM_RT {
  if (frame.id > canopen::cob::kIdMask) return false;
  if ((frame.flags & (canopen::kFlagRtr | canopen::kFlagError)) != 0) return false;
  if (frame.length <= canopen::kClassicFrameBytes) return true;
  return frame.fd() && frame.length <= canopen::kMaxFrameBytes &&
         canopen::frame_length(frame.length) == frame.length;
}

/// Whether `frame` is a classic remote request, which asks for the PDO of its identifier.
[[nodiscard]] inline bool is_remote_request(const canopen::Frame& frame) noexcept TANDEM_RT {
  return frame.id <= canopen::cob::kIdMask && frame.flags == canopen::kFlagRtr &&
         frame.length <= canopen::kClassicFrameBytes;
}

/// Archives the frames that wait in `outbox`, of which there are at most `capacity`.
void archive_outbox(Archive& ar, canopen::FrameSink& outbox, std::size_t capacity);

}  // namespace tandem::firmware
