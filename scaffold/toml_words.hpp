// Names as TOML writes them.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

namespace tandem::scaffold {

/// A basic string: quotes, backslashes and control characters escaped.
/// @pre  `text` is UTF-8
[[nodiscard]] inline std::string toml_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (static_cast<unsigned char>(c) < 32 || c == 127) {
      result += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
    } else {
      result += c;
    }
  }
  return result + '"';
}

/// A key: bare where TOML allows it.
[[nodiscard]] inline std::string key_of(std::string_view name) {
  const bool bare = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return c < 128 && (std::isalnum(c) != 0 || c == '_' || c == '-');
  });
  return bare ? std::string(name) : toml_string(name);
}

/// What stands in a comment: on one line.
[[nodiscard]] inline std::string commented(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  return text;
}

}  // namespace tandem::scaffold
