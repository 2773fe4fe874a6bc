// How long the frames of a bus take on its wire, by their lengths.
// Layer: hal/ethercat-can.  Thread: RT, that of its end.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "hal/ethercat-can/bus.hpp"
#include "hal/ethercat-can/frame_time.hpp"

namespace tandem::hal::can {

/// Passes frames on, and adds up their times: with the most stuff bits that they can have, so that
/// none is too short. A virtual interface takes no time at all; a real wire would.
class WireMeter final : public ForwardingBus {
 public:
  WireMeter(Bus& to, const BitRates& rates) noexcept : ForwardingBus(to), rates_(rates) {}

  std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT override {
    const std::size_t sent = ForwardingBus::send(frames);
    count(frames.first(sent));
    return sent;
  }
  std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override {
    const std::size_t count_of = ForwardingBus::receive(frames);
    count(frames.first(count_of));
    return count_of;
  }
  [[nodiscard]] std::int64_t take_wire_ns() noexcept TANDEM_RT override {
    return duration_ns(std::exchange(bits_, {}), rates_);
  }

 private:
  void count(std::span<const canopen::Frame> frames) noexcept {
    for (const canopen::Frame& one : frames) {
      bits_ += worst_frame_bits(one.length, one.fd(), (one.flags & canopen::kFlagBrs) != 0);
    }
  }

  BitRates rates_;
  FrameBits bits_;
};

}  // namespace tandem::hal::can
