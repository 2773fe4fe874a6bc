// Text in lines of a terminal's width.
// Layer: apps/text.  Thread: any.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::apps {

/// Columns that a UTF-8 text takes: bytes that do not continue a character.
[[nodiscard]] std::size_t columns_of(std::string_view text);

/// `text` with blanks behind it, or before it, to so many columns.
[[nodiscard]] std::string left(const std::string& text, std::size_t columns);
[[nodiscard]] std::string right(const std::string& text, std::size_t columns);

/// `text` in `most` columns at most: with an ellipsis where it is cut, at its end or in its middle.
[[nodiscard]] std::string cut_to(std::string text, std::size_t most, bool middle = false);

/// `text` in lines of at most `most` columns, broken at blanks; a longer word is a line.
[[nodiscard]] std::vector<std::string> wrapped(const std::string& text, std::size_t most);

/// Columns of a line on `out`: $COLUMNS, else the terminal's, from 40 to `widest`; `otherwise`
/// where `out` is no terminal.
[[nodiscard]] std::size_t line_columns(std::FILE* out, std::size_t otherwise, std::size_t widest);

}  // namespace tandem::apps
