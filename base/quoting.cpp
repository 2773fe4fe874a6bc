#include "base/quoting.hpp"

#include <algorithm>
#include <cstdint>

#include "base/utf8.hpp"

namespace tandem {
namespace {

constexpr char kHex[] = "0123456789abcdef";

/// One character, or one byte that belongs to none.
struct Sign {
  std::uint32_t code = 0;
  std::size_t bytes = 1;
  bool valid = true;
};

Sign sign_at(std::string_view text, std::size_t at) {
  const auto first = static_cast<unsigned char>(text[at]);
  if (first < 0x80) return {first, 1, true};
  const std::size_t bytes = first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (bytes > text.size() - at || !is_utf8(text.substr(at, bytes))) return {first, 1, false};
  std::uint32_t code = first & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i)
    code = code << 6U | (static_cast<unsigned char>(text[at + i]) & 0x3FU);
  return {code, bytes, true};
}

/// Controls, marks of direction and what takes no room: a reader cannot see that they are there.
bool is_unseen(std::uint32_t code) {
  constexpr std::pair<std::uint32_t, std::uint32_t> kRanges[] = {
      {0x00, 0x1F},     {0x7F, 0x9F},     {0xAD, 0xAD},     {0x61C, 0x61C},    {0x115F, 0x1160},
      {0x180E, 0x180E}, {0x200B, 0x200F}, {0x2028, 0x202E}, {0x2060, 0x206F},  {0x3164, 0x3164},
      {0xFEFF, 0xFEFF}, {0xFFA0, 0xFFA0}, {0xFFF0, 0xFFFB}, {0xE0000, 0xE0FFF}};
  return std::ranges::any_of(
      kRanges, [code](const auto& one) { return code >= one.first && code <= one.second; });
}

void append_unit(std::string& out, std::uint32_t unit) {
  out += "\\u";
  for (const int shift : {12, 8, 4, 0}) out += kHex[unit >> shift & 15U];
}

void append_sign(std::string& out, std::string_view text, std::size_t at, const Sign& sign) {
  if (!sign.valid) {
    out += "\\x";
    out += {kHex[sign.code >> 4U], kHex[sign.code & 15U]};
  } else if (!is_unseen(sign.code)) {
    out += text.substr(at, sign.bytes);
  } else if (sign.code < 0x10000) {
    append_unit(out, sign.code);
  } else {  // as JSON has it
    append_unit(out, 0xD800 + ((sign.code - 0x10000) >> 10U));
    append_unit(out, 0xDC00 + ((sign.code - 0x10000) & 0x3FFU));
  }
}

}  // namespace

std::string harmless(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t at = 0; at < text.size();) {
    const Sign sign = sign_at(text, at);
    if (text[at] == '\n' || text[at] == '\t') {
      out += text[at];
    } else {
      append_sign(out, text, at, sign);
    }
    at += sign.bytes;
  }
  return out;
}

std::string shown(std::string_view text, std::size_t most) {
  std::string out;
  std::size_t count = 0;
  for (std::size_t at = 0; at < text.size();) {
    if (count++ == most) return out + "…";
    const Sign sign = sign_at(text, at);
    if (text[at] == '\n') {
      out += "\\n";
    } else {
      append_sign(out, text, at, sign);
    }
    at += sign.bytes;
  }
  return out;
}

std::string quoted_text(std::string_view text) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (code < 32 || code == 127) {
      out += "\\u00";
      out += {kDigits[code >> 4], kDigits[code & 15]};
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string shell_word(std::string_view text) {
  constexpr std::string_view kPlain =
      "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ%+,-./:=@_";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string_view::npos)
    return std::string(text);
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

}  // namespace tandem
