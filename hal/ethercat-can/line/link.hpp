// Where EtherCAT frames go and come back from, as the master sees it.
// Layer: hal/ethercat-can/line.  Thread: RT.
#pragma once

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
  std::uint64_t refused = 0;  ///< frames that could not be sent
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
