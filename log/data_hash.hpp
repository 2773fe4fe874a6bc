// What two logs of the same data have in common, and no others.
// Layer: log.  Thread: one at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "base/sha256.hpp"

namespace tandem::log {

/// SHA-256 over, message by message: channel id (u16), time (i64), CDR header (4 bytes), and the
/// XXH128 of the body, in its canonical bytes; integers little-endian. XXH128, which takes a tenth
/// of the time or less, tells runs apart, but does not keep anybody from forging one.
class DataHash {
 public:
  /// @param data  with its CDR header, as in the file.
  void add(std::uint16_t channel, std::int64_t time_ns, std::span<const std::byte> data) noexcept;
  /// The same message in two pieces. @pre the header has four bytes at most
  void add(std::uint16_t channel, std::int64_t time_ns, std::span<const std::byte> cdr_header,
           std::span<const std::byte> body) noexcept;
  /// 64 hexadecimal digits, lower case. Ends the stream: call it once.
  [[nodiscard]] std::string finish();

 private:
  static constexpr std::size_t kMostOfMessage = 30;
  void take_waiting() noexcept;

  Sha256 hash_;
  std::array<std::byte, 64 * kMostOfMessage> waiting_;  // for it: a call for each would cost more
  std::size_t waits_ = 0;
};

}  // namespace tandem::log
