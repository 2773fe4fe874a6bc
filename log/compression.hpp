// Compression of a chunk: none, LZ4 (frame format) or Zstandard, as MCAP names them.
// Layer: log.  Thread: one at a time.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "base/result.hpp"
#include "log/bytes.hpp"

namespace tandem::log {

enum class Compression : std::uint8_t { kNone, kLz4, kZstd };

/// MCAP's name: "", "lz4", "zstd".
[[nodiscard]] std::string_view mcap_name(Compression compression) noexcept;
/// The reverse; an error names the unknown compression.
[[nodiscard]] Result<Compression> compression_of(std::string_view mcap_name);

/// Replaces `out` by `data` compressed. kNone copies.
void compress(Compression compression, std::span<const std::byte> data, Bytes& out);

/// Replaces `out` by the `size` bytes that `data` holds. Errors: damaged data, another size, or
/// more than 1 GiB.
[[nodiscard]] Status decompress(Compression compression, std::span<const std::byte> data,
                                std::uint64_t size, Bytes& out);

}  // namespace tandem::log
