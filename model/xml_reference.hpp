// References to characters in XML, "&#65;" and "&#x41;": the parser takes wrong ones.
// Layer: model.  Thread: any.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tandem::model {

struct WrongReference {
  int line = 0;      ///< from 1
  std::string text;  ///< as it is written, "&#xD800;"; its beginning where it has no end
};

/// The first reference that stands for no character of XML 1.0: of none, of half of a pair, or
/// unreadable. tinyxml2 takes them as nothing, as what is no UTF-8, or as the text that they are.
/// Comments and CDATA have no references.
[[nodiscard]] std::optional<WrongReference> find_wrong_reference(std::string_view text);

}  // namespace tandem::model
