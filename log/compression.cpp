// LZ4, Zstandard and gzip by their libraries; a chunk that claims more content than its bytes can
// hold is refused before memory is taken.
#include "log/compression.hpp"

#include <libdeflate.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>

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
    case Compression::kGzip: return "gzip";
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
    case Compression::kGzip: out.clear(); return;  // nothing here packs by it
  }
}

Status decompress(Compression compression, std::span<const std::byte> data, std::uint64_t size,
                  Bytes& out) {
  if (size >
      std::min(std::uint64_t{bounds::kLogRecord.most}, most_content(compression, data.size()))) {
    return fail("it claims " + std::to_string(size) + " bytes");
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
  if (!good) return fail("its compressed data are damaged");
  return {};
}

Compression packed_by(std::span<const std::byte> begin) noexcept {
  constexpr std::array<std::uint8_t, 4> kZstd{0x28, 0xB5, 0x2F, 0xFD}, kLz4{0x04, 0x22, 0x4D, 0x18};
  const auto is = [&](const std::array<std::uint8_t, 4>& magic) {
    return begin.size() >= magic.size() &&
           std::memcmp(begin.data(), magic.data(), magic.size()) == 0;
  };
  constexpr std::byte kGzip[] = {std::byte{0x1F}, std::byte{0x8B}, std::byte{8}};
  if (begin.size() >= 4 && std::ranges::equal(begin.first(3), kGzip)) return Compression::kGzip;
  return is(kZstd) ? Compression::kZstd : is(kLz4) ? Compression::kLz4 : Compression::kNone;
}

namespace {

/// One library's decoder, fed piece by piece.
class Unpacker {
 public:
  explicit Unpacker(Compression compression) {
    if (compression == Compression::kZstd) zstd_.reset(ZSTD_createDCtx());
    LZ4F_dctx* made = nullptr;
    if (compression == Compression::kLz4 &&
        LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) == 0) {
      lz4_.reset(made);
    }
  }

  /// Consumes from `in` and fills `out`. @return bytes of it; none: damaged
  std::optional<std::size_t> step(std::span<const std::byte>& in, std::span<std::byte> out) {
    std::size_t produced = out.size(), consumed = in.size();
    if (zstd_ != nullptr) {
      ZSTD_inBuffer from{in.data(), in.size(), 0};
      ZSTD_outBuffer to{out.data(), out.size(), 0};
      wanted_ = ZSTD_decompressStream(zstd_.get(), &to, &from);
      if (ZSTD_isError(wanted_) != 0) return std::nullopt;
      produced = to.pos;
      consumed = from.pos;
    } else {
      if (lz4_ == nullptr) return std::nullopt;
      wanted_ = LZ4F_decompress(lz4_.get(), out.data(), &produced, in.data(), &consumed, nullptr);
      if (LZ4F_isError(wanted_) != 0) return std::nullopt;
    }
    if (consumed == 0 && produced == 0 && !in.empty()) return std::nullopt;
    in = in.subspan(consumed);
    return produced;
  }
  /// A frame has ended, and no other has begun.
  [[nodiscard]] bool whole() const { return wanted_ == 0; }

 private:
  struct Free {
    void operator()(ZSTD_DCtx* one) const { ZSTD_freeDCtx(one); }
    void operator()(LZ4F_dctx* one) const { LZ4F_freeDecompressionContext(one); }
  };
  std::unique_ptr<ZSTD_DCtx, Free> zstd_;
  std::unique_ptr<LZ4F_dctx, Free> lz4_;
  std::size_t wanted_ = 1;
};

constexpr std::uint64_t kMostGzip = std::uint64_t{1} << 30;

/// The library has no stream: a member is unpacked at once, into more room until it fits.
/// @return what is behind the member
Result<std::span<const std::byte>> gunzip_member(libdeflate_decompressor* gzip,
                                                 std::span<const std::byte> packed, Bytes& out) {
  constexpr std::uint64_t kDeflateGrowth = 1032;  // at most
  const std::uint64_t most = std::min(kMostGzip, kDeflateGrowth * packed.size());
  for (std::uint64_t room = std::min<std::uint64_t>(most, 4 * packed.size());;
       room = std::min(most, 2 * room)) {
    out.resize(room);
    std::size_t used = 0, made = 0;
    const libdeflate_result result = libdeflate_gzip_decompress_ex(
        gzip, packed.data(), packed.size(), out.data(), out.size(), &used, &made);
    if (result == LIBDEFLATE_SUCCESS) {
      out.resize(made);
      return packed.subspan(used);
    }
    if (result != LIBDEFLATE_INSUFFICIENT_SPACE)
      return fail("its compressed data are damaged or cut");
    if (room < most) continue;
    if (most < kMostGzip) return fail("its compressed data are damaged or cut");
    return fail("holds more than 1 GiB in gzip", "decompress it: gunzip");
  }
}

Status gunzip(const PackedBytes& more, const TakeBytes& take) {
  Bytes all, plain;
  for (;;) {
    auto packed = more();
    if (!packed) return std::unexpected(packed.error());
    if (packed->empty()) break;
    if (all.size() + packed->size() > kMostGzip)
      return fail("has more than 1 GiB in gzip", "decompress it: gunzip");
    all.insert(all.end(), packed->begin(), packed->end());
  }
  const auto free = [](libdeflate_decompressor* one) { libdeflate_free_decompressor(one); };
  const std::unique_ptr<libdeflate_decompressor, decltype(free)> gzip(
      libdeflate_alloc_decompressor(), free);
  if (gzip == nullptr) return fail("there is no memory to unpack it");
  std::span<const std::byte> rest(all);
  do {
    auto behind = gunzip_member(gzip.get(), rest, plain);
    if (!behind) return std::unexpected(behind.error());
    if (Status taken = take(plain); !taken) return taken;
    rest = *behind;
  } while (std::ranges::any_of(rest, [](std::byte one) { return one != std::byte{0}; }));
  return {};
}

}  // namespace

Status unpack(Compression compression, const PackedBytes& more, const TakeBytes& take) {
  if (compression == Compression::kGzip) return gunzip(more, take);
  constexpr std::size_t kPiece = std::size_t{1} << 17;
  Unpacker unpacker(compression);
  Bytes piece(kPiece);
  for (;;) {
    auto packed = more();
    if (!packed) return std::unexpected(packed.error());
    if (packed->empty()) break;
    std::size_t produced = 0;
    do {
      const auto got = unpacker.step(*packed, piece);
      if (!got) return fail("its compressed data are damaged");
      produced = *got;
      if (Status taken = take(std::span(piece).first(produced)); !taken) return taken;
    } while (!packed->empty() || (!unpacker.whole() && produced == piece.size()));
  }
  if (!unpacker.whole()) return fail("its compressed data are cut");
  return {};
}

}  // namespace tandem::log
