#include "model/xml_reference.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>

namespace tandem::model {
namespace {

/// Whether XML 1.0 has this character.
bool is_xml_character(std::uint32_t code) {
  return code == 0x9 || code == 0xA || code == 0xD || (code >= 0x20 && code < 0xD800) ||
         (code >= 0xE000 && code < 0xFFFE) || (code >= 0x10000 && code < 0x110000);
}

/// Reference that `text` begins with: "&#" to ";", or up to 20 bytes where it has none.
std::string_view reference_at(std::string_view text) {
  constexpr std::size_t kLongest = 20;
  const std::size_t end = text.substr(0, kLongest).find_first_of(";\"'<>\n");
  if (end == std::string_view::npos) return text.substr(0, kLongest);
  return text.substr(0, text[end] == ';' ? end + 1 : end);
}

/// Whether a reference, "&#65;" or "&#x41;", stands for a character.
bool is_character(std::string_view reference) {
  if (!reference.ends_with(';')) return false;
  const bool hexadecimal = reference.substr(2).starts_with('x');
  const char* const first = reference.data() + (hexadecimal ? 3 : 2);
  const char* const last = reference.data() + reference.size() - 1;
  std::uint32_t code = 0;
  const auto read = std::from_chars(first, last, code, hexadecimal ? 16 : 10);
  return read.ec == std::errc{} && read.ptr == last && is_xml_character(code);
}

}  // namespace

std::optional<WrongReference> find_wrong_reference(std::string_view text) {
  for (std::size_t at = 0; (at = text.find_first_of("<&", at)) != std::string_view::npos; ++at) {
    const std::string_view rest = text.substr(at);
    const char* const end = rest.starts_with("<!--")        ? "-->"
                            : rest.starts_with("<![CDATA[") ? "]]>"
                                                            : nullptr;
    if (end != nullptr) at = std::min(text.find(end, at), text.size() - 1);
    if (!rest.starts_with("&#") || is_character(reference_at(rest))) continue;
    const auto lines = std::ranges::count(text.substr(0, at), '\n');
    return WrongReference{1 + static_cast<int>(lines), std::string(reference_at(rest))};
  }
  return std::nullopt;
}

}  // namespace tandem::model
