// Signals over equal spans of time in few bytes, as studio/page/src/recorded.ts unpacks them.
//
// A signal that never changes is its number. Others are codes of two or three bytes between their
// own least and largest number. Of each row there is the code of the least number, less that of the
// row before, and, where a row is more than one cycle, how much larger the code of its largest is;
// first all low bytes, then all higher ones. Negative differences are folded between the positive
// ones (0, -1, 1, -2, …), so that high bytes are mostly 0. All signals together are one zlib
// stream. Layer: report.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "report/spans.hpp"

namespace tandem::report {

/// How the codes of a signal are read: value = least + code * scale; the largest code is a gap.
struct Codes {
  double least = 0.0;
  double scale = 0.0;
  int bytes = 2;
};

/// Signals in their order, and the codes of those that have some.
struct Packed {
  Grid grid;                                         ///< as it was packed
  std::vector<std::variant<double, Codes>> signals;  ///< a number: it never changes; NaN: no number
  std::string bytes;                                 ///< zlib stream, in base64
};

/// Numbers that are whole keep their value: up to 65,535 different ones in two bytes, else in three
/// up to 16,777,214. Others have 16 bits.
/// @param merge  rows that become one
[[nodiscard]] Packed pack(const Spans& spans, std::size_t merge);

/// As RFC 4648 has it, with padding.
[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

/// What a gzip file of ours holds, which is not larger than 64 MB.
[[nodiscard]] std::string unzip(std::string_view gzip);

}  // namespace tandem::report
