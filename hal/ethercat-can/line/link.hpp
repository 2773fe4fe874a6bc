// Where EtherCAT frames go and come back from, as the master sees it.
// Layer: hal/ethercat-can/line.  Thread: RT.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "base/realtime.hpp"
#include "ethercat/datagram.hpp"

namespace tandem::hal::ecat {

/// A frame with room for the longest one.
struct FrameBuffer {
  std::array<std::uint8_t, ethercat::kMaxFrameBytes> bytes{};
  std::size_t size = 0;

  [[nodiscard]] std::span<std::uint8_t> frame() noexcept { return {bytes.data(), size}; }
  [[nodiscard]] std::span<const std::uint8_t> frame() const noexcept {
    return {bytes.data(), size};
  }
};

/// What has passed since the link was opened.
struct LinkStatistics {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  std::uint64_t refused = 0;                         ///< frames that could not be sent
  std::uint64_t sent_bytes = 0, received_bytes = 0;  ///< of wire: ethercat::wire_bytes() of each

  /// How long the wire was busy since `before` [ns], at 100 Mbit/s. A line has a pair of wires each
  /// way, and what goes out on one comes back on the other: the time of the fuller pair.
  [[nodiscard]] std::int64_t wire_ns_since(const LinkStatistics& before) const noexcept {
    return ethercat::kByteNs *
           static_cast<std::int64_t>(
               std::max(sent_bytes - before.sent_bytes, received_bytes - before.received_bytes));
  }
  void count_sent(std::span<const FrameBuffer> frames) noexcept {
    sent += frames.size();
    for (const FrameBuffer& one : frames) sent_bytes += ethercat::wire_bytes(one.size);
  }
  void count_received(std::span<const FrameBuffer> frames) noexcept {
    received += frames.size();
    for (const FrameBuffer& one : frames) received_bytes += ethercat::wire_bytes(one.size);
  }
};

/// One end of a line of slaves. Never blocks.
class DataLink {
 public:
  virtual ~DataLink() = default;

  /// Sends frames in order. @return how many were taken; the rest is dropped and counted
  virtual std::size_t send(std::span<const FrameBuffer> frames) noexcept TANDEM_RT = 0;
  /// Takes frames that have come, oldest first.
  /// @return how many; less than frames.size() means that nothing more is there
  virtual std::size_t receive(std::span<FrameBuffer> frames) noexcept TANDEM_RT = 0;
  /// The source address of the frames to be sent, without the mark of a slave.
  [[nodiscard]] virtual ethercat::MacAddress address() const noexcept = 0;
  [[nodiscard]] virtual LinkStatistics statistics() const noexcept TANDEM_RT = 0;
};

}  // namespace tandem::hal::ecat
