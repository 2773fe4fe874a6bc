// Which frames a CAN bus can carry, and the snapshot of a node's unsent frames.
#include "firmware_emu/wire.hpp"

#include <algorithm>

#include "canopen/objects.hpp"

namespace tandem::firmware {

using canopen::Frame;

bool is_data_frame(const Frame& frame) noexcept TANDEM_RT {
  if (frame.id > canopen::cob::kIdMask) return false;
  if ((frame.flags & (canopen::kFlagRtr | canopen::kFlagError)) != 0) return false;
  if (frame.length > canopen::kMaxFrameBytes) return false;
  if (canopen::frame_length(frame.length) != frame.length) return false;
  return frame.fd() || frame.length <= canopen::kClassicFrameBytes;
}

void archive_outbox(Archive& ar, canopen::FrameSink& outbox, std::size_t capacity) {
  std::size_t count = outbox.frames().size();
  ar(count);
  if (!ar.reading()) {
    for (Frame frame : outbox.frames()) ar(frame);
    return;
  }
  outbox.clear();
  for (std::size_t i = 0; ar.ok() && i < std::min(count, capacity); ++i) {
    Frame frame;
    ar(frame);
    outbox.push(frame);
  }
}

}  // namespace tandem::firmware
