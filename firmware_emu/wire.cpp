// The snapshot of a node's unsent frames.
#include "firmware_emu/wire.hpp"

#include <algorithm>

namespace tandem::firmware {

using canopen::Frame;

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
