// Unpacks what report/packing.hpp describes, by its description alone.
#pragma once

#include <libdeflate.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "report/packing.hpp"

namespace tandem::report {

inline std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  std::uint32_t bits = 0;
  int held = 0;
  for (const char one : text) {
    if (one == '=') break;
    bits = bits << 6U | static_cast<std::uint32_t>(digits.find(one));
    held += 6;
    if (held < 8) continue;
    held -= 8;
    out.push_back(static_cast<char>(bits >> held & 0xFFU));
  }
  return out;
}

struct Unpacked {
  std::vector<double> least, largest;
};

/// Every signal of it.
inline std::vector<Unpacked> unpacked(const Packed& packed) {
  const std::string small = from_base64(packed.bytes);
  std::string raw(64'000'000, '\0');
  std::size_t size = 0;
  libdeflate_decompressor* opener = libdeflate_alloc_decompressor();
  const auto done =
      libdeflate_zlib_decompress(opener, small.data(), small.size(), raw.data(), raw.size(), &size);
  libdeflate_free_decompressor(opener);
  std::vector<Unpacked> all;
  if (done != LIBDEFLATE_SUCCESS) return all;
  const std::size_t rows = packed.grid.rows;
  std::size_t at = 0;
  for (const auto& one : packed.signals) {
    if (const double* constant = std::get_if<double>(&one)) {
      all.push_back({std::vector<double>(rows, *constant), std::vector<double>(rows, *constant)});
      continue;
    }
    const Codes& codes = std::get<Codes>(one);
    const auto plane = [&](std::size_t which, std::size_t row) {
      std::int64_t sum = 0;
      for (int byte = codes.bytes - 1; byte >= 0; --byte) {
        const std::size_t place =
            at +
            (which * static_cast<std::size_t>(codes.bytes) + static_cast<std::size_t>(byte)) *
                rows +
            row;
        sum = sum * 256 + static_cast<unsigned char>(raw.at(place));
      }
      return sum;
    };
    const std::int64_t all_codes = std::int64_t{1} << (8 * codes.bytes);
    const bool pairs = packed.grid.cycles > 1;
    Unpacked signal;
    std::int64_t now = 0;
    for (std::size_t row = 0; row < rows; ++row) {
      const std::int64_t folded = plane(0, row);
      now += folded % 2 == 0 ? folded / 2 : -(folded + 1) / 2;
      now = (now + all_codes) % all_codes;
      const bool gap = now == all_codes - 1;
      const std::int64_t top = now + (pairs ? plane(1, row) : 0);
      const auto value = [&](std::int64_t code) {
        return gap ? std::numeric_limits<double>::quiet_NaN()
                   : codes.least + codes.scale * static_cast<double>(code);
      };
      signal.least.push_back(value(now));
      signal.largest.push_back(value(top));
    }
    at += static_cast<std::size_t>(codes.bytes) * rows * (pairs ? 2 : 1);
    all.push_back(std::move(signal));
  }
  return all;
}

}  // namespace tandem::report
