// EtherCAT frames and datagrams: bytes to fields and back. docs/ethercat.md explains them.
// Layer: ethercat.  Thread: any.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/realtime.hpp"
#include "canopen/bytes.hpp"
#include "ethercat/errors.hpp"

// A frame (everything of EtherCAT is little-endian, everything of Ethernet is not):
//   destination (6), source (6), 88 A4                                        Ethernet
//   length in bits 0-10, type 1 in bits 12-15 (2)                             EtherCAT header
//   one datagram or more                                                      `length` bytes
//   zeros up to 60 bytes in all
// A datagram:
//   command (1), index (1), address (4), length in bits 0-10, circulating in bit 14, more in
//   bit 15 (2), interrupt (2), data (`length`), working counter (2)

namespace tandem::ethercat {

using MacAddress = std::array<std::uint8_t, 6>;

inline constexpr std::uint16_t kEtherType = 0x88A4;
inline constexpr std::size_t kEthernetHeaderBytes = 14;
inline constexpr std::size_t kFrameHeaderBytes = kEthernetHeaderBytes + 2;
inline constexpr std::size_t kMinFrameBytes = 60;    ///< without Ethernet's check sum
inline constexpr std::size_t kMaxFrameBytes = 1514;  ///< without Ethernet's check sum
/// What a frame costs on the wire besides its bytes: preamble and start (8), check sum (4), and the
/// gap before the next one (12). IEEE 802.3-2018, 3.1.1 and 4.4.2.
inline constexpr std::size_t kWireOverhead = 8 + 4 + 12;
inline constexpr std::int64_t kByteNs = 80;  ///< at 100 Mbit/s
/// The bytes of wire that a frame of `bytes` takes: a short one is filled up.
[[nodiscard]] constexpr std::size_t wire_bytes(std::size_t bytes) noexcept {
  return std::max(bytes, kMinFrameBytes) + kWireOverhead;
}
inline constexpr std::size_t kDatagramHeaderBytes = 10;
inline constexpr std::size_t kWorkingCounterBytes = 2;
/// What a datagram costs besides its data.
inline constexpr std::size_t kDatagramOverhead = kDatagramHeaderBytes + kWorkingCounterBytes;
/// The longest data of a datagram that is alone in its frame.
inline constexpr std::size_t kMaxDatagramData =
    kMaxFrameBytes - kFrameHeaderBytes - kDatagramOverhead;
/// The first slave sets this bit in the first byte of the source: the frame was in the line.
inline constexpr std::uint8_t kProcessedMark = 0x02;

/// How a datagram addresses slaves and what it does to them.
enum class Command : std::uint8_t {
  kNop = 0,    ///< nothing
  kAprd = 1,   ///< read, by position
  kApwr = 2,   ///< write, by position
  kAprw = 3,   ///< read and write, by position
  kFprd = 4,   ///< read, by station address
  kFpwr = 5,   ///< write, by station address
  kFprw = 6,   ///< read and write, by station address
  kBrd = 7,    ///< read of all; their data is ORed
  kBwr = 8,    ///< write to all
  kBrw = 9,    ///< read and write of all
  kLrd = 10,   ///< read, by logical address
  kLwr = 11,   ///< write, by logical address
  kLrw = 12,   ///< read and write, by logical address
  kArmw = 13,  ///< the slave at the position reads, those after it write what it read
  kFrmw = 14,  ///< the same by station address
};
inline constexpr std::uint8_t kCommands = 15;

/// "FPRD"; "?" for what is no command.
[[nodiscard]] const char* to_string(Command command) noexcept;
/// Whether the address is one 32-bit logical address.
[[nodiscard]] constexpr bool is_logical(Command command) noexcept {
  return command == Command::kLrd || command == Command::kLwr || command == Command::kLrw;
}

/// The address of a slave's register: by position or station in the low half, register above.
[[nodiscard]] constexpr std::uint32_t register_address(std::uint16_t slave,
                                                       std::uint16_t offset) noexcept TANDEM_RT {
  return std::uint32_t{slave} | (std::uint32_t{offset} << 16);
}
/// What addresses the slave at `position`, 0 the first, in APRD, APWR, APRW and ARMW.
[[nodiscard]] constexpr std::uint16_t at_position(std::size_t position) noexcept TANDEM_RT {
  return static_cast<std::uint16_t>(0u - position);
}

/// A datagram inside a frame: a view of its bytes, which a slave changes in place.
class Datagram {
 public:
  Datagram() = default;
  /// @pre bytes begin with the header and end with the working counter
  explicit Datagram(std::span<std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  [[nodiscard]] Command command() const noexcept { return static_cast<Command>(bytes_[0]); }
  [[nodiscard]] std::uint8_t index() const noexcept { return bytes_[1]; }
  [[nodiscard]] std::uint32_t address() const noexcept {
    return canopen::get<std::uint32_t>(&bytes_[2]);
  }
  /// Position or station address. @pre !is_logical(command())
  [[nodiscard]] std::uint16_t slave() const noexcept {
    return canopen::get<std::uint16_t>(&bytes_[2]);
  }
  void set_slave(std::uint16_t slave) noexcept { canopen::put(&bytes_[2], slave); }
  /// Register or memory address in the slave. @pre !is_logical(command())
  [[nodiscard]] std::uint16_t offset() const noexcept {
    return canopen::get<std::uint16_t>(&bytes_[4]);
  }
  [[nodiscard]] bool circulating() const noexcept { return (bytes_[7] & 0x40) != 0; }
  /// Whether another datagram follows.
  [[nodiscard]] bool more() const noexcept { return (bytes_[7] & 0x80) != 0; }
  [[nodiscard]] std::uint16_t interrupt() const noexcept {
    return canopen::get<std::uint16_t>(&bytes_[8]);
  }
  /// Adds a slave's pending events.
  void add_interrupt(std::uint16_t events) noexcept {
    canopen::put(&bytes_[8], static_cast<std::uint16_t>(interrupt() | events));
  }
  [[nodiscard]] std::span<std::uint8_t> data() const noexcept {
    return bytes_.subspan(kDatagramHeaderBytes, bytes_.size() - kDatagramOverhead);
  }
  [[nodiscard]] std::uint16_t working_counter() const noexcept {
    return canopen::get<std::uint16_t>(&bytes_[bytes_.size() - kWorkingCounterBytes]);
  }
  void add_working_counter(int count) noexcept {
    canopen::put(&bytes_[bytes_.size() - kWorkingCounterBytes],
                 static_cast<std::uint16_t>(working_counter() + count));
  }

 private:
  std::span<std::uint8_t> bytes_;
};

/// Hands out a frame's datagrams one after another.
class FrameReader {
 public:
  /// Looks at the headers. error() says what is wrong; then there are no datagrams.
  explicit FrameReader(std::span<std::uint8_t> frame) noexcept TANDEM_RT;

  /// The next datagram.
  /// @return false after the last one, and when error() is not kNone
  [[nodiscard]] bool next(Datagram& datagram) noexcept TANDEM_RT;
  [[nodiscard]] LineError error() const noexcept { return error_; }

 private:
  bool refuse(LineError error) noexcept;

  std::span<std::uint8_t> left_;
  LineError error_ = LineError::kNone;
  bool more_ = false;
};

/// What is wrong with a whole frame; kNone when every datagram can be read.
[[nodiscard]] LineError check_frame(std::span<std::uint8_t> frame) noexcept TANDEM_RT;

/// Builds one frame in place.
class FrameWriter {
 public:
  FrameWriter() = default;

  /// Begins a broadcast frame in `buffer`. @pre buffer has at least kMinFrameBytes
  void begin(std::span<std::uint8_t> buffer, const MacAddress& source) noexcept TANDEM_RT;
  /// Whether a datagram with `length` bytes of data fits.
  [[nodiscard]] bool fits(std::size_t length) const noexcept TANDEM_RT;
  /// Appends a datagram whose data is zero.
  /// @return its data; empty, and nothing appended, when it does not fit
  [[nodiscard]] std::span<std::uint8_t> add(Command command, std::uint8_t index,
                                            std::uint32_t address,
                                            std::size_t length) noexcept TANDEM_RT;
  [[nodiscard]] bool empty() const noexcept { return used_ == kFrameHeaderBytes; }
  /// Writes the length and fills up to the shortest frame.
  /// @return bytes of the frame. @pre !empty()
  [[nodiscard]] std::size_t finish() noexcept TANDEM_RT;

 private:
  std::span<std::uint8_t> buffer_;
  std::size_t used_ = kFrameHeaderBytes;
  std::size_t last_ = 0;  ///< where the last datagram begins; 0: there is none
};

}  // namespace tandem::ethercat
