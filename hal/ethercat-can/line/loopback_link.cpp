// Rings of whole frames.
#include "hal/ethercat-can/line/loopback_link.hpp"

#include <algorithm>

namespace tandem::hal::ecat {

namespace {

void copy(const FrameBuffer& from, FrameBuffer& to) noexcept {
  to.size = from.size;
  std::copy_n(from.bytes.begin(), from.size, to.bytes.begin());
}

}  // namespace

std::size_t LoopbackLink::End::send(std::span<const FrameBuffer> frames) noexcept TANDEM_RT {
  const std::size_t taken = std::min(frames.size(), kWaiting - out_->count);
  for (const FrameBuffer& frame : frames.first(taken)) {
    copy(frame, out_->frames[(out_->first + out_->count++) % kWaiting]);
  }
  statistics_.count_sent(frames.first(taken));
  statistics_.refused += frames.size() - taken;
  return taken;
}

std::size_t LoopbackLink::End::receive(std::span<FrameBuffer> frames) noexcept TANDEM_RT {
  const std::size_t given = std::min(frames.size(), in_->count);
  for (FrameBuffer& frame : frames.first(given)) {
    copy(in_->frames[in_->first], frame);
    in_->first = (in_->first + 1) % kWaiting;
  }
  in_->count -= given;
  statistics_.count_received(frames.first(given));
  return given;
}

}  // namespace tandem::hal::ecat
