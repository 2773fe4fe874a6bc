// A line of slaves whose information memories have a wrong check sum.
// Layer: tests.  Thread: any.
#pragma once

#include "canopen/bytes.hpp"
#include "ethercat/datagram.hpp"
#include "ethercat/medium.hpp"
#include "ethercat/registers.hpp"

namespace tandem::test {

/// Turns a bit of byte 14, the check sum, wherever a master reads it.
class SpoiltMemory final : public ethercat::Medium {
 public:
  explicit SpoiltMemory(ethercat::Medium& slaves) : slaves_(&slaves) {}
  bool pass(std::span<std::uint8_t> frame, std::int64_t now_ns) noexcept override {
    const bool back = slaves_->pass(frame, now_ns);
    ethercat::FrameReader reader(frame);
    ethercat::Datagram datagram;
    while (reader.next(datagram)) spoil(datagram);
    return back;
  }

 private:
  static void spoil(ethercat::Datagram& datagram) noexcept {
    constexpr std::size_t kByte = 14, kAnswer = 14, kDataAt = 6;
    using ethercat::Command;
    const bool reads = datagram.command() == Command::kFprd || datagram.command() == Command::kAprd;
    const auto data = datagram.data();
    if (!reads || datagram.offset() != ethercat::reg::kSiiControl || data.size() != kAnswer) return;
    const std::size_t from = 2 * std::size_t{canopen::get<std::uint32_t>(&data[2])};
    if (from <= kByte && kByte < from + kAnswer - kDataAt) data[kDataAt + kByte - from] ^= 1;
  }
  ethercat::Medium* slaves_;
};

}  // namespace tandem::test
