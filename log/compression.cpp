// LZ4 and Zstandard by their libraries; a chunk that claims more content than its bytes can hold is
// refused before memory is taken.
#include "log/compression.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>

#include "base/bounds.hpp"

namespace tandem::log {
namespace {

/// The most bytes that `compressed` ones can hold, so that no more room is made than there is
/// content for: lz4 grows a byte to 255 at most, zstd one of 4 bytes to a block of 128 KiB.
std::uint64_t most_content(Compression compression, std::size_t compressed) {
  const std::uint64_t growth = compression == Compression::kLz4 ? 255 : 32 * 1024;
  return compression == Compression::kNone ? compressed : growth * compressed;
}

bool lz4_decompress(std::span<const std::byte> data, Bytes& out) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) return false;
  std::size_t done = 0;
  std::size_t wanted = 1;
  while (wanted != 0 && !data.empty()) {
    std::size_t produced = out.size() - done;
    std::size_t consumed = data.size();
    wanted =
        LZ4F_decompress(context, out.data() + done, &produced, data.data(), &consumed, nullptr);
    if (LZ4F_isError(wanted) || (produced == 0 && consumed == 0)) break;
    done += produced;
    data = data.subspan(consumed);
  }
  LZ4F_freeDecompressionContext(context);
  return wanted == 0 && done == out.size();
}

}  // namespace

std::string_view mcap_name(Compression compression) noexcept {
  switch (compression) {
    case Compression::kNone: return "";
    case Compression::kLz4: return "lz4";
    case Compression::kZstd: return "zstd";
  }
  return "";
}

Result<Compression> compression_of(std::string_view name) {
  for (const Compression one : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    if (mcap_name(one) == name) return one;
  }
  return fail("unknown compression '" + std::string(name) + "'", "known: lz4, zstd");
}

void compress(Compression compression, std::span<const std::byte> data, Bytes& out) {
  switch (compression) {
    case Compression::kNone: out.assign(data.begin(), data.end()); return;
    case Compression::kLz4: {
      LZ4F_preferences_t preferences{};
      preferences.frameInfo.blockSizeID = LZ4F_max4MB;
      preferences.frameInfo.contentSize = data.size();
      out.resize(LZ4F_compressFrameBound(data.size(), &preferences));
      out.resize(
          LZ4F_compressFrame(out.data(), out.size(), data.data(), data.size(), &preferences));
      return;
    }
    case Compression::kZstd:
      out.resize(ZSTD_compressBound(data.size()));
      out.resize(ZSTD_compress(out.data(), out.size(), data.data(), data.size(), 1));
      return;
  }
}

Status decompress(Compression compression, std::span<const std::byte> data, std::uint64_t size,
                  Bytes& out) {
  if (size >
      std::min(std::uint64_t{bounds::kLogRecord.most}, most_content(compression, data.size()))) {
    return fail("a chunk claims " + std::to_string(size) + " bytes");
  }
  bool good = false;
  if (compression == Compression::kNone) {
    out.assign(data.begin(), data.end());
    good = out.size() == size;
  } else {
    out.resize(static_cast<std::size_t>(size));
    good = compression == Compression::kLz4
               ? lz4_decompress(data, out)
               : ZSTD_decompress(out.data(), out.size(), data.data(), data.size()) == size;
  }
  if (!good) return fail("a chunk's compressed data are damaged");
  return {};
}

}  // namespace tandem::log
