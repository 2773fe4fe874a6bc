// Texts of others, such as names, as other languages write them.
// Layer: base.  Thread: any, non-RT.
#pragma once

#include <string>
#include <string_view>

namespace tandem {

/// A string of JSON, TOML and C++, in double quotes: quotes, backslashes and control characters
/// escaped.
/// @pre  `text` is UTF-8
[[nodiscard]] std::string quoted_text(std::string_view text);

/// A word of a command line, as a shell reads it: in single quotes where it needs them.
[[nodiscard]] std::string shell_word(std::string_view text);

/// In XML and HTML, between tags and as an attribute in double quotes.
[[nodiscard]] std::string xml_text(std::string_view text);

}  // namespace tandem
