// Whether bytes are UTF-8, and where it may be cut: names of files come from anywhere, TOML and
// JSON take nothing else. Layer: base.  Thread: any.
#pragma once

#include <cstddef>
#include <string_view>

namespace tandem {

/// RFC 3629: no overlong forms, no surrogates, nothing beyond U+10FFFF.
[[nodiscard]] constexpr bool is_utf8(std::string_view text) noexcept {
  for (std::size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i++]);
    if (first < 0x80) continue;
    const int more = first >= 0xC2 && first < 0xE0   ? 1
                     : first >= 0xE0 && first < 0xF0 ? 2
                     : first >= 0xF0 && first < 0xF5 ? 3
                                                     : 0;
    if (more == 0) return false;
    unsigned char least = 0x80, most = 0xBF;  // of the byte after the first
    if (first == 0xE0) least = 0xA0;
    if (first == 0xED) most = 0x9F;
    if (first == 0xF0) least = 0x90;
    if (first == 0xF4) most = 0x8F;
    for (int k = 0; k < more; ++k, ++i) {
      if (i == text.size()) return false;
      const auto next = static_cast<unsigned char>(text[i]);
      if (next < least || next > most) return false;
      least = 0x80;
      most = 0xBF;
    }
  }
  return true;
}

/// The longest beginning of `text` that has `most` bytes at most, and no half of a character at its
/// end. What is no UTF-8 there is cut anywhere.
[[nodiscard]] constexpr std::string_view whole_characters(std::string_view text,
                                                          std::size_t most) noexcept {
  if (text.size() <= most) return text;
  std::size_t end = most;
  const auto inside = [&] { return (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U; };
  while (inside() && end > 0 && most - end < 3) --end;
  return text.substr(0, inside() ? most : end);
}

}  // namespace tandem
