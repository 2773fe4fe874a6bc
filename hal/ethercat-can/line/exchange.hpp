// Single datagrams of the master: asked for, sent, answered, and sent again when a frame was lost.
// Layer: hal/ethercat-can/line.  Thread: RT; construction non-RT.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "ethercat/datagram.hpp"
#include "ethercat/mailbox.hpp"
#include "hal/ethercat-can/line/link.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::ecat {

/// Frames of one cycle, filled one after another.
class FrameBatch {
 public:
  explicit FrameBatch(std::size_t most) : frames_(most) {}

  void begin(const ethercat::MacAddress& source) noexcept TANDEM_RT;
  /// Appends a datagram; begins another frame when it does not fit into the last one.
  /// @return its data; empty when no frame is left
  [[nodiscard]] std::span<std::uint8_t> add(ethercat::Command command, std::uint8_t index,
                                            std::uint32_t address,
                                            std::size_t length) noexcept TANDEM_RT;
  /// Finishes the last frame. @return the frames
  [[nodiscard]] std::span<const FrameBuffer> finish() noexcept TANDEM_RT;
  /// Frames that were begun.
  [[nodiscard]] std::size_t size() const noexcept { return used_; }

 private:
  std::vector<FrameBuffer> frames_;
  std::size_t used_ = 0;
  ethercat::MacAddress source_{};
  ethercat::FrameWriter writer_;
};

/// One datagram of one asker.
struct DatagramRequest {
  enum class State : std::uint8_t {
    kIdle,    ///< nothing is asked for
    kWanted,  ///< to be sent
    kSent,
    kDone,  ///< it came back: data and counter
    kLost,  ///< it did not, and was sent often enough
  };
  State state = State::kIdle;
  ethercat::Command command = ethercat::Command::kNop;
  std::uint8_t index = 0;
  std::uint8_t tries_left = 0;
  std::uint16_t length = 0;
  std::uint16_t counter = 0;  ///< working counter of the answer
  std::uint32_t address = 0;
  std::int64_t sent_ns = 0;
  int waited = 0;  ///< calls of age() since it was sent
  std::array<std::uint8_t, ethercat::kMaxMailboxBytes> data{};

  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return {data.data(), length};
  }
};

/// Channels with one request each. Indices 0 to 127 are its own; a late or doubled answer has
/// another index than the request that now waits.
class Exchange {
 public:
  static constexpr std::uint8_t kIndices = 128;
  /// An answer that takes longer is lost...
  static constexpr std::int64_t kLostNs = 5'000'000;
  /// ... if so many calls of age() have passed too.
  static constexpr int kLostCalls = 3;
  static constexpr std::uint8_t kTries = 5;
  /// New frames per cycle at most.
  static constexpr std::size_t kMostFrames = 4;

  /// @param channels  fewer than kIndices
  explicit Exchange(std::size_t channels) : requests_(channels) {}

  [[nodiscard]] const DatagramRequest& at(std::size_t channel) const noexcept {
    return requests_[channel];
  }
  [[nodiscard]] bool idle(std::size_t channel) const noexcept {
    return requests_[channel].state == DatagramRequest::State::kIdle;
  }
  /// Asks for a read of `length` bytes. @pre idle(channel); length <= kMaxMailboxBytes
  void read(std::size_t channel, ethercat::Command command, std::uint32_t address,
            std::size_t length, std::uint8_t tries = kTries) noexcept TANDEM_RT;
  /// Asks for a write of `data`. @pre idle(channel)
  void write(std::size_t channel, ethercat::Command command, std::uint32_t address,
             std::span<const std::uint8_t> data) noexcept TANDEM_RT;
  /// As read() and write(): a register of the slave with that station address.
  void read_at(std::size_t channel, std::uint16_t station, std::uint16_t offset, std::size_t length,
               std::uint8_t tries = kTries) noexcept TANDEM_RT {
    read(channel, ethercat::Command::kFprd, ethercat::register_address(station, offset), length,
         tries);
  }
  void write_at(std::size_t channel, std::uint16_t station, std::uint16_t offset,
                std::span<const std::uint8_t> data) noexcept TANDEM_RT {
    write(channel, ethercat::Command::kFpwr, ethercat::register_address(station, offset), data);
  }
  /// Forgets the channel's request: a later answer is ignored.
  void release(std::size_t channel) noexcept TANDEM_RT;

  /// Takes a datagram that came back.
  /// @return false when nobody waits for it
  bool take(const ethercat::Datagram& datagram) noexcept TANDEM_RT;
  /// After what has come was taken: what was sent long ago is wanted again, or lost.
  void age(std::int64_t now_ns) noexcept TANDEM_RT;
  /// Adds what is wanted, as far as it fits.
  void collect(FrameBatch& batch, std::int64_t now_ns) noexcept TANDEM_RT;
  void archive(Archive& ar);
  /// Whether a datagram was sent that has neither come back nor been given up.
  [[nodiscard]] bool under_way() const noexcept TANDEM_RT;
  /// Datagrams that were sent again.
  [[nodiscard]] std::uint64_t repeated() const noexcept { return repeated_; }

 private:
  std::vector<DatagramRequest> requests_;
  std::uint8_t next_index_ = 0;
  std::size_t first_ = 0;  ///< the channel that is served first
  std::uint64_t repeated_ = 0;
};

}  // namespace tandem::hal::ecat
