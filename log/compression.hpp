// Compression of a chunk: none, LZ4 (frame format) or Zstandard, as MCAP names them.
// Layer: log.  Thread: one at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "base/result.hpp"
#include "log/bytes.hpp"

namespace tandem::log {

enum class Compression : std::uint8_t {
  kNone,
  kLz4,
  kZstd,
  kGzip,  ///< of whole files; no chunk has it
};

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

/// What bytes are packed by, as whole files and rosbag2's messages are: by the first four of them.
/// kNone: by none.
[[nodiscard]] Compression packed_by(std::span<const std::byte> begin) noexcept;

/// The next packed bytes; none at their end.
using PackedBytes = std::function<Result<std::span<const std::byte>>()>;
/// Takes what was unpacked, piece by piece. An error ends the unpacking: the one who takes bounds
/// how much there is.
using TakeBytes = std::function<Status(std::span<const std::byte>)>;

/// Unpacks frames whose content's size nobody says. Memory: zstd's window, at most 128 MiB; of gzip
/// all of the file and what is in it, at most 1 GiB.
/// Errors: those of `more` and `take`; damaged or cut data; more in gzip.
/// @pre `compression` is not kNone
[[nodiscard]] Status unpack(Compression compression, const PackedBytes& more,
                            const TakeBytes& take);

}  // namespace tandem::log
