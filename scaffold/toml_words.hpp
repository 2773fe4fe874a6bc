// Names as TOML writes them.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

#include "base/quoting.hpp"

namespace tandem::scaffold {

/// A key: bare where TOML allows it.
[[nodiscard]] inline std::string key_of(std::string_view name) {
  const bool bare = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return c < 128 && (std::isalnum(c) != 0 || c == '_' || c == '-');
  });
  return bare ? std::string(name) : quoted_text(name);
}

/// What stands in a comment: on one line.
[[nodiscard]] inline std::string commented(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  return text;
}

}  // namespace tandem::scaffold
