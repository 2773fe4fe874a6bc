// One CAN or CAN FD data frame, and where a protocol machine puts the frames that it emits.
// Layer: canopen.  Thread: any; a sink belongs to one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/realtime.hpp"

namespace tandem::canopen {

inline constexpr std::size_t kMaxFrameBytes = 64;
inline constexpr std::size_t kClassicFrameBytes = 8;

/// Bits of Frame::flags.
enum FrameFlag : std::uint8_t {
  kFlagFd = 1,     ///< CAN FD format: more than 8 bytes are allowed
  kFlagBrs = 2,    ///< FD with the data phase at the higher bit rate
  kFlagRtr = 4,    ///< classic remote request: `length` is asked for, there is no data
  kFlagError = 8,  ///< an error frame of the driver's, no data frame
};

/// A frame with an 11-bit identifier. Plain data without padding; unused data bytes are zero, so
/// that equal frames have equal bytes.
struct Frame {
  std::uint32_t id = 0;     ///< COB-ID, 0 to 0x7FF
  std::uint8_t length = 0;  ///< bytes of data: 0..8, or with kFlagFd 12, 16, 20, 24, 32, 48, 64
  std::uint8_t flags = 0;   ///< FrameFlag bits
  std::array<std::uint8_t, 2> reserved{};
  std::array<std::uint8_t, kMaxFrameBytes> data{};

  [[nodiscard]] std::span<const std::uint8_t> payload() const noexcept {
    return {data.data(), length};
  }
  [[nodiscard]] bool fd() const noexcept { return (flags & kFlagFd) != 0; }
  bool operator==(const Frame&) const = default;
};
static_assert(sizeof(Frame) == 72);

/// The smallest length that a frame can have to carry `bytes`: above 8 only FD's steps exist.
/// @pre bytes <= 64
[[nodiscard]] constexpr std::uint8_t frame_length(std::size_t bytes) noexcept {
  if (bytes <= kClassicFrameBytes) return static_cast<std::uint8_t>(bytes);
  for (const int step : {12, 16, 20, 24, 32, 48}) {
    if (bytes <= static_cast<std::size_t>(step)) return static_cast<std::uint8_t>(step);
  }
  return static_cast<std::uint8_t>(kMaxFrameBytes);
}

/// A frame with these bytes of data; FD with bit-rate switch when they are more than 8.
/// @pre bytes.size() <= 64
[[nodiscard]] constexpr Frame make_frame(std::uint32_t id,
                                         std::span<const std::uint8_t> bytes) noexcept {
  Frame frame;
  frame.id = id;
  frame.length = frame_length(bytes.size());
  if (bytes.size() > kClassicFrameBytes) frame.flags = kFlagFd | kFlagBrs;
  for (std::size_t i = 0; i < bytes.size(); ++i) frame.data[i] = bytes[i];
  return frame;
}

/// Frames to be sent, in order, in storage that the caller lends. When it is full a frame is
/// refused and counted.
class FrameSink {
 public:
  explicit FrameSink(std::span<Frame> storage) noexcept : storage_(storage) {}

  bool push(const Frame& frame) noexcept TANDEM_RT {
    Frame* place = next();
    if (place == nullptr) return false;
    *place = frame;
    return true;
  }
  /// The place of a frame that is sent, for the caller to write: a frame that is made elsewhere,
  /// byte by byte, and copied at once makes CPUs wait.
  /// @return null: full, and a frame is counted
  [[nodiscard]] Frame* next() noexcept TANDEM_RT {
    if (count_ == storage_.size()) {
      ++dropped_;
      return nullptr;
    }
    return &storage_[count_++];
  }
  void clear() noexcept TANDEM_RT { count_ = 0; }
  [[nodiscard]] std::span<const Frame> frames() const noexcept { return storage_.first(count_); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  std::span<Frame> storage_;
  std::size_t count_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace tandem::canopen
