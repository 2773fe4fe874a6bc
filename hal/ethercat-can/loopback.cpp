// Two bounded first-in-first-out queues, one per direction; what finds a queue full is refused.
#include "hal/ethercat-can/loopback.hpp"

#include <algorithm>

#include "base/archive.hpp"

namespace tandem::hal::can {

using canopen::Frame;

LoopbackBus::LoopbackBus(std::size_t capacity) : to_boards_(capacity), to_master_(capacity) {}

std::size_t LoopbackBus::Queue::push(std::span<const Frame> frames) noexcept {
  if (first + count + frames.size() > storage.size()) {  // close the gap at the front
    std::copy_n(storage.begin() + static_cast<std::ptrdiff_t>(first), count, storage.begin());
    first = 0;
  }
  const std::size_t taken = std::min(frames.size(), storage.size() - count);
  std::ranges::copy(frames.first(taken),
                    storage.begin() + static_cast<std::ptrdiff_t>(first + count));
  count += taken;
  dropped += frames.size() - taken;
  return taken;
}

std::size_t LoopbackBus::Queue::pop(std::span<Frame> frames) noexcept {
  const std::size_t given = std::min(frames.size(), count);
  std::copy_n(storage.begin() + static_cast<std::ptrdiff_t>(first), given, frames.begin());
  drop(given);
  return given;
}

void LoopbackBus::Queue::drop(std::size_t frames) noexcept {
  const std::size_t gone = std::min(frames, count);
  first += gone;
  count -= gone;
  passed += gone;
  if (count == 0) first = 0;
}

/// Only the frames that wait: what the storage held before is no state.
void LoopbackBus::Queue::archive(Archive& ar) {
  std::size_t waiting = count;
  ar(waiting, dropped, passed);
  if (ar.reading()) {
    first = 0;
    count = std::min(waiting, storage.size());
  }
  for (std::size_t i = 0; i < count; ++i) ar(storage[first + i]);
}

std::size_t LoopbackBus::End::send(std::span<const Frame> frames) noexcept TANDEM_RT {
  if (bus_.connected_) return out_.push(frames);
  out_.dropped += frames.size();
  return 0;
}

std::size_t LoopbackBus::End::receive(std::span<Frame> frames) noexcept TANDEM_RT {
  return in_.pop(frames);
}

void LoopbackBus::archive(Archive& ar) { ar(connected_, to_boards_, to_master_); }

}  // namespace tandem::hal::can
