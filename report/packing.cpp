#include "report/packing.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <string_view>

namespace tandem::report {
namespace {

constexpr int kLevel = 8;  // of libdeflate's 12: higher ones take long for a hundredth

struct SpanRow {
  float least = std::numeric_limits<float>::quiet_NaN();
  float largest = least;
};

std::vector<SpanRow> merged(const Spans& spans, std::size_t signal, std::size_t merge) {
  const auto least = spans.least(signal), largest = spans.largest(signal);
  std::vector<SpanRow> rows((least.size() + merge - 1) / merge);
  for (std::size_t i = 0; i < least.size(); ++i) {
    SpanRow& row = rows[i / merge];
    if (std::isnan(least[i])) continue;
    if (!(row.least <= least[i])) row.least = least[i];
    if (!(row.largest >= largest[i])) row.largest = largest[i];
  }
  return rows;
}

/// What is known of a signal's numbers before they are coded.
struct Extremes {
  double least = std::numeric_limits<double>::infinity();
  double largest = -least;
  bool whole = true, gaps = false;
};

Extremes extremes_of(const std::vector<SpanRow>& rows) {
  Extremes found;
  for (const SpanRow& row : rows) {
    if (std::isnan(row.least)) {
      found.gaps = true;
      continue;
    }
    found.least = std::min<double>(found.least, row.least);
    found.largest = std::max<double>(found.largest, row.largest);
    found.whole =
        found.whole && std::floor(row.least) == row.least && std::floor(row.largest) == row.largest;
  }
  return found;
}

constexpr double most_code(int bytes) { return bytes == 2 ? 0xFFFE : 0xFFFFFE; }

Codes codes_for(const Extremes& of) {
  const double range = of.largest - of.least;
  if (of.whole && range <= most_code(2)) return {of.least, 1.0, 2};
  if (of.whole && range <= most_code(3)) return {of.least, 1.0, 3};
  return {of.least, range / most_code(2), 2};
}

/// Appends numbers of `bytes` bytes: all low bytes, then all next ones.
void append_planes(const std::vector<std::uint32_t>& numbers, int bytes, std::string& out) {
  for (int byte = 0; byte < bytes; ++byte) {
    for (const std::uint32_t number : numbers) {
      out.push_back(static_cast<char>(number >> (8 * byte) & 0xFFU));
    }
  }
}

void append_codes(const std::vector<SpanRow>& rows, const Codes& codes, bool pairs,
                  std::string& out) {
  const int bits = 8 * codes.bytes;
  const std::uint32_t mask = (1U << bits) - 1U;
  const auto code_of = [&](float value) {
    if (std::isnan(value)) return mask;
    const double code = codes.scale > 0.0 ? (value - codes.least) / codes.scale : 0.0;
    return static_cast<std::uint32_t>(std::lround(std::clamp(code, 0.0, most_code(codes.bytes))));
  };
  std::vector<std::uint32_t> steps, widths;
  std::uint32_t before = 0;
  for (const SpanRow& row : rows) {
    const std::uint32_t code = code_of(row.least);
    const std::uint32_t step = (code - before) & mask;
    const bool negative = (step >> (bits - 1)) != 0;
    steps.push_back(negative ? ((~step << 1U) | 1U) & mask : step << 1U);
    widths.push_back(code_of(row.largest) - code);
    before = code;
  }
  append_planes(steps, codes.bytes, out);
  if (pairs) append_planes(widths, codes.bytes, out);
}

std::string deflated(std::string_view raw) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(kLevel), &libdeflate_free_compressor);
  std::string out(libdeflate_zlib_compress_bound(compressor.get(), raw.size()), '\0');
  out.resize(
      libdeflate_zlib_compress(compressor.get(), raw.data(), raw.size(), out.data(), out.size()));
  return out;
}

}  // namespace

Packed pack(const Spans& spans, std::size_t merge) {
  Packed packed{.grid = spans.grid(), .signals = {}, .bytes = {}};
  packed.grid.cycles *= merge;
  packed.grid.rows = (spans.grid().rows + merge - 1) / merge;
  std::string raw;
  for (std::size_t signal = 0; signal < spans.signals(); ++signal) {
    const std::vector<SpanRow> rows = merged(spans, signal, merge);
    const Extremes found = extremes_of(rows);
    if (!(found.least <= found.largest)) {
      packed.signals.emplace_back(std::numeric_limits<double>::quiet_NaN());
    } else if (found.least == found.largest && !found.gaps) {
      packed.signals.emplace_back(found.least);
    } else {
      const Codes codes = codes_for(found);
      append_codes(rows, codes, packed.grid.cycles > 1, raw);
      packed.signals.emplace_back(codes);
    }
  }
  const std::string small = deflated(raw);
  packed.bytes = base64(std::as_bytes(std::span(small)));
  return packed;
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      three =
          three << 8U | (i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out.push_back(i + k > bytes.size() ? '=' : kDigits[three >> (18U - 6U * k) & 63U]);
    }
  }
  return out;
}

std::string unzip(std::string_view gzip) {
  constexpr std::size_t kMost = 64'000'000;
  if (gzip.size() < 4) return {};
  std::uint32_t size = 0;  // of what is in it: its last four bytes
  std::memcpy(&size, gzip.data() + gzip.size() - 4, 4);
  if (size > kMost) return {};
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> opener(
      libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  std::string out(size, '\0');
  const auto done = libdeflate_gzip_decompress(opener.get(), gzip.data(), gzip.size(), out.data(),
                                               out.size(), nullptr);
  return done == LIBDEFLATE_SUCCESS ? out : std::string();
}

}  // namespace tandem::report
