// Texts of others, such as names, as other languages write them.
// Layer: base.  Thread: any, non-RT.
#pragma once

#include <string>
#include <string_view>

#include "base/bounds.hpp"

namespace tandem {

/// A string of JSON, TOML and C++, in double quotes: quotes, backslashes and control characters
/// escaped.
/// @pre  `text` is UTF-8
[[nodiscard]] std::string quoted_text(std::string_view text);

/// As a terminal or a page may have it: \u001b for control characters but newline and tab, \u202e
/// for those that turn, hide or part the text around them, \xff for bytes that are no UTF-8. JSON
/// that is UTF-8 stays the same JSON.
[[nodiscard]] std::string harmless(std::string_view text);

/// The same of a name or text of others within a line: \n for its newlines; longer ones than `most`
/// characters end with an ellipsis.
[[nodiscard]] std::string shown(std::string_view text, std::size_t most = bounds::kShown.most);

/// A word of a command line, as a shell reads it: in single quotes where it needs them.
[[nodiscard]] std::string shell_word(std::string_view text);

/// In XML and HTML, between tags and as an attribute in double quotes.
[[nodiscard]] std::string xml_text(std::string_view text);

}  // namespace tandem
