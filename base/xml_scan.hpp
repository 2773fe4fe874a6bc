// Where a tag, comment or processing instruction of an XML text ends, by its bytes.
// Layer: base.  Thread: any.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "base/bounds.hpp"
#include "base/result.hpp"

namespace tandem {

/// Behind the comment, CDATA section, declaration or processing instruction that begins at `at`
/// (behind the text where it has no end); nothing if it is a tag.
[[nodiscard]] std::optional<std::size_t> behind_no_tag(std::string_view text, std::size_t at);

/// Behind the `>` of the tag that begins at `at`, which may have others in quotes.
[[nodiscard]] std::size_t behind_tag(std::string_view text, std::size_t at);

/// Whether an XML parser may have the text: how deep elements are in each other, how many they are
/// and how long their tags (bounds.hpp). What is not well-formed is left to the parser.
/// @param parts  the most elements and attributes
[[nodiscard]] Status check_xml_bounds(std::string_view text, const std::string& file,
                                      const Bound& parts = bounds::kXmlParts);

/// The text with blanks for its processing instructions (<?target …?>), which XML allows wherever
/// an element may be and tinyxml2 only before the first. Lines stay where they are. What calls
/// itself
/// <?xml …?> stays: it is an error but at the beginning. So does one without an end.
[[nodiscard]] std::string without_instructions(std::string_view text);

}  // namespace tandem
